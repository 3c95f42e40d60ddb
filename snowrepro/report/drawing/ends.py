"""How a run ended: its last frame, by what became of the snow."""

from matplotlib.axes import Axes

from ...store.run import Run
from ...summary.classify import classify
from .common import draw_background, draw_snow, get_panel_size
from .states import colour_fragments


def draw_end(ax: Axes, run: Run, is_done: bool, width: float) -> None:
    """Draw the last frame of a run into a panel: lumps, crushed and loose snow.

    ``is_done``: whether it has a result; if not, the panel says so.  ``width``: of the panel [inches].
    """
    draw_background(ax, run)
    if not is_done:
        ax.text(0.5, 0.5, "missing", transform=ax.transAxes, ha="center", color="white")
        return
    with run.open() as dataset:
        colours = colour_fragments(classify(dataset, run.config.question.analysis))[0]
        places = dataset["position"][-1].values
    draw_snow(ax, run, places, width * 72 / get_panel_size(run)[0], colours)
