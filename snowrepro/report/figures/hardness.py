"""Hardness and lumps: the force on an indenter, how the same snow falls, and whether lumps follow hardness."""

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ...evidence.gather import Evidence, sort_as_in_paper
from ...evidence.hardness import (
    APART,
    ARM_LABELS,
    KEYS,
    LEVEL,
    MEASURES,
    describe_equal_hardness,
    find_equal_hardness,
    pair_falls_with_tests,
    select_arm_pairs,
    tabulate_correlations,
    tabulate_hardness_by_depth,
    write_sentence,
)
from ...quantities import add_unit, format_unit
from ...settings.case import ARMS
from ...store.run import Run
from ...summary.measure import read_curve
from ...text import make_cells
from ..document import NO_RESULT, Block, FigureContent, Heading, Picture, Table
from ..drawing.common import SINTERED, UNSINTERED, save_figure
from .kinds import FigureKind

LOOKS = dict(zip(ARMS, ((SINTERED, "o"), (UNSINTERED, "s")), strict=True))  # colour and mark of each arm
RULE = (
    f"The rule: lumps follow hardness if Spearman's rank correlation is above zero with p at most {LEVEL:g} "
    "(permutations, two-sided) among the sintered snows and among all together, and if no unsintered snow differs by "
    f"more than {APART:g} from the lumps of sintered snow as hard; only in part if not all three hold, but one of the "
    "correlations. Unsintered snow that pressing left as it was is one snow at several pressures, and counts once. The "
    "correlations were asked for when four of the hardness tests and the lumps of most falls were known; the third "
    "condition, and pressure 16000 that puts it to a test, when coarse runs had shown unsintered snow as hard."
)
CAUTION = (
    "Within an arm every measure may rise with pressure alone; the column of all runs is the harder test. One seed a "
    "pressure: neighbouring pressures may change places by chance."
)
THINNED = 4  # points of a curve to one in its file
CURVES = Picture(
    "curves.png",
    "Force on the indenter over its depth, a line for each pressure, with and without sintering.",
    "Force at unit depth out of the plane over the depth below first touch. It begins before the touch, because the "
    "grid carries contact about half a spacing ahead of the particles, and steps where the disc reaches the next row "
    "of nodes. The data are every fourth point that is drawn.",
    data="curves.csv",
)
ALL_MEASURES = Picture(
    "measures.png",
    "Four panels over pressure: hardness, flattening, rebound and mass in lumps, with and without sintering.",
    "Flattening: height lost since release, of the middle nine tenths of the mass, at most and at the end. Rebound: "
    "largest upward speed of the centre of mass after the impact, over the speed of the impact.",
    data="summary.csv",
)


def report(evidence: Evidence) -> FigureContent:
    """Draw curves of the indenter, all measures over pressure and lumps over hardness, and give the verdict."""
    if evidence.table.empty:
        return NO_RESULT
    indented = [run for run in sort_as_in_paper(evidence.runs) if run.case.indenter and evidence.is_done(run)]
    pairs = pair_falls_with_tests(evidence.table).join(tabulate_hardness_by_depth(indented))
    _draw_curves(indented, evidence)
    _draw_measures(pairs, evidence)
    _draw_scatter(pairs, evidence)
    unit = evidence.pressure_unit  # and of hardness
    measures = pairs.reset_index()[[*KEYS[1:], *MEASURES, "indentation_work"]]
    blocks: list[Block] = [
        RULE,
        Picture(
            "scatter.png",
            "Mass in lumps over hardness, a point for each snow, with and without sintering.",
            _describe_equal_hardness(pairs),
            data="summary.csv",
        ),
        Heading("The indenter"),
        *_describe_method(indented),
        CURVES,
        Heading("Fall and hardness over pressure"),
        ALL_MEASURES,
        Table(measures.rename(columns=_list_heads(unit))),
        Heading("Rank correlation of lumps with each measure"),
        Table(tabulate_correlations(pairs)),
        CAUTION,
    ]
    return FigureContent(blocks, write_sentence(pairs, unit))


def _list_heads(unit: str) -> dict[str, str]:
    """List the heads of the table of measures by column.  ``unit``: of pressure and hardness."""
    with_unit = {name: add_unit(name, unit) for name in ("pressure", "hardness")}
    return {**MEASURES, **with_unit, "indentation_work": "work of indentation"}


def _describe_equal_hardness(pairs: pd.DataFrame) -> str:
    """Describe the lumps of unsintered snow beside those of sintered snow of the same hardness."""
    if any(select_arm_pairs(arm, pairs).dropna(subset=["hardness", "lump_fraction"]).empty for arm in ARMS):
        return "Not compared at equal hardness: falls and hardness tests of both kinds of snow are needed."
    alike = find_equal_hardness(pairs)
    if alike.empty:
        return "No unsintered snow is as hard as any sintered: at equal hardness the two cannot be compared."
    return f"At equal hardness (sintered: between neighbours, over log hardness): {describe_equal_hardness(alike)}."


def _describe_method(runs: Sequence[Run]) -> list[str]:
    """Describe the hardness test; nothing without one."""
    if not runs or runs[0].case.indenter is None:
        return []
    test = runs[0].case.indenter
    return [
        (
            f"A run of its own for each snow. At release gravity stays away, the snow rests for {test.rest_frames} "
            f"frames (damping {test.rest_damping:g}/s), then its lower half is held and a rigid disc of radius "
            f"{test.radius:g} cells, friction {test.friction:g}, goes down over its centroid at {test.speed:g} "
            f"cells/s, {test.depth:g} cells from first touch. Force is the disc's impulse on nodes and particles over "
            "the frame's time. Hardness is force over the disc's chord in the last tenth of the depth; work is force "
            "over the whole way. The chord is the disc's own: what the snow sinks or piles up beside it is not seen. "
            "Half the speed gives the same hardness within 5 % (tests/validation/test_indenter.py)."
        ),
    ]


def _make_panels(count: int) -> tuple[Figure, list[Axes]]:
    """Make a figure with ``count`` panels side by side."""
    figure = Figure(figsize=(4.2 * count, 3.8), layout="constrained")
    return figure, list(figure.subplots(1, count, squeeze=False)[0])


def _draw_curves(runs: Sequence[Run], evidence: Evidence) -> None:
    """Draw force over depth: a panel for each arm, a colour for each pressure."""
    figure, axes = _make_panels(2)
    pressures = sorted({run.case.pressure for run in evidence.runs})
    shade = LogNorm(pressures[0] * 0.999, pressures[-1] * 1.3)
    curves: list[pd.DataFrame] = []
    for ax, (arm, label) in zip(axes, ARM_LABELS.items(), strict=True):
        for run in (run for run in runs if run.case.arm == arm):
            curve, unit = _read_curve(run)
            curves.append(curve)
            pushed = curve[curve["force"] > 0]
            colour = mpl.colormaps["viridis_r"](shade(run.case.pressure))
            ax.plot(pushed["depth"], pushed["force"], lw=1.1, color=colour, label=f"{run.case.pressure:g}")
            axes[0].set_ylabel(add_unit("force", format_unit(unit)))
        ax.axvline(0, color="0.8", lw=0.8, zorder=0)
        ax.set(yscale="log", xlabel="depth below first touch [cells]", title=label)
        if ax.lines[1:]:
            ax.legend(
                title=add_unit("pressure", evidence.pressure_unit), fontsize=8, title_fontsize=8, frameon=False, ncols=2
            )
    if curves:
        table = pd.concat(curves)
        kept = make_cells(table.iloc[::THINNED])
        kept.to_csv(evidence.folder / CURVES.data, index=False, float_format="%.5g", lineterminator="\n")
        highest, last = table["force"].max(), table["depth"].max()
        for ax in axes:
            ax.set(xlim=(-0.4 * last, 1.03 * last), ylim=(1e-4 * highest, 2 * highest))
    save_figure(figure, evidence.folder / CURVES.file)


def _read_curve(run: Run) -> tuple[pd.DataFrame, str]:
    """Read force over depth of a hardness test as a table; returns it and the unit of the force."""
    with run.open() as dataset:
        depth, force = read_curve(dataset)
        unit = dataset["indenter_force"].attrs["units"]
    labels: dict[str, Any] = {"sintering": run.case.sintering.name, "pressure": run.case.pressure}
    return pd.DataFrame({**labels, "depth": depth, "force": force}), unit


def _draw_measures(pairs: pd.DataFrame, evidence: Evidence) -> None:
    """Draw all measures over pressure, both arms."""
    figure = Figure(figsize=(8.4, 6.8), layout="constrained")
    axes = figure.subplots(2, 2).ravel()
    pressures, unit = sorted({run.case.pressure for run in evidence.runs}), evidence.pressure_unit
    panels = (["hardness"], ["flattening_most", "flattening_end"], ["rebound"], ["lump_fraction"])
    for ax, names in zip(axes, panels, strict=True):
        for arm, (colour, mark) in LOOKS.items():
            rows = select_arm_pairs(arm, pairs).groupby("pressure").mean()
            for name, style in zip(names, ("-", "--"), strict=False):
                end = ", at the end" if style == "--" else ""
                ax.plot(rows.index, rows[name], mark + style, color=colour, ms=4, lw=1.2, label=ARM_LABELS[arm] + end)
        ax.set(xscale="log", xlabel=add_unit("nominal pressure", unit))
        label = MEASURES[names[0]].replace(" at most", "")
        ax.set_ylabel(add_unit(label, unit) if names[0] == "hardness" else label)
        ax.set_xticks(pressures, [f"{pressure:g}" for pressure in pressures], rotation=60, fontsize=8)
        ax.minorticks_off()
        if names[0] == "hardness":
            ax.set_yscale("log" if (pairs["hardness"] > 0).any() else "linear")  # nothing measured yet
        else:
            ax.set_ylim(bottom=min(0.0, *ax.get_ylim()))
    axes[1].legend(fontsize=8, frameon=False)
    axes[0].legend(fontsize=8, frameon=False)
    save_figure(figure, evidence.folder / ALL_MEASURES.file)


def _group_labels(rows: pd.DataFrame) -> list[tuple[tuple[float, float], str]]:
    """Group points that lie on each other; returns the place and the label with the pressures of each group."""
    near = [np.log10(rows["hardness"]).round(1), (25.0 * rows["lump_fraction"]).round()]
    return [
        (tuple(part[["hardness", "lump_fraction"]].max()), _format_range([pressure for pressure, _ in part.index]))
        for _, part in rows.groupby(near, sort=False)
    ]


def _format_range(pressures: Sequence[float]) -> str:
    """Format the lowest and the highest pressure."""
    low, high = f"{min(pressures):g}", f"{max(pressures):g}"
    return low if low == high else f"{low} to {high}"


def _draw_scatter(pairs: pd.DataFrame, evidence: Evidence) -> None:
    """Draw lumps over hardness, each point with its pressure."""
    figure = Figure(figsize=(5.4, 4.4), layout="constrained")
    ax = figure.subplots()
    for arm, (colour, mark) in LOOKS.items():
        rows = select_arm_pairs(arm, pairs).dropna(subset=["hardness", "lump_fraction"])
        ax.plot(rows["hardness"], rows["lump_fraction"], mark, color=colour, label=ARM_LABELS[arm])
        for number, (point, text) in enumerate(_group_labels(rows)):
            above = 5 if arm == ARMS[0] else -12 - 8 * (number % 2)  # where one would lie on the next
            ax.annotate(text, point, (0, above), textcoords="offset points", fontsize=8, color=colour, ha="center")
    ax.axhline(0.5, color="0.85", lw=0.8, zorder=0)
    ax.margins(x=0.1)
    if (pairs["hardness"] > 0).any():
        ax.set_xscale("log")
    ax.set(
        ylim=(-0.1, 1.05),
        xlabel=add_unit(MEASURES["hardness"], evidence.pressure_unit),
        ylabel=MEASURES["lump_fraction"],
    )
    ax.legend(frameon=False, fontsize=8)
    save_figure(figure, evidence.folder / "scatter.png")


FIGURE = FigureKind(report, takes_indenter=True)
