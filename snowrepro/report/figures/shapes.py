"""Figure 2: the snow before it is pressed."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ...evidence.gather import Evidence
from ...scene import outline as geometry
from ...scene.build import Scene, build_scene
from ...store.run import Run
from ...text import make_cells
from ..document import FigureContent, Picture, Table, escape
from ..drawing.common import SKY, draw_snow
from ..drawing.scenes import add_row_of_axes, save_with_padding
from .kinds import FigureKind


def report(evidence: Evidence) -> FigureContent:
    """Draw Figure 2: the snow before it is pressed, all at one scale."""
    scenes = [(run, build_scene(run.case)) for run in evidence.runs]
    draw_shapes(scenes, evidence.folder / "shapes.png")
    table = _tabulate_shapes(scenes)
    make_cells(table).to_csv(evidence.folder / "shapes.csv", index=False, lineterminator="\n")
    names = ", ".join(run.case.shape.name for run, _ in scenes)
    picture = Picture(
        "shapes.png",
        f"The snow shapes side by side at one scale: {names}.",
        "The snow before it is pressed. The paper gives the names and two particle counts; conf/shape/ says what is "
        "guessed.",
        "Fig. 2",
        "shapes.csv",
    )
    counts = ", ".join(f"{run.case.shape.name} {len(scene.positions):,}" for run, scene in scenes)
    shown = table.rename(
        columns={"area [cells^2]": "area [cells²]", "width x height [cells]": "width × height [cells]"}
    )
    return FigureContent([picture, Table(shown)], f"Particles: {counts}.")


def draw_shapes(scenes: Sequence[tuple[Run, Scene]], path: Path) -> None:
    """Draw the snow of each scene at its start, all at one scale."""
    reach = max(float(np.ptp(scene.positions, axis=0).max()) for _, scene in scenes) * 0.56
    figure = Figure(figsize=(2.6 * len(scenes), 3.2), layout="constrained")
    for ax, (run, scene) in zip(add_row_of_axes(figure, len(scenes)), scenes, strict=True):
        low, high = scene.positions.min(axis=0), scene.positions.max(axis=0)
        middle = (low + high) / 2
        ax.set(xlim=(-reach, reach), ylim=(-reach, reach), xticks=[], yticks=[], aspect="equal", facecolor=SKY)
        draw_snow(ax, run, scene.positions - middle, 2.4 * 72 / (2 * reach))
        ax.set_title(f"{run.case.shape.name}\n{len(scene.positions):,} particles", fontsize=10)
    save_with_padding(figure, path)


def _tabulate_shapes(scenes: Sequence[tuple[Run, Scene]]) -> pd.DataFrame:
    """Tabulate particles, area and size of each shape."""
    rows = []
    for run, scene in scenes:
        low, high = geometry.extent(run.case.shape.outline)
        width, height = high - low
        area = geometry.area(run.case.shape.outline)
        particles = f"{len(scene.positions):,}"
        rows.append([escape(run.case.shape.name), particles, f"{area:.1f}", f"{width:.1f} x {height:.1f}"])
    return pd.DataFrame(rows, columns=["shape", "particles", "area [cells^2]", "width x height [cells]"])


FIGURE = FigureKind(report, needs_runs=False)
