"""Figure 3: the floors."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ...evidence.gather import Evidence
from ...scene import outline as geometry
from ...scene.build import build_scene
from ...store.run import Run
from ...text import make_cells
from ..document import FigureContent, Picture, escape
from ..drawing.common import draw_background, draw_snow, get_panel_size
from ..drawing.scenes import save_with_padding
from .kinds import FigureKind


def report(evidence: Evidence) -> FigureContent:
    """Draw Figure 3: the floors, each with the snow at its start above it."""
    runs, shape = evidence.runs, evidence.runs[0].case.shape.name
    draw_floors(runs, evidence.folder / "floors.png")
    _write_floors(runs, evidence.folder / "floors.csv")
    names = ", ".join(run.case.floor.name for run in runs)
    drop = runs[0].case.reading.drop_height
    picture = Picture(
        "floors.png",
        f"The floors, each with the snow at its start above it: {names}.",
        f"Each with {escape(shape)} snow at its start, which is centred and falls {drop:g} cells to the "
        "first touch. The paper gives the names; conf/floor/ says what is guessed.",
        "Fig. 3",
        "floors.csv",
    )
    return FigureContent([picture], f"Floors: {names}.")


def draw_floors(runs: Sequence[Run], path: Path) -> None:
    """Draw the floors in two rows like the paper's, and above each the snow at its start."""
    columns = min(4, len(runs))
    rows = -(-len(runs) // columns)
    width, height = np.max([get_panel_size(run) for run in runs], axis=0)
    figure = Figure(figsize=(2.7 * columns, (2.7 * height / width + 0.25) * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for ax, run in zip(axes, runs, strict=False):
        draw_background(ax, run)
        ax.set(xlim=(0, width), ylim=(0, height))
        draw_snow(ax, run, build_scene(run.case).positions, 2.6 * 72 / width)
        ax.set_title(run.case.floor.name, fontsize=10)
    for ax in axes[len(runs) :]:
        ax.set_axis_off()
    save_with_padding(figure, path)


def _write_floors(runs: Sequence[Run], path: Path) -> None:
    """Write the outlines of the floors, one row for each corner; arcs become short edges.

    A row without numbers stands between two curves of one floor.
    """
    outlines = [(run.case.floor.name, geometry.polylines(run.case.floor.outline)) for run in runs]
    rows = [(name, x, y) for name, curves in outlines for x, y in _join(curves)]
    frame = pd.DataFrame(rows, columns=["floor", "x [cells]", "y [cells]"])
    make_cells(frame).to_csv(path, index=False, float_format="%.6g", lineterminator="\n")


def _join(curves: Sequence[np.ndarray]) -> np.ndarray:
    """Join the corners (m, 2) of several curves, with a row of nan between two."""
    gap = np.full((1, 2), np.nan)
    return np.concatenate([part for corners in curves for part in (corners, gap)][:-1])


FIGURE = FigureKind(report, needs_runs=False)
