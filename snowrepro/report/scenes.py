"""Figures 2, 3 and 4: the snow shapes, the floors, and the setting of a run."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..config import Config
from ..scene import outline as geometry
from ..scene.build import build_scene
from ..scene.press import SHELL_CELLS, external_force
from .document import Findings, Picture, Table, plain
from .drawing import SKY, crop, draw_snow, draw_stage, save
from .evidence import Evidence, opened

FORCE, GRAVITY = "#d62728", "#1f4fd8"  # red and blue arrows, as in the paper's Fig. 4
ARROWS = 20  # around the snow
LONGEST = 0.3  # arrow, in radii of the disc of the snow's area


def report_shapes(evidence: Evidence) -> Findings:
    """Figure 2: the snow before it is pressed, all at one scale."""
    scenes = [(config, build_scene(config)) for config in evidence.configs]
    reach = max(float(np.ptp(scene.positions, axis=0).max()) for _, scene in scenes) * 0.56
    figure = Figure(figsize=(2.6 * len(scenes), 3.2), layout="constrained")
    for ax, (config, scene) in zip(_row_of_axes(figure, len(scenes)), scenes, strict=True):
        low, high = scene.positions.min(axis=0), scene.positions.max(axis=0)
        middle = (low + high) / 2
        ax.set(xlim=(-reach, reach), ylim=(-reach, reach), xticks=[], yticks=[], aspect="equal", facecolor=SKY)
        draw_snow(ax, config, scene.positions - middle, 2.4 * 72 / (2 * reach))
        ax.set_title(f"{config.shape.name}\n{len(scene.positions):,} particles", fontsize=10)
    _save(figure, evidence.folder / "shapes.png")
    rows = []
    for config, scene in scenes:
        low, high = geometry.extent(config.shape.outline)
        width, height = high - low
        area = geometry.area(config.shape.outline)
        counted = f"{len(scene.positions):,}"
        rows.append([plain(config.shape.name), counted, f"{area:.1f}", f"{width:.1f} x {height:.1f}"])
    table = pd.DataFrame(rows, columns=["shape", "particles", "area [cells^2]", "width x height [cells]"])
    table.to_csv(evidence.folder / "shapes.csv", index=False, lineterminator="\n")
    names = ", ".join(config.shape.name for config, _ in scenes)
    picture = Picture(
        "shapes.png",
        f"The snow shapes side by side at one scale: {names}.",
        "The snow before it is pressed. The paper gives the names and two particle counts; conf/shape/ says what is "
        "guessed.",
        "Fig. 2",
        "shapes.csv",
    )
    counts = ", ".join(f"{config.shape.name} {len(scene.positions):,}" for config, scene in scenes)
    return Findings([picture, Table(table)], f"Particles: {counts}.")


def report_floors(evidence: Evidence) -> Findings:
    """Figure 3: the floors in two rows like the paper's, and above each the snow at its start."""
    configs = evidence.configs
    columns = min(4, len(configs))
    rows = -(-len(configs) // columns)
    width, height = np.max([crop(config) for config in configs], axis=0)
    figure = Figure(figsize=(2.7 * columns, (2.7 * height / width + 0.25) * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for ax, config in zip(axes, configs, strict=False):
        draw_stage(ax, config)
        ax.set(xlim=(0, width), ylim=(0, height))
        draw_snow(ax, config, build_scene(config).positions, 2.6 * 72 / width)
        ax.set_title(config.floor.name, fontsize=10)
    for ax in axes[len(configs) :]:
        ax.set_axis_off()
    _save(figure, evidence.folder / "floors.png")
    names = ", ".join(config.floor.name for config in configs)
    drop = configs[0].reading.drop_height
    _write_floors(configs, evidence.folder / "floors.csv")
    picture = Picture(
        "floors.png",
        f"The floors, each with the snow at its start above it: {names}.",
        f"Each with {plain(configs[0].shape.name)} snow at its start, which is centred and falls {drop:g} cells to the "
        "first touch. The paper gives the names; conf/floor/ says what is guessed.",
        "Fig. 3",
        "floors.csv",
    )
    return Findings([picture], f"Floors: {names}.")


def _write_floors(configs: Sequence[Config], path: Path) -> None:
    """The floors' outlines, a row a corner; arcs as short edges."""
    outlines = [(config.floor.name, geometry.polyline(config.floor.outline)) for config in configs]
    rows = [(name, x, y) for name, corners in outlines for x, y in corners]
    frame = pd.DataFrame(rows, columns=["floor", "x [cells]", "y [cells]"])
    frame.to_csv(path, index=False, float_format="%.6g", lineterminator="\n")


def report_setting(evidence: Evidence) -> Findings:
    """Figure 4: the snow while it is pressed, with the force, and while it falls, with gravity."""
    config, (pressed, falling) = evidence.configs[0], evidence.experiment.frames
    if not evidence.is_done(config):
        return Findings(["**Missing**: the run that this shows."], "Not run.")
    with opened(config) as dataset:
        places = [dataset["position"].sel(snapshot=frame).values.astype(float) for frame in (pressed, falling)]
    width, height = crop(config)
    figure = Figure(figsize=(8.6, 4.1 * height / width + 0.4), layout="constrained")
    left, right = _row_of_axes(figure, 2)
    for ax, snow, title in (
        (left, places[0], f"pressed, frame {pressed}"),
        (right, places[1], f"falling, frame {falling}"),
    ):
        draw_stage(ax, config)
        draw_snow(ax, config, snow, 4.1 * 72 / width)
        ax.set_title(title, fontsize=10)
    _draw_force(left, config, places[0])
    centre = places[1].mean(axis=0)
    right.annotate("", centre - [0, 0.25 * height], centre, arrowprops=_arrow(GRAVITY))
    _save(figure, evidence.folder / "setting.png")
    ends = config.loading.press_frames
    verdict = (
        f"Frames 1 to {ends}: pressed, without gravity; from frame {ends + 1}: falling with "
        f"{config.reading.gravity:g} {config.reading.length_unit}/s^2."
    )
    picture = Picture(
        "setting.png",
        "Left: pressed snow with the external force as red arrows; right: falling snow with gravity as a blue arrow.",
        "Left: the external force b (red) on particles near the surface, as long as it is strong "
        f"(`reading.press={config.reading.press}`, pressure {config.pressure:g}). Right: gravity (blue).",
        "Fig. 4",
        "summary.csv",
    )
    return Findings([picture], verdict)


def _draw_force(ax: Axes, config: Config, places: np.ndarray) -> None:
    """Arrows of the external force that end on particles at the surface, evenly around the snow."""
    scene = build_scene(config)
    shell = SHELL_CELLS * config.reading.cell
    b = external_force(
        config.reading.press, places, scene.depth, config.pressure, config.material.rho, scene.radius, shell
    )
    strength = np.hypot(b[:, 0], b[:, 1])
    scale = LONGEST * scene.radius / max(float(strength.max()), 1e-300)
    for p in _around(places):
        if strength[p] > 0:
            ax.annotate("", places[p], places[p] - b[p] * scale, arrowprops=_arrow(FORCE))


def _around(places: np.ndarray) -> list[int]:
    """The outermost particle in each of ARROWS narrow sectors around the centre."""
    arm = places - places.mean(axis=0)
    distance = np.hypot(arm[:, 0], arm[:, 1])
    turn = np.arctan2(arm[:, 1], arm[:, 0]) / (2 * np.pi) * ARROWS
    near = np.abs(turn - np.round(turn)) < 0.1
    sector = np.round(turn).astype(int) % ARROWS
    return [int(np.argmax(np.where(near & (sector == s), distance, -1.0))) for s in range(ARROWS)]


def _arrow(colour: str) -> dict:
    return {"arrowstyle": "-|>", "color": colour, "lw": 1.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 11}


def _row_of_axes(figure: Figure, count: int) -> np.ndarray:
    return figure.subplots(1, count, squeeze=False)[0]


def _save(figure: Figure, path: Path) -> None:
    """With room for the titles, which equal aspects can push to the edge."""
    figure.get_layout_engine().set(h_pad=0.1)
    save(figure, path)
