"""The picture of the claims: mass in lumps over pressure, and between which pressures it crosses one half."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from ...evidence.calibration import HALF, Crossing
from ...evidence.claims import ARMS, JudgedScene, select_arm
from ...quantities import add_unit
from ..drawing.common import SINTERED, UNSINTERED, choose_font, save_figure

COLOURS = dict(zip(ARMS, (SINTERED, UNSINTERED), strict=True))
LABELS = dict(zip(ARMS, ("with sintering", "without"), strict=True))
MOST_TICKS, MOST_TICKS_OF_SEVERAL = 6, 4  # pressures that are written at the axis of a panel alone, and of several
SEEDS = "seeds show numerical repeatability, not physical replication"


def draw_response(
    scenes: Sequence[JudgedScene],
    halves: dict[str, Crossing],
    path: Path,
    unit: str,
    half_pressures: dict[str, str] | None = None,
) -> None:
    """Draw a panel for each scene: a row for each shape, a column for each floor.

    ``halves``: brackets of P50 by scene, to be marked; ``unit``: of pressures; ``half_pressures``: the same in words,
    shown if there is only one scene.  Of several scenes, each panel names the claims that its means disagree with.
    """
    shapes, floors = (list(dict.fromkeys(getattr(scene, part) for scene in scenes)) for part in ("shape", "floor"))
    is_alone = len(scenes) == 1
    size = (5.2, 4.4) if is_alone else (1.75 * len(floors) + 0.8, 1.5 * len(shapes) + 1.1)
    letters = choose_font(size[0], 10.0)
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(len(shapes), len(floors), squeeze=False, sharex=True, sharey=True)
    pressures = sorted({p for scene in scenes if len(scene.table) for p in scene.table["pressure"] if p > 0})
    for ax in grid.flat:
        ax.set_visible(False)
    for scene in scenes:
        ax = grid[shapes.index(scene.shape), floors.index(scene.floor)]
        ax.set_visible(True)
        half_pressure = half_pressures[scene.name] if is_alone and half_pressures else ""
        _draw_panel(ax, scene, halves.get(scene.name, Crossing()), half_pressure)
        if not is_alone:
            ax.text(
                0.04, 0.94, list_disagreements(scene), transform=ax.transAxes, va="top", fontsize=letters, color="0.3"
            )
        ax.set_title(scene.name, fontsize=letters)
        ax.set(xscale="log", ylim=(-0.04, 1.04))
        ax.margins(x=0.09)
        if len(pressures) <= (MOST_TICKS if is_alone else MOST_TICKS_OF_SEVERAL):
            ax.set_xticks(pressures, [f"{pressure:g}" for pressure in pressures])
            ax.minorticks_off()
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.tick_params(labelsize=letters)
    figure.supxlabel(f"{add_unit('nominal pressure', unit)}\n{SEEDS}", fontsize=letters)
    figure.supylabel("mass in lumps", fontsize=letters)
    _add_legend(figure, letters)
    save_figure(figure, path)


def _add_legend(figure: Figure, letters: float) -> None:
    """Add a legend of all labels in a figure, each once; none if there are no labels.  ``letters``: their size."""
    labelled = [pair for ax in figure.axes for pair in zip(*ax.get_legend_handles_labels(), strict=True)]
    handles = {label: handle for handle, label in labelled}
    if handles:
        figure.legend(
            handles.values(),
            handles,
            loc="outside upper center",
            ncols=min(len(handles), int(figure.get_figwidth() / 2.2)),
            frameon=False,
            fontsize=letters,
        )


def list_disagreements(scene: JudgedScene) -> str:
    """List the claims that a scene's means disagree with, as text."""
    return " ".join(v.claim for v in scene.verdicts if v.agrees is False)


def _draw_panel(ax: Axes, scene: JudgedScene, half: Crossing, half_pressure: str) -> None:
    """Draw seeds and means of both arms, and the bracket of P50."""
    size = 5.0 if half_pressure else 3.0
    ax.axhline(HALF, color="0.6", lw=0.8, ls=":", zorder=0)
    for arm in ARMS:
        blocks = select_arm(scene.table, arm, "lump_fraction")
        if blocks.empty:
            continue
        means, colour = blocks.mean(), COLOURS[arm]
        ax.plot(means.index, means, "-", color=colour, lw=1.3, label="_")
        ax.plot(means.index, means, "_", color=colour, ms=4 * size, mew=1.6, label=f"{LABELS[arm]}: mean")
        for number, (_, values) in enumerate(blocks.iterrows()):
            label = "a seed" if (arm, number) == (ARMS[0], 0) else "_"
            ax.plot(
                _shift_pressures(blocks, number), values, "o", color=colour, ms=size, alpha=0.55, mew=0, label=label
            )
    if half.low is None or half.high is None:
        return
    ax.plot([half.low, half.high], [HALF, HALF], "|-", color="black", lw=1.6, ms=size + 4, label="P50 is between")
    if half_pressure:
        place = (0.98, HALF)  # below the line and at the right end, where a curve that rises is above it
        ax.annotate(
            f"P50 {half_pressure}", place, (0, -6), ("axes fraction", "data"), "offset points", ha="right", va="top"
        )


def _shift_pressures(blocks: pd.DataFrame, number: int) -> np.ndarray:
    """Return the pressures, shifted a little for each seed so that points do not hide one another."""
    share = (number - (len(blocks) - 1) / 2) / len(blocks)
    return blocks.columns.to_numpy(dtype=float) * 10 ** (0.04 * share)
