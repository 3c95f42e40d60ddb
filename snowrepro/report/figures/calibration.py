"""How the pressures were chosen that the paper does not print."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from ...evidence.calibration import calibrate_pressures
from ...evidence.gather import Evidence
from ...quantities import add_unit
from ..document import NO_RESULT, FigureContent, Picture
from ..drawing.common import save_figure
from ..sections.specification import search_other_pressures
from .kinds import FigureKind


def report(evidence: Evidence) -> FigureContent:
    """Draw the lumps over pressure, and say which pressures reach the targets."""
    targets, table = evidence.experiment.targets, evidence.table
    if table.empty:
        return NO_RESULT
    chosen = calibrate_pressures(table, targets) if len(table) > 1 else [None] * len(targets)
    unit = evidence.pressure_unit
    draw_calibration(table, targets, chosen, add_unit("nominal pressure", unit), evidence.folder / "curve.png")
    pressures = ", ".join("not reached" if pressure is None else f"{pressure:g}" for pressure in chosen)
    verdict = f"Pressures for lump fractions {', '.join(f'{target:g}' for target in targets)}: {pressures} {unit}."
    curve = Picture(
        "curve.png",
        "Mass fraction in lumps over pressure, rising, with the targets and the pressures that reach them.",
        "A rising curve is fitted over log pressure (isotonic regression) and read off at the targets. "
        "Only the sintered runs of this scene are used; rows without sintering and all other scenes are not.",
        data="summary.csv",
    )
    return FigureContent([curve, *search_other_pressures(evidence)], verdict)


def draw_calibration(
    table: pd.DataFrame, targets: Sequence[float], chosen: Sequence[float | None], label: str, path: Path
) -> None:
    """Draw the mass in lumps over pressure, with the targets and the pressures that reach them.

    ``chosen``: the pressure for each target; None if the target is not reached; ``label``: of the axis of pressures.
    """
    figure = Figure(figsize=(5.2, 3.8), layout="constrained")
    ax = figure.subplots()
    means = table.groupby("pressure")["lump_fraction"].mean()
    ax.plot(table["pressure"], table["lump_fraction"], "o", color="#307a78", label="runs")
    ax.plot(means.index, means, "-", color="#307a78", lw=1)
    for target, pressure in zip(targets, chosen, strict=True):
        ax.axhline(target, color="0.7", lw=0.8)
        if pressure:
            ax.plot([pressure], [target], "D", color="#D55E00")
            ax.annotate(f"{pressure:g}", (pressure, target), xytext=(6, -12), textcoords="offset points")
    ax.set(xscale="log", ylim=(-0.03, 1.03), xlabel=label, ylabel="mass in lumps")
    ax.legend(frameon=False)
    save_figure(figure, path)


FIGURE = FigureKind(report, needs=("targets",))
