"""What all pictures share: colours, one panel of a scene, particles, fragments."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from ..analysis.fragments import Fragments
from ..config import Config
from ..scene.build import domain
from ..scene.outline import polyline

matplotlib.use("Agg")

# The paper's solver draws in these colours (legacy Taichi).
SKY, FLOOR, SNOW = "#668e93", "#307a78", "#f0f0ff"
LUMPS = ("#E69F00", "#56B4E9", "#F0E442", "#D55E00", "#CC79A7")  # Okabe-Ito without green and blue
POWDER = "#c3cacf"
SINTERED, UNSINTERED = "#D55E00", "#555555"  # of curves
DPI = 110
COVER = 1.45  # diameter of a particle [lattice spacings]


def crop(config: Config) -> tuple[float, float]:
    """Width and height of what a panel shows [length units]."""
    width, height = domain(config)
    return width * config.reading.cell, height * config.reading.cell


def fragment_colours(history: Sequence[Fragments]) -> list[np.ndarray]:
    """A colour for each particle, frame by frame: a lump keeps that of its id; powder is grey.

    A new lump takes the colour that the least mass has.
    """
    of_id: dict[int, str] = {}
    painted = []
    for now in history:
        lumps = list(zip(now.id[now.is_lump].tolist(), now.mass[now.is_lump].tolist(), strict=True))  # heaviest first
        taken = dict.fromkeys(LUMPS, 0.0)
        for name, mass in lumps:
            if name in of_id:
                taken[of_id[name]] += mass
        for name, mass in lumps:
            if name not in of_id:
                of_id[name] = min(LUMPS, key=taken.__getitem__)
                taken[of_id[name]] += mass
        colours = np.full(len(now.mass), POWDER, dtype=object)
        colours[now.is_lump] = [of_id[name] for name, _ in lumps]
        painted.append(colours[now.label])
    return painted


def draw_stage(ax: Axes, config: Config) -> None:
    """Background, floor and limits of one panel."""
    width, height = crop(config)
    ax.set(xlim=(0, width), ylim=(0, height), xticks=[], yticks=[], aspect="equal")
    ax.set_facecolor(SKY)
    ax.add_patch(Polygon(polyline(config.floor.outline) * config.reading.cell, closed=True, color=FLOOR, lw=0))
    for spine in ax.spines.values():
        spine.set_visible(False)


def draw_snow(
    ax: Axes, config: Config, places: np.ndarray, points_per_unit: float, colour: str | np.ndarray = SNOW
) -> PathCollection:
    """Particles at ``places`` (n, 2) as discs that just cover the snow as it was at the start."""
    diameter = config.dx / np.sqrt(config.fidelity.particles_per_cell) * COVER
    return ax.scatter(*places.T, s=(diameter * points_per_unit) ** 2, c=colour, linewidths=0, rasterized=True)


def save(figure: Figure, path: Path) -> None:
    """Write a picture whose bytes depend on nothing but what is drawn."""
    figure.savefig(path, dpi=DPI, metadata={"Software": None})


def column_title(frame: int, config: Config) -> str:
    """Frame and time, and what is special about them."""
    seconds = frame * config.loading.frame_time
    note = {0: ", start", config.loading.press_frames: ", release"}.get(frame, "")
    return f"frame {frame}{note}\n{seconds:.1f} s"
