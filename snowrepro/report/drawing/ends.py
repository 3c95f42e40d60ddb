"""How runs ended: their last frames, by what became of the snow."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...store.run import Run
from ...summary.classify import classify
from .common import SNOW, choose_font, draw_background, draw_snow, get_panel_size, save_figure
from .states import FOOT, add_state_legend, colour_fragments

HEAD, SIDE = 0.5, 0.4  # room for the names of columns and of rows [inches]
MISSING = np.empty((0, 2))


@dataclass(frozen=True)
class End:
    """How a run ended.

    ``places``: of its particles (n, 2) [length units], MISSING without a result; ``colours``: theirs; ``note``: what
    its panel says, if anything.
    """

    run: Run
    places: np.ndarray
    colours: str | np.ndarray = SNOW
    note: str = ""


def read_end(run: Run, is_done: bool) -> End:
    """Read the last frame of a run, by what became of the snow; MISSING if it is not done."""
    if not is_done:
        return End(run, MISSING)
    with run.open() as dataset:
        colours = colour_fragments(classify(dataset, run.config.question.analysis))[0]
        return End(run, dataset["position"][-1].values, colours)


def draw_ends(
    ends: Mapping[tuple[str, str], End], rows: Sequence[str], columns: Sequence[str], width: float, path: Path
) -> None:
    """Draw how runs ended into a picture file.

    ``ends``: by the names of their row and column, of which ``rows`` and ``columns`` are the order.  ``width``: of a
    panel [inches].  The highest scene of a row sets its height.
    """
    heights = [
        max(get_panel_size(end.run)[1] / get_panel_size(end.run)[0] for (name, _), end in ends.items() if name == row)
        for row in rows
    ]
    size = (width * len(columns) + SIDE, width * sum(heights) + HEAD + FOOT)
    letters = choose_font(size[0])
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(len(rows), len(columns), squeeze=False, gridspec_kw={"height_ratios": heights})
    for ax in grid.flat:
        ax.set(xticks=[], yticks=[])
    for (row, column), end in ends.items():
        ax, height = grid[rows.index(row), columns.index(column)], heights[rows.index(row)]
        _draw_end(ax, end, width, letters)
        ax.set_ylim(0, height * get_panel_size(end.run)[0])
    for column, ax in zip(columns, grid[0], strict=True):
        ax.set_title(column, fontsize=letters)
    for row, ax in zip(rows, grid[:, 0], strict=True):
        ax.set_ylabel(row, fontsize=letters)
    add_state_legend(figure, letters, loc="outside lower center")
    save_figure(figure, path)


def _draw_end(ax: Axes, end: End, width: float, letters: float) -> None:
    """Draw how a run ended into a panel ``width`` inches wide; without a result the panel says so."""
    draw_background(ax, end.run)
    if not len(end.places):
        ax.text(0.5, 0.5, "missing", transform=ax.transAxes, ha="center", color="white")
        return
    draw_snow(ax, end.run, end.places, width * 72 / get_panel_size(end.run)[0], end.colours)
    ax.text(0.03, 0.97, end.note, transform=ax.transAxes, va="top", color="white", fontsize=letters)
