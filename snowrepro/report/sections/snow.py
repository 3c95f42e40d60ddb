"""Strips of the snow of any runs: a row for each cell of a sweep, a column for each time, by what became of it."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...evidence.gather import Evidence
from ...store import states
from ...store.run import Run
from ...summary.classify import classify
from ..document import Block, Heading, Picture
from ..drawing.columns import describe_cell, escape_label
from ..drawing.common import (
    draw_background,
    draw_snow,
    get_panel_size,
    save_figure,
)
from ..drawing.states import FOOT, add_state_legend, colour_fragments

MOST_ROWS = 12
MOST_LETTERS = 46  # of what stands above a row
PANEL = 1.1  # width of a small panel [inches]; all together fit on a phone
LABEL = 0.28  # height of the line above a row [inches]
TIMES = (0.0, 0.4, 1.0)  # of the way from the release to the end
GAP = 0.02  # between panels [inches]
SIZES = (1, 1, 2)  # of the panels: the end is large
FILE = "snow.png"


@dataclass(frozen=True)
class _Row:
    """A row of the strip: a run, what tells it from the others, and its state."""

    run: Run
    label: str
    state: str


def make_blocks(evidence: Evidence) -> list[Block]:
    """Draw the snow of a sweep's cells, one seed each, and say which are left out; nothing if none fell."""
    rows = _list_rows(evidence)
    if not any(row.state == states.DONE for row in rows):
        return []
    chosen = _choose_rows(rows)
    draw_snow_rows(chosen, evidence)
    seed = evidence.sweep.table["seed"].min()
    picked = f" Of {len(rows)} cells {len(chosen)} are shown, evenly picked of those with a result."
    left_out = picked if len(chosen) < len(rows) else ""
    tests = " Hardness tests are not shown." if any(run.case.indenter for run in evidence.runs) else ""
    picture = Picture(
        FILE,
        f"Snow of {len(chosen)} runs, a row each: at the end, and small at the release and on the way, by its state.",
        f"Large: the snow at the end. Small: at the release, and on the way. Each lump has a colour, crushed snow is "
        f"dark, loose snow the colour of sand. Seed {seed}.{left_out}{tests}",
    )
    return [Heading("The snow"), picture]


def _list_rows(evidence: Evidence) -> list[_Row]:
    """List the runs with the lowest seed that fall."""
    sweep = evidence.sweep
    is_first = sweep.table["seed"] == sweep.table["seed"].min()
    return [
        _Row(run, describe_cell(sweep, number), sweep.table["state"].iloc[number])
        for number, run in enumerate(sweep.runs)
        if is_first.iloc[number] and not run.case.indenter
    ]


def _choose_rows(rows: Sequence[_Row]) -> list[_Row]:
    """Choose at most MOST_ROWS; of more those with a result, evenly: the first, the last, and some between."""
    if len(rows) <= MOST_ROWS:
        return list(rows)
    done = [row for row in rows if row.state == states.DONE]
    numbers = np.linspace(0, len(done) - 1, min(MOST_ROWS, len(done))).round().astype(int)
    return [done[number] for number in numbers]


def draw_snow_rows(rows: Sequence[_Row], evidence: Evidence) -> None:
    """Draw a row for each run, with its label above it.  Scenes may differ; each row is as high as its scene."""
    heights = [2 * PANEL * get_panel_size(row.run)[1] / get_panel_size(row.run)[0] for row in rows]
    width, top = 3 * PANEL + GAP, sum(heights) + LABEL * len(rows) + FOOT
    figure = Figure(figsize=(width, top))
    size = np.array([width, top, width, top])
    for row, height in zip(rows, heights, strict=True):
        bottom, half = top - LABEL - height, (height - GAP) / 2
        small = [(2 * PANEL + GAP, bottom + shift, PANEL, half) for shift in (half + GAP, 0.0)]
        boxes = [*small, (0.0, bottom, 2 * PANEL, height)]
        _draw_row(row, [figure.add_axes(tuple(np.array(box) / size)) for box in boxes])
        label = textwrap.shorten(row.label, MOST_LETTERS, placeholder="...")
        figure.text(0.005, (top - 0.55 * LABEL) / size[1], escape_label(label), fontsize=9, va="center")
        top = bottom
    add_state_legend(figure, 8, loc="lower center")
    save_figure(figure, evidence.folder / FILE)


def _draw_row(row: _Row, axes: Sequence[Axes]) -> None:
    """Draw one run at its TIMES, or its state where it has no result."""
    run = row.run
    for ax in axes:
        draw_background(ax, run)
    if row.state != states.DONE:
        axes[-1].text(0.5, 0.5, row.state, transform=axes[-1].transAxes, ha="center", color="white")
        return
    with run.open() as dataset:
        frames = choose_frames(dataset)
        classified = classify(dataset, run.config.question.analysis, frames=frames)
        places = [dataset["position"].sel(snapshot=frame).values for frame in frames]
    unit = PANEL * 72 / get_panel_size(run)[0]
    drawn = zip(axes, frames, places, colour_fragments(classified), SIZES, strict=True)
    for ax, frame, where, colours, size in drawn:
        draw_snow(ax, run, where, size * unit, colours)
        text = f"frame {frame}" + (f", {frame * run.case.loading.frame_time:.1f} s" if size > 1 else "")
        ax.text(0.02, 0.97, text, transform=ax.transAxes, va="top", color="white", fontsize=8)


def choose_frames(dataset: xr.Dataset) -> list[int]:
    """Choose the frames of a run at TIMES, of those that are stored."""
    frames = dataset["snapshot"].values
    stored = frames[frames >= dataset.attrs["release_frame"]].tolist()
    return [stored[round(time * (len(stored) - 1))] for time in TIMES]
