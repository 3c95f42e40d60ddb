"""Pictures of runs: frame strips like the paper's, and curves."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from ..analysis.fragments import Fragments
from ..config import Config, Outline
from ..scene.build import domain

matplotlib.use("Agg")

# The paper's solver draws in these colours (legacy Taichi).
SKY, FLOOR, SNOW = "#668e93", "#307a78", "#f0f0ff"
LUMPS = ("#E69F00", "#56B4E9", "#F0E442", "#D55E00", "#CC79A7")  # Okabe-Ito without green and blue
POWDER = "#c3cacf"
DPI = 110


@dataclass(frozen=True)
class Row:
    """One row of a strip: its label, its run (None if missing), and fragments by frame."""

    label: str
    dataset: xr.Dataset | None
    fragments: dict[int, Fragments]


def draw_strip(rows: Sequence[Row], frames: Sequence[int], config: Config, path: Path, by_fragment: bool) -> None:
    """Draw rows of runs over columns of frames; coloured as the paper's figure, or by fragment."""
    width, height = crop(config)
    panel = 2.3
    figure = Figure(figsize=(panel * len(frames) + 1.35, panel * height / width * len(rows) + 0.45))
    figure.set_facecolor("white")
    grid = figure.subplots(len(rows), len(frames), squeeze=False)
    figure.subplots_adjust(
        left=1.3 / figure.get_figwidth(),
        right=0.998,
        bottom=0.004,
        top=1 - 0.42 / figure.get_figheight(),
        wspace=0.02,
        hspace=0.03,
    )
    for row, axes in zip(rows, grid, strict=True):
        colours = None
        for frame, ax in zip(frames, axes, strict=True):
            _draw_stage(ax, config)
            if row.dataset is None:
                ax.text(0.5, 0.5, "missing", transform=ax.transAxes, ha="center", color="white")
                continue
            colour = SNOW
            if by_fragment and frame in row.fragments:
                colour = colours = fragment_colours(row.fragments[frame], colours)
            _draw_snow(ax, config, row.dataset, frame, colour, panel * 72 / width)
        axes[0].set_ylabel(row.label, rotation=0, ha="right", va="center", fontsize=9, labelpad=8)
    for frame, ax in zip(frames, grid[0], strict=True):
        ax.set_title(_column_title(frame, config), fontsize=9)
    figure.savefig(path, dpi=DPI, metadata={"Software": None})


def crop(config: Config) -> tuple[float, float]:
    """Width and height of what a panel shows [length units]."""
    width, height = domain(config)
    return width * config.reading.cell, height * config.reading.cell


def fragment_colours(now: Fragments, before: list[str] | None) -> list[str]:
    """A colour for each particle: a lump keeps that of its largest ancestor, powder is grey.

    ``before``: the colours of the column before, None in the first.
    """
    colours = np.full(len(now.label), POWDER, dtype=object)
    taken: set[str] = set()
    for lump in np.flatnonzero(now.is_lump):  # heaviest first, so the largest heir keeps the colour
        members = now.label == lump
        inherited = _commonest(np.asarray(before)[members]) if before is not None else POWDER
        free = [colour for colour in LUMPS if colour not in taken]
        if inherited == POWDER or inherited in taken:
            inherited = free[0] if free else LUMPS[lump % len(LUMPS)]
        taken.add(inherited)
        colours[members] = inherited
    return list(colours)


def _commonest(values: np.ndarray) -> str:
    found, counts = np.unique(values, return_counts=True)
    return str(found[np.argmax(counts)])


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
    figure.savefig(path, dpi=DPI, metadata={"Software": None})


def _draw_stage(ax: Axes, config: Config) -> None:
    """Background, floor and limits of one panel."""
    width, height = crop(config)
    ax.set(xlim=(0, width), ylim=(0, height), xticks=[], yticks=[], aspect="equal")
    ax.set_facecolor(SKY)
    ax.add_patch(_patch(config.floor.outline, config.reading.cell))
    for spine in ax.spines.values():
        spine.set_visible(False)


def _patch(outline: Outline, cell: float) -> Circle | Polygon:
    if outline.kind == "circle":
        return Circle((0, 0), outline.radius * cell, color=FLOOR, lw=0)
    return Polygon(np.asarray(outline.points) * cell, closed=True, color=FLOOR, lw=0)


def _draw_snow(
    ax: Axes, config: Config, dataset: xr.Dataset, frame: int, colour: str | list[str], points_per_unit: float
) -> None:
    """Particles as discs of the area that each stood for at the start."""
    x, y = dataset["position"].sel(snapshot=frame).values.T
    diameter = config.dx / np.sqrt(config.fidelity.particles_per_cell) * 1.13
    ax.scatter(x, y, s=(diameter * points_per_unit) ** 2, c=colour, linewidths=0, rasterized=True)


def _column_title(frame: int, config: Config) -> str:
    seconds = frame * config.loading.frame_time
    note = {0: ", start", config.loading.press_frames: ", release"}.get(frame, "")
    return f"frame {frame}{note}\n{seconds:.1f} s"
