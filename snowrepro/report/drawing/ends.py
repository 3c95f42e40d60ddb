"""How runs ended: their last frames, by what became of the snow."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...store.run import Run
from ...summary.classify import classify
from .common import choose_font, draw_background, draw_snow, get_panel_size, save_figure
from .states import FOOT, add_state_legend, colour_fragments

HEAD, SIDE = 0.5, 0.4  # room for the names of columns and of rows [inches]


def draw_ends(
    runs: Mapping[tuple[str, str], Run],
    rows: Sequence[str],
    columns: Sequence[str],
    is_done: Callable[[Run], bool],
    width: float,
    path: Path,
) -> None:
    """Draw the last frames of runs into a picture file.

    ``runs``: by the names of their row and column, of which ``rows`` and ``columns`` are the order.  ``is_done``:
    whether a run has a result; if not, its panel says so.  ``width``: of a panel [inches].  The highest scene of a row
    sets its height.
    """
    heights = [
        max(get_panel_size(run)[1] / get_panel_size(run)[0] for (name, _), run in runs.items() if name == row)
        for row in rows
    ]
    size = (width * len(columns) + SIDE, width * sum(heights) + HEAD + FOOT)
    letters = choose_font(size[0])
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(len(rows), len(columns), squeeze=False, gridspec_kw={"height_ratios": heights})
    for ax in grid.flat:
        ax.set(xticks=[], yticks=[])
    for (row, column), run in runs.items():
        ax, height = grid[rows.index(row), columns.index(column)], heights[rows.index(row)]
        _draw_end(ax, run, is_done(run), width)
        ax.set_ylim(0, height * get_panel_size(run)[0])
    for column, ax in zip(columns, grid[0], strict=True):
        ax.set_title(column, fontsize=letters)
    for row, ax in zip(rows, grid[:, 0], strict=True):
        ax.set_ylabel(row, fontsize=letters)
    add_state_legend(figure, letters, loc="outside lower center")
    save_figure(figure, path)


def _draw_end(ax: Axes, run: Run, is_done: bool, width: float) -> None:
    """Draw the last frame of a run into a panel ``width`` inches wide; without a result the panel says so."""
    draw_background(ax, run)
    if not is_done:
        ax.text(0.5, 0.5, "missing", transform=ax.transAxes, ha="center", color="white")
        return
    with run.open() as dataset:
        colours = colour_fragments(classify(dataset, run.config.question.analysis))[0]
        places = dataset["position"][-1].values
    draw_snow(ax, run, places, width * 72 / get_panel_size(run)[0], colours)
