"""The picture of the claims: mass in lumps over pressure, seed by seed, with the pressure at which it crosses 1/2."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..analysis.calibration import HALF, Crossing, rising
from ..analysis.claims import ARMS, Scene, arm_of
from .drawing import SINTERED, UNSINTERED, save

COLOURS = dict(zip(ARMS, (SINTERED, UNSINTERED), strict=True))
LABELS = dict(zip(ARMS, ("with sintering", "without"), strict=True))
SEEDS = "seeds show numerical repeatability, not physical replication"


def draw_response(
    scenes: Sequence[Scene], halves: dict[str, Crossing], path: Path, shown: dict[str, str] | None = None
) -> None:
    """A panel a scene: a row a shape, a column a floor; of several, each with the claims that its means disagree with.

    ``halves``: P50 by scene, where it is to be marked, and ``shown``: the same in words, for a scene alone.
    """
    shapes, floors = (list(dict.fromkeys(getattr(s, part) for s in scenes)) for part in ("shape", "floor"))
    alone = len(scenes) == 1
    size = (6.4, 4.4) if alone else (1.75 * len(floors) + 0.8, 1.5 * len(shapes) + 1.1)
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(len(shapes), len(floors), squeeze=False, sharex=True, sharey=True)
    pressures = sorted({p for scene in scenes if len(scene.table) for p in scene.table["pressure"] if p > 0})
    for ax in grid.flat:
        ax.set_visible(False)
    for scene in scenes:
        ax = grid[shapes.index(scene.shape), floors.index(scene.floor)]
        ax.set_visible(True)
        _draw_panel(ax, scene, halves.get(scene.name, Crossing()), shown[scene.name] if alone and shown else "")
        if not alone:
            ax.text(0.04, 0.94, disagreed(scene), transform=ax.transAxes, va="top", fontsize=7, color="0.3")
        ax.set_title(scene.name, fontsize=10 if alone else 8)
        ax.set(xscale="log", ylim=(-0.04, 1.04))
        ax.margins(x=0.09)
        if len(pressures) <= 4:
            ax.set_xticks(pressures, [f"{pressure:g}" for pressure in pressures])
            ax.minorticks_off()
        ax.tick_params(labelsize=9 if alone else 7)
    figure.supxlabel(f"nominal pressure [unit of E]\n{SEEDS}", fontsize=9)
    figure.supylabel("mass in lumps [1]", fontsize=9)
    handles = {label: handle for ax in grid.flat for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    if handles:
        figure.legend(
            handles.values(), handles, loc="outside upper center", ncols=len(handles), frameon=False, fontsize=8
        )
    save(figure, path)


def disagreed(scene: Scene) -> str:
    """The claims that a scene's means do not bear out."""
    return " ".join(v.claim for v in scene.verdicts if v.agrees is False)


def _draw_panel(ax: Axes, scene: Scene, half: Crossing, shown: str) -> None:
    """Seeds, means and rising fit of both arms, and P50."""
    size = 5.0 if shown else 3.0
    ax.axhline(HALF, color="0.6", lw=0.8, ls=":", zorder=0)
    for arm in ARMS:
        blocks = arm_of(scene.table, arm, "lump_fraction")
        if blocks.empty:
            continue
        means, colour = blocks.mean(), COLOURS[arm]
        fit = rising(means)
        ax.plot(fit.index, fit, "-", color=colour, lw=1.3, label="_")
        ax.plot(means.index, means, "_", color=colour, ms=4 * size, mew=1.6, label=f"{LABELS[arm]}: mean and fit")
        for place, (_, values) in enumerate(blocks.iterrows()):
            label = "a seed" if (arm, place) == (ARMS[0], 0) else "_"
            ax.plot(_beside(blocks, place), values, "o", color=colour, ms=size, alpha=0.55, mew=0, label=label)
    if half.pressure is None:
        return
    if half.low is not None and half.high is not None:
        run = scene.table["pressure"]
        ends = np.clip([half.low, half.high], run.min(), run.max())
        ax.plot(ends, [HALF, HALF], "|-", color="black", lw=1.6, ms=size + 4)
    ax.plot([half.pressure], [HALF], "D", color="black", ms=size, label="P50")
    if shown:
        ax.annotate(f"P50 {shown}", (half.pressure, HALF), xytext=(8, -14), textcoords="offset points")


def _beside(blocks: pd.DataFrame, place: int) -> np.ndarray:
    """Pressures, a little to the side of one another for each seed."""
    share = (place - (len(blocks) - 1) / 2) / len(blocks)
    return blocks.columns.to_numpy(dtype=float) * 10 ** (0.04 * share)
