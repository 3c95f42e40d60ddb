"""Does a verdict hang on the definition of a lump?  The whole scan in one table, one curve and the exceptions."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..analysis import claims
from ..analysis.calibration import HALF
from ..analysis.sensitivity import CHOICES, scan, tree_curve
from ..config import Config
from .broken import colours_of
from .document import Block, Heading, Picture, Table, listed
from .drawing import save
from .evidence import Evidence

STRAINS_TO = 0.8  # where the curves over the break strain end
KEPT, LOST, USUAL = "#0072B2", "#bbbbbb", "#D55E00"
NAMES = {
    "definition": "definition",
    "break_by": "bonds break by",
    "break_strain": "break strain",
    "core_fraction": "core rule",
    "link_length": "longest bond",
    "lump_mass": "least lump",
}


def section(evidence: Evidence) -> list[Block]:
    """Every definition's lumps and whether the claims' numbers hold, or why that cannot be said."""
    configs = list(evidence.configs)
    lacking = _lacking(evidence)
    if lacking:
        return [Heading("Does it hang on the definition of a lump?"), f"Not scanned: {lacking}."]
    choices, lumps = _scan(configs)
    judged = [c for c in configs[0].claims.list if c.test != "scenes" and c.measure == "lump_fraction"]
    judged = [c for c in judged if set(claims.ARMS_OF[c.of]) <= set(lumps.columns.get_level_values("arm"))]
    holds = pd.DataFrame({claim.name: claims.points(claim, lumps) for claim in judged})
    _write(choices, lumps, holds, evidence)
    usual = _usual(choices, configs[0])
    draw_specifications(choices, lumps, holds, usual, evidence)
    draw_strains(configs, evidence)
    return [
        Heading("Does it hang on the definition of a lump?"),
        f"All runs under {len(choices)} definitions: six choices in all combinations, and three other rules of what "
        "holds together. By the means over seeds the claims hold in this part of them:",
        Table(_by_choice(choices, holds), data="sensitivity.csv"),
        *_exceptions(choices, holds, usual),
        Picture(
            "specification.png",
            "Specification curve: every definition, sorted by what pressure does to the lumps under it, and below what "
            "each chose.",
            "Top: lumps at the highest less those at the lowest pressure, sintered; blue where all claims hold, grey "
            "where one is lost, the definition used here in orange. Below: what each definition chose. This shows how "
            "much hangs on the choices; it is not one better test, and its definitions are no independent trials.",
            data="sensitivity.csv",
        ),
        Picture(
            "strains.png",
            "Mass in lumps over the strain at which a bond breaks, a curve for each run, falling with pressure.",
            "Mass in lumps over the break strain, all else as used here; each curve is one run and comes from one "
            "tree. The upright line is the strain used.",
            data="strains.csv",
        ),
    ]


def of_other_pressures(evidence: Evidence) -> list[Block]:
    """Whether other definitions would also find three pressures at which C1 to C3 hold, from a ladder of them.

    A definition that was not used to choose the pressures is at a disadvantage in ``section``; not so here.
    """
    configs = [config for config in evidence.configs if config.sintering.enabled]
    pressures = {config.pressure for config in configs}
    if len(pressures) < 3 or not all(evidence.is_done(config) for config in configs):
        return []
    choices, lumps = _scan(configs)
    found = pd.DataFrame({"three such pressures": _any_three(lumps["sintered"].to_numpy())})
    return [
        Heading("Would other definitions of a lump find such pressures?"),
        f"For each of {len(choices)} definitions: are there three of the {len(pressures)} pressures at which, by means "
        "over seeds, lumps grow, the lowest gives more powder and the highest more lumps? There the definition is not "
        "the one by which the pressures were chosen, but each has its own.",
        Table(_by_choice(choices, found).drop(columns="all claims")),
    ]


def _any_three(values: np.ndarray) -> np.ndarray:
    """Whether a row of ``values`` (definitions, rising pressures) has three that rise from below to above one half."""
    found = np.zeros(len(values), dtype=bool)
    for low, middle, high in combinations(values.T, 3):
        found |= (low < middle) & (middle < high) & (low < HALF) & (high > HALF)
    return found


def _lacking(evidence: Evidence) -> str:
    """Why there is nothing to scan; empty if there is."""
    if not all(evidence.is_done(config) for config in evidence.configs):
        return "runs are missing"
    if len({(config.shape.name, config.floor.name) for config in evidence.configs}) > 1:
        return "these are several scenes"
    if len({config.pressure for config in evidence.configs if config.sintering.enabled}) < 2:
        return "there is no second pressure with sintering"
    return ""


def _scan(configs: Sequence[Config]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """All definitions, columns CHOICES, and the lumps under each by arm and pressure, means over seeds."""
    by_run: dict[tuple[str, float], list[pd.Series]] = {}
    for config in configs:
        found = scan(config)
        key = claims.arm(config), config.pressure
        by_run.setdefault(key, []).append(found["lump_fraction"])
    lumps = pd.DataFrame({key: pd.concat(by_run[key], axis=1).mean(axis=1) for key in sorted(by_run)})
    lumps.columns = pd.MultiIndex.from_tuples(lumps.columns, names=["arm", "pressure"])
    return found[list(CHOICES)], lumps


def _usual(choices: pd.DataFrame, config: Config) -> int:
    """Which row is the definition that the reports use; -1 if it is not among them."""
    analysis = config.analysis.model_dump()
    same = np.ones(len(choices), dtype=bool)
    for name in CHOICES:
        same &= (choices[name] == analysis[name]).to_numpy()
    return int(np.argmax(same)) if same.any() else -1


def _write(choices: pd.DataFrame, lumps: pd.DataFrame, holds: pd.DataFrame, evidence: Evidence) -> None:
    flat = lumps.set_axis([f"{arm} {pressure:g}" for arm, pressure in lumps.columns], axis=1)
    table = pd.concat([choices, flat, holds], axis=1)
    table.to_csv(evidence.folder / "sensitivity.csv", index=False, float_format="%.4g", lineterminator="\n")


def _by_choice(choices: pd.DataFrame, holds: pd.DataFrame) -> pd.DataFrame:
    """For each value of each choice the part of the definitions with it in which each claim holds."""
    rows = [{"choice": "all", "value": "", "definitions": len(holds), **_percent(holds)}]
    bonds = choices["definition"] == "bonds"
    for name in CHOICES:
        of = choices if name == "definition" else choices[bonds]
        for value, rows_with in of.groupby(name, sort=True).groups.items():
            part = holds.loc[rows_with]
            shown = f"{value:g}" if isinstance(value, float) else str(value)
            rows.append({"choice": NAMES[name], "value": shown, "definitions": len(part), **_percent(part)})
    return pd.DataFrame(rows)


def _percent(values: pd.DataFrame) -> dict[str, str]:
    return {name: f"{100 * column.mean():.0f} %" for name, column in values.items()} | {
        "all claims": f"{100 * values.all(axis=1).mean():.0f} %"
    }


def _exceptions(choices: pd.DataFrame, holds: pd.DataFrame, usual: int) -> list[str]:
    """Single changes of the definition used here that lose a claim."""
    if usual < 0:
        return ["The definition used here is not among them."]
    base = choices.iloc[usual]
    lines = []
    for row in range(len(choices)):
        changed = [name for name in CHOICES if choices.iloc[row][name] != base[name]]
        other_rule = choices.iloc[row]["definition"] != base["definition"]
        if other_rule and choices.iloc[row]["lump_mass"] != base["lump_mass"]:
            continue
        if len(changed) == 1 or other_rule:
            lost = [name for name in holds if holds[name].iloc[usual] and not holds[name].iloc[row]]
            if lost:
                lines.append(f"{_told(choices.iloc[row], changed)}: {', '.join(lost)}")
    head = "Changed one at a time from the definition used here, these lose a claim:"
    return [head, listed(lines)] if lines else ["No single change of the definition used here loses a claim."]


def _told(choice: pd.Series, changed: Sequence[str]) -> str:
    """What was changed, in words."""
    if "definition" in changed:
        detail = {"proximity": "link_length", "damage": "core_fraction"}.get(choice["definition"])
        return f"{choice['definition']} {choice[detail]:g}" if detail else str(choice["definition"])
    return ", ".join(f"{NAMES[name]} {choice[name]}" for name in changed)


def draw_specifications(
    choices: pd.DataFrame, lumps: pd.DataFrame, holds: pd.DataFrame, usual: int, evidence: Evidence
) -> None:
    """The specification curve: the effect under every definition, and below it what each chose."""
    sintered = lumps["sintered"]
    effect = (sintered.iloc[:, -1] - sintered.iloc[:, 0]).to_numpy()
    order = np.argsort(effect, kind="stable")
    kept = holds.all(axis=1).to_numpy()[order]
    choices = choices.iloc[order]
    levels = [(name, value) for name in CHOICES for value in _values(choices, name)]
    figure = Figure(figsize=(9.5, 2.6 + 0.17 * len(levels)), layout="constrained")
    top, below = figure.subplots(2, 1, sharex=True, height_ratios=[2.2, 0.17 * len(levels)])
    places = np.arange(len(order))
    top.axhline(0, color="0.6", lw=0.8)
    top.scatter(places, effect[order], s=5, c=np.where(kept, KEPT, LOST))
    rank = int(np.argmax(order == usual))
    if usual >= 0:
        top.plot([rank], [effect[usual]], "D", color=USUAL, ms=6)
        below.axvline(rank, color=USUAL, lw=0.8)
    top.set_ylabel("lumps, highest less\nlowest pressure [1]", fontsize=9)
    top.set_title(f"all claims hold under {kept.sum()} of {len(kept)} definitions", fontsize=10, loc="left")
    _draw_choices(below, choices, levels, kept)
    below.set_xlabel("definitions, by rising effect", fontsize=9)
    save(figure, evidence.folder / "specification.png")


def _values(choices: pd.DataFrame, name: str) -> list:
    """Levels of one choice; empty and NaN do not apply."""
    return [value for value in sorted(choices[name].dropna().unique()) if value != ""]


def _draw_choices(ax: Axes, choices: pd.DataFrame, levels: list[tuple], kept: np.ndarray) -> None:
    """A row of marks for each level of each choice."""
    labels = []
    for row, (name, value) in enumerate(levels):
        places = np.flatnonzero((choices[name] == value).to_numpy())
        ax.scatter(places, np.full(len(places), row), s=9, marker="|", c=np.where(kept[places], KEPT, LOST), lw=0.7)
        shown = f"{value:g}" if isinstance(value, float) else str(value)
        first = row == 0 or levels[row - 1][0] != name
        labels.append(f"{NAMES[name]}   {shown}" if first else shown)
    ax.set(yticks=range(len(levels)), ylim=(len(levels) - 0.3, -0.7))
    ax.set_yticklabels(labels, fontsize=7)
    ax.tick_params(axis="y", length=0)


def draw_strains(configs: Sequence[Config], evidence: Evidence) -> None:
    """Mass in lumps over the break strain, from each run's tree."""
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    ax = figure.subplots()
    colours = colours_of(configs)
    curves, steps = {}, np.linspace(0, STRAINS_TO, 161)
    for config in configs:
        strain, lumps = tree_curve(config)
        held = lumps[np.searchsorted(strain, steps, side="right") - 1]
        curves[f"{claims.arm(config)} {config.pressure:g} seed {config.seed}"] = held
        style = "-" if config.sintering.enabled else ":"
        label = f"{config.pressure:g}, {'sintered' if config.sintering.enabled else 'not sintered'}"
        ax.step(strain, lumps, style, where="post", color=colours[config.pressure], lw=1.2, label=label)
    ax.axvline(configs[0].analysis.break_strain, color=USUAL, lw=0.8)
    ax.axhline(0.5, color="0.6", lw=0.8, ls=":")
    ax.set(xlim=(0, STRAINS_TO), ylim=(-0.02, 1.02), xlabel="break strain [1]", ylabel="mass in lumps [1]")
    handles, labels = ax.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    figure.legend(once.values(), once.keys(), loc="outside right center", frameon=False, fontsize=8, title="pressure")
    save(figure, evidence.folder / "strains.png")
    table = pd.DataFrame(curves, index=pd.Index(steps, name="break_strain"))
    table.to_csv(evidence.folder / "strains.csv", float_format="%.4g", lineterminator="\n")
