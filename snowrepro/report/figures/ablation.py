"""Laws and constants left out, each alone and each without the others: what becomes of the snow, beside all of them."""

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...evidence.ablation import (
    LEAST_CHANGE,
    LUMPS,
    MEASURES,
    STATES,
    VARIANT,
    Ablation,
    split_variants,
    tabulate_ablation,
)
from ...evidence.gather import Evidence
from ...text import make_cells
from ..document import NO_RESULT, Block, FigureContent, Picture, Table, escape, join_names
from ..drawing.common import SINTERED, choose_font, save_figure
from ..drawing.states import CRUSHED, LOOSE
from .kinds import FigureKind

CSV, PICTURE = "ablation.csv", "ablation.png"
WITHOUT, ALONE = "no_", "only_"
UNSINTERED = "unsintered"
# What the variants of experiments/ablation.yaml leave out, or leave alone.
WORDS = {
    "eq2": "Eq. 2 (density)",
    "C1": "C₁ (Eq. 2, internal force)",
    "C2": "C₂ (Eq. 2, external force)",
    "eq7": "Eqs. 7 and 8 (elasticity)",
    "young": "growth of Young's modulus",
    "poisson": "growth of Poisson's ratio",
    "eq9": "Eq. 9 (hardening)",
    "C4": "C₄ (Eq. 9, internal force)",
    "C5": "C₅ (Eq. 9, external force)",
    "first_xi": "the first ξ of Eq. 1",
    "hardening": "hardening of any kind",
}
OTHER_WORDS = {
    "base": "all laws",
    UNSINTERED: "no sintering",
    "higher_cap": "all laws, the factor of Eq. 1 up to e⁸, not e⁵",
}
COLOURS = dict(zip(STATES, (SINTERED, CRUSHED, LOOSE), strict=True))
HEADS = dict(zip(MEASURES, ("lump", "crushed", "loose", "height lost"), strict=True))


def report(evidence: Evidence) -> FigureContent:
    """Show what becomes of the snow with each law left out and each constant alone, beside all laws."""
    if evidence.table.empty or LUMPS not in evidence.sweep.columns:
        return NO_RESULT
    ablation = tabulate_ablation(evidence.sweep)
    make_cells(ablation.table).to_csv(evidence.folder / CSV, index=False, float_format="%.6g", lineterminator="\n")
    draw_ablation(ablation, evidence)
    picture = Picture(
        PICTURE,
        "Mass in lumps, crushed and loose, a bar for each variant and a panel for each pressure.",
        "Parts of the mass at the end, means over seeds; the line at each bar is the range of the mass in lumps over "
        "the seeds, the dotted line the mean of the whole.",
        data=CSV,
    )
    seeds = int(ablation.table["asked"].max())
    caption = (
        f"Parts of the mass at the end, and height lost since the release; means over {seeds} seed{'s' * (seeds > 1)}. "
        f"Pressures in {evidence.pressure_unit}. In words a change is told if it is {LEAST_CHANGE:g} of the mass or "
        "more, and no seed with all laws lies among those without one."
    )
    blocks: list[Block] = [picture, Table(_tabulate(ablation), caption, CSV)]
    return FigureContent(blocks, " ".join(_describe(ablation, pressure) for pressure in ablation.pressures))


def name_variant(variant: str) -> str:
    """Name a variant in words: what it leaves out, or alone; as it is called where there are no words."""
    for prefix, before, after in ((WITHOUT, "without ", ""), (ALONE, "", " alone")):
        if variant.startswith(prefix):
            return f"{before}{_name(variant)}{after}"
    return OTHER_WORDS.get(variant, variant)


def _name(variant: str) -> str:
    """Name the law or constant that a variant leaves out or alone."""
    key = variant.removeprefix(WITHOUT).removeprefix(ALONE)
    return WORDS.get(key, key)


def _shorten(variant: str) -> str:
    """Name the law or constant of a variant without what is said of it in brackets."""
    return _name(variant).partition(" (")[0]


def _describe(ablation: Ablation, pressure: float) -> str:
    """Say in words what leaving out does at a pressure, and what each constant does alone."""
    whole = ablation.row(ablation.whole, pressure)[LUMPS]
    if math.isnan(whole):
        return f"At {pressure:g} the whole has no result."
    left_out = [variant for variant in ablation.variants if variant.startswith(WITHOUT)]
    split = split_variants(ablation, left_out, pressure)
    phrases = {"halved": "{} half or more of it is gone", "less": "{} it is less", "more": "{} it is more"}
    parts = [
        phrase.format(f"without {join_names([_list_value(ablation, v, pressure) for v in split[kind]], 'or')}")
        for kind, phrase in phrases.items()
        if split[kind]
    ]
    if split["same"]:
        parts.append(f"nothing changes without {join_names([_shorten(v) for v in split['same']], 'or')}")
    if split["unknown"]:
        parts.append(f"not known without {join_names([_shorten(v) for v in split['unknown']], 'or')}")
    alone = [_list_value(ablation, v, pressure) for v in ablation.variants if v.startswith(ALONE)]
    if alone:
        parts.append(f"alone, {join_names(alone, 'and')}")
    before = f"At {pressure:g} all laws leave {whole:.2f} of the mass in lumps"
    if UNSINTERED in ablation.variants:
        before += f", no sintering {_format(ablation.row(UNSINTERED, pressure)[LUMPS])}"
    return f"{before}: {'; '.join(parts)}." if parts else f"{before}."


def _list_value(ablation: Ablation, variant: str, pressure: float) -> str:
    """Name a variant's law or constant with its mass in lumps in brackets."""
    return f"{_shorten(variant)} ({_format(ablation.row(variant, pressure)[LUMPS])})"


def _format(value: float) -> str:
    """Write a part of the mass; a dash where there is none."""
    return "-" if math.isnan(value) else f"{value:.2f}"


def _tabulate(ablation: Ablation) -> pd.DataFrame:
    """Tabulate the variants for a page: MEASURES at each pressure, lumps with their range over seeds."""
    rows = []
    for variant in ablation.variants:
        row = {"laws": escape(name_variant(variant))}
        for pressure in ablation.pressures:
            numbers = ablation.row(variant, pressure)
            spread = f" ({numbers['least']:.2f} to {numbers['most']:.2f})" if numbers["done"] > 1 else ""
            cells = {f"{HEADS[each]}, {pressure:g}": _format(numbers[each]) for each in MEASURES}
            lumps = f"{HEADS[LUMPS]}, {pressure:g}"
            row |= {**cells, lumps: cells[lumps] + spread}
        done, asked = (
            int(ablation.table.loc[ablation.table[VARIANT] == variant, key].sum()) for key in ("done", "asked")
        )
        rows.append({**row, "runs": f"{done} of {asked}"})
    return pd.DataFrame(rows)


def draw_ablation(ablation: Ablation, evidence: Evidence) -> None:
    """Draw a panel for each pressure: a bar for each variant, of lumps, crushed and loose snow."""
    variants, pressures = ablation.variants, ablation.pressures
    size = (2.4 + 2.6 * len(pressures), 0.3 * len(variants) + 1.2)
    letters = choose_font(size[0], 9.0)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(1, len(pressures), sharey=True, squeeze=False).ravel()
    for ax, pressure in zip(axes, pressures, strict=True):
        _draw_bars(ax, ablation, pressure)
        ax.set_title(f"{pressure:g} {evidence.pressure_unit}", fontsize=letters + 1)
        ax.set_xlabel("part of the mass", fontsize=letters)
        ax.tick_params(labelsize=letters)
    axes[0].set_yticks(range(len(variants)), [name_variant(variant) for variant in variants], fontsize=letters)
    axes[0].invert_yaxis()
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, frameon=False, fontsize=letters)
    save_figure(figure, evidence.folder / PICTURE)


def _draw_bars(ax: Axes, ablation: Ablation, pressure: float) -> None:
    """Draw the bars of a pressure, and the mass in lumps of the whole as a line."""
    rows = pd.DataFrame([ablation.row(variant, pressure) for variant in ablation.variants])
    places, left = np.arange(len(rows)), np.zeros(len(rows))
    for state in STATES:
        width = rows[state].fillna(0.0).to_numpy(float)
        ax.barh(places, width, 0.72, left, color=COLOURS[state], label=HEADS[state], edgecolor="0.4", linewidth=0.5)
        left = left + width
    for colour, width, style in (("w", 4.0, "-"), ("k", 2.0, ":")):  # black alone is not seen on crushed snow
        ax.hlines(places, rows["least"], rows["most"], color=colour, lw=width)
        ax.axvline(rows[LUMPS].iloc[0], color=colour, lw=width / 2.2, ls=style)
    _mark_missing(ax, rows[LUMPS].isna().tolist())
    ax.set_xlim(0, 1)


def _mark_missing(ax: Axes, is_missing: Sequence[bool]) -> None:
    """Write where a bar would be that there is no result."""
    for place, missing in enumerate(is_missing):
        if missing:
            ax.text(0.5, place, "no result", ha="center", va="center", fontsize=8, color="0.4")


FIGURE = FigureKind(report)
