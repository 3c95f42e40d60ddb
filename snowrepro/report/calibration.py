"""How the three pressures that the paper does not print were chosen."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from ..analysis.calibration import calibrate
from .document import NOTHING, Findings, Picture
from .drawing import save
from .evidence import Evidence
from .sensitivity import of_other_pressures


def report(evidence: Evidence) -> Findings:
    """The chosen pressures and the curve that they were read from."""
    targets, table = evidence.experiment.targets, evidence.table
    if table.empty:
        return NOTHING
    chosen = calibrate(table, targets) if len(table) > 1 else [None] * len(targets)
    draw_calibration(table, targets, chosen, evidence.folder / "curve.png")
    shown = ", ".join("not reached" if p is None else f"{p:g}" for p in chosen)
    verdict = f"Pressures for lump fractions {', '.join(f'{t:g}' for t in targets)}: {shown}."
    curve = Picture(
        "curve.png",
        "Mass fraction in lumps over pressure, rising, with the three targets and the pressures that reach them.",
        "A rising curve is fitted over log pressure (isotonic regression) and read off at the targets. "
        "Only the sintered runs of this scene are used; rows without sintering and all other scenes are not.",
        data="summary.csv",
    )
    return Findings([curve, *of_other_pressures(evidence)], verdict)


def draw_calibration(table: pd.DataFrame, targets: Sequence[float], chosen: Sequence[float | None], path: Path) -> None:
    """Lump fraction over pressure, with the targets and the pressures that they give."""
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    ax = figure.subplots()
    means = table.groupby("pressure")["lump_fraction"].mean()
    ax.plot(table["pressure"], table["lump_fraction"], "o", color="#307a78", label="runs")
    ax.plot(means.index, means, "-", color="#307a78", lw=1)
    for target, pressure in zip(targets, chosen, strict=True):
        ax.axhline(target, color="0.7", lw=0.8)
        if pressure:
            ax.plot([pressure], [target], "D", color="#D55E00")
            ax.annotate(f"{pressure:g}", (pressure, target), xytext=(6, -12), textcoords="offset points")
    ax.set(xscale="log", ylim=(-0.03, 1.03), xlabel="nominal pressure [unit of E]", ylabel="mass in lumps [1]")
    ax.legend(frameon=False)
    save(figure, path)
