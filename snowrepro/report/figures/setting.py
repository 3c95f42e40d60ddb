"""Figure 4: the setting of a run, pressed and falling."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...analysis.lumps import find_frame_before
from ...evidence.gather import Evidence
from ...quantities import format_powers
from ...scene.build import build_scene
from ...scene.press import SHELL_CELLS, external_force
from ...store.run import Run
from ..document import FigureContent, Picture
from ..drawing.common import draw_background, draw_snow, get_panel_size
from ..drawing.scenes import add_row_of_axes, save_with_padding
from .kinds import FigureKind

FORCE, GRAVITY = "#d62728", "#1f4fd8"  # red and blue arrows, as in the paper's Fig. 4
ARROWS = 20  # around the snow
LONGEST = 0.3  # arrow, in radii of the disc of the snow's area


def report(evidence: Evidence) -> FigureContent:
    """Draw Figure 4: the snow while it is pressed, with the force, and while it falls, with gravity."""
    run, (pressed, falling) = evidence.runs[0], evidence.experiment.frames
    if not evidence.is_done(run):
        return FigureContent(["**Missing**: the run that this shows."], "Not run.")
    draw_setting(run, pressed, falling, evidence.folder / "setting.png")
    ends = run.case.loading.press_frames
    verdict = (
        f"Frames 1 to {ends}: pressed, without gravity; from frame {ends + 1}: falling with "
        f"{run.case.reading.gravity:g} {format_powers('L/T2', [run.case.reading.length_unit])}."
    )
    picture = Picture(
        "setting.png",
        "Left: pressed snow with the external force as red arrows; right: falling snow with gravity as a blue arrow.",
        "Left: the external force b (red) on particles near the surface, as long as it is strong "
        f"(`reading.press={run.case.reading.press}`, pressure {run.case.pressure:g} {evidence.pressure_unit}). Right: "
        "gravity (blue).",
        "Fig. 4",
        "summary.csv",
    )
    return FigureContent([picture], verdict)


def draw_setting(run: Run, pressed: int, falling: int, path: Path) -> None:
    """Draw the snow in the frame ``pressed``, with the external force, and in the frame ``falling``, with gravity."""
    with run.open() as dataset:
        shown = [find_frame_before(dataset["snapshot"].values, frame) for frame in (pressed, falling)]
        places = [dataset["position"].sel(snapshot=frame).values.astype(float) for frame in shown]
    width, height = get_panel_size(run)
    figure = Figure(figsize=(8.6, 4.1 * height / width + 0.4), layout="constrained")
    left, right = add_row_of_axes(figure, 2)
    for ax, snow, title in (
        (left, places[0], f"pressed, frame {pressed}"),
        (right, places[1], f"falling, frame {falling}"),
    ):
        draw_background(ax, run)
        draw_snow(ax, run, snow, 4.1 * 72 / width)
        ax.set_title(title, fontsize=10)
    _draw_force(left, run, places[0])
    centre = places[1].mean(axis=0)
    right.annotate("", centre - [0, 0.25 * height], centre, arrowprops=_style_arrow(GRAVITY))
    save_with_padding(figure, path)


def _draw_force(ax: Axes, run: Run, places: np.ndarray) -> None:
    """Draw the external force as arrows that end on particles at the surface, evenly around the snow."""
    scene = build_scene(run.case)
    shell = SHELL_CELLS * run.case.reading.cell
    force = external_force(
        run.case.reading.press,
        places,
        scene.depth,
        run.case.pressure,
        run.case.material.rho,
        scene.radius,
        shell,
    )
    strength = np.hypot(force[:, 0], force[:, 1])
    scale = LONGEST * scene.radius / max(float(strength.max()), 1e-300)
    for particle in _choose_outermost(places):
        if strength[particle] > 0:
            ax.annotate(
                "", places[particle], places[particle] - force[particle] * scale, arrowprops=_style_arrow(FORCE)
            )


def _choose_outermost(places: np.ndarray) -> list[int]:
    """Choose the outermost particle in each of ARROWS narrow sectors around the centre."""
    arm = places - places.mean(axis=0)
    distance = np.hypot(arm[:, 0], arm[:, 1])
    turn = np.arctan2(arm[:, 1], arm[:, 0]) / (2 * np.pi) * ARROWS
    near = np.abs(turn - np.round(turn)) < 0.1
    sector = np.round(turn).astype(int) % ARROWS
    return [int(np.argmax(np.where(near & (sector == number), distance, -1.0))) for number in range(ARROWS)]


def _style_arrow(colour: str) -> dict:
    """Make the properties of an arrow for Matplotlib."""
    return {"arrowstyle": "-|>", "color": colour, "lw": 1.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 11}


FIGURE = FigureKind(report, needs=("frames",), frames=2)
