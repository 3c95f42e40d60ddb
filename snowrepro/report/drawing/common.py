"""What all pictures share: colours, the background of a scene, particles."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Curve
from PIL import Image

from ...analysis.eye import COVER
from ...scene.build import domain
from ...scene.outline import polylines
from ...settings.case import Outline
from ...store.run import Run
from .palette import reduce_colours

# The paper's solver draws in these colours (legacy Taichi).
SKY, FLOOR, SNOW = "#668e93", "#307a78", "#f0f0ff"
SINTERED, UNSINTERED = "#D55E00", "#555555"  # of curves
DPI = 110
PAGE = 1020  # pixels that a report's page gives a picture on a screen of 1280
COLOURS = 128  # of a picture; pictures of snow and curves have few, and the shades of their edges
LEAST_LETTERS = 11  # pixels, the size of the smallest letters on such a page


@contextmanager
def own_style() -> Iterator[None]:
    """Within it, figures are drawn with Matplotlib's defaults, whatever the user's own settings are."""
    with mpl.rc_context():
        mpl.rcdefaults()
        yield


def get_panel_size(run: Run) -> tuple[float, float]:
    """Return width and height of the area that a panel shows [length units]."""
    width, height = domain(run.case)
    return width * run.case.reading.cell, height * run.case.reading.cell


def draw_background(ax: Axes, run: Run) -> None:
    """Draw sky and floor of a run's scene, and set the limits of the axes."""
    width, height = get_panel_size(run)
    ax.set(xlim=(0, width), ylim=(0, height), xticks=[], yticks=[], aspect="equal")
    ax.set_facecolor(SKY)
    ax.add_patch(PathPatch(make_curve(run.case.floor.outline, run.case.reading.cell), color=FLOOR, lw=0))
    for spine in ax.spines.values():
        spine.set_visible(False)


def make_curve(outline: Outline, cell: float) -> Curve:
    """Make what matplotlib draws of an outline, its holes left out; a cell is ``cell`` length units."""
    rings = [corners * cell for corners in polylines(outline)]
    return Curve.make_compound_path(*[Curve(np.concatenate([ring, ring[:1]]), closed=True) for ring in rings])


def draw_snow(
    ax: Axes, run: Run, places: np.ndarray, points_per_unit: float, colour: str | np.ndarray = SNOW
) -> PathCollection:
    """Draw particles at ``places`` (n, 2) as discs that just cover the snow as it was at the start."""
    diameter = run.case.dx / np.sqrt(run.case.fidelity.particles_per_cell) * COVER
    x, y = places.T
    return ax.scatter(x, y, s=(diameter * points_per_unit) ** 2, c=colour, linewidths=0, rasterized=True)


def choose_font(width: float, usual: float = 9.0) -> float:
    """Choose the size of letters [points] in a figure that is ``width`` inches wide.

    It is ``usual``, or more where a page shrinks the figure so much that they would be smaller than LEAST_LETTERS.
    """
    shrunk = min(1.0, PAGE / (width * DPI))
    return max(usual, LEAST_LETTERS * 72 / DPI / shrunk)


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, the same drawing to the same bytes, in at most COLOURS colours: a third of the size."""
    figure.savefig(path, dpi=DPI)
    with Image.open(path) as drawn:
        image = reduce_colours(drawn.convert("RGB"), COLOURS)
    image.save(path, optimize=True, dpi=(DPI, DPI))


def format_column_title(frame: int, run: Run) -> str:
    """Format the number and time of a frame; the start and the release are marked."""
    seconds = frame * run.case.loading.frame_time
    note = {0: ", start", run.case.loading.press_frames: ", release"}.get(frame, "")
    return f"frame {frame}{note}\n{seconds:.1f} s"
