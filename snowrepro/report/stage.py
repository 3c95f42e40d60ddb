"""Panels in one picture after the other: what stands still is drawn once, what moves is drawn over it."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection
from matplotlib.colors import to_rgba_array
from matplotlib.figure import Figure
from matplotlib.text import Text

from ..config import Config
from .drawing import FLOOR, SKY, crop, draw_snow, draw_stage
from .paint import NAMED, Paint, Scale, colours_of

DPI = 120
TITLE, GAP = 30, 12  # height of the title, distance of panels [pixels]
TIME, BAR = 90, 84  # widths of the time and of a scale [pixels]
WHITE, INK = "#ffffff", "#1a1a1a"
POINTS, SMALL = 9.0, 7.0  # heights of letters
LETTER, LINE = 0.58, 1.45  # width of a letter, and distance of lines, in these heights
STEPS = 48  # of a scale
MOMENT = 1e-9  # by which times may be rounded [s]


@dataclass(frozen=True)
class Panel:
    """One run in one colouring; ``cell``: its row and column.

    Each state is shown from its time in ``times`` (state,) on [s]; ``places`` (state, particle, axis).  A run that is
    missing has none of these, and a reason.
    """

    config: Config
    label: str
    cell: tuple[int, int]
    times: np.ndarray | None = None
    places: np.ndarray | None = None
    paint: Paint | None = None
    reason: str = ""


@dataclass(frozen=True)
class Box:
    """Where a panel is [pixels, from the lower left corner], without its label, and how much of it is seen."""

    left: float
    bottom: float
    width: float
    height: float


@dataclass(frozen=True)
class Labels:
    """The labels of all panels; ``note_line``: whether notes stand below them, and not at their right end.

    ``points``: height of letters; ``lines``: how many labels and notes take together.
    """

    texts: list[str]
    note_line: bool
    points: float
    lines: int

    @property
    def line(self) -> float:
        """Height of a line [pixels]."""
        return LINE * self.points * DPI / 72

    @property
    def height(self) -> float:
        """Of all lines [pixels]."""
        return self.lines * self.line + 2


def last_until(times: np.ndarray, now: np.ndarray | float) -> np.ndarray:
    """Index of the last of rising ``times`` (n,) that is not after ``now``, or of the first one."""
    return np.maximum(np.searchsorted(times, np.asarray(now) + MOMENT, side="right") - 1, 0)


class Stage:
    """A figure of panels; ``picture`` draws it as it is at a time."""

    def __init__(self, panels: Sequence[Panel], title: str, scale: Scale | None, width: int):
        self.panels, self.scale = panels, scale
        labels = _labels(panels, width, BAR if scale else 0)
        boxes, self.size = _boxes(panels, width, BAR if scale else 0, labels.height)
        self.figure = Figure(figsize=(self.size[0] / DPI, self.size[1] / DPI), dpi=DPI, facecolor=WHITE)
        self.canvas = FigureCanvasAgg(self.figure)
        self.axes = [self._axes(panel, box) for panel, box in zip(panels, boxes, strict=True)]
        self.snow = [_snow(*each) for each in zip(self.axes, panels, boxes, strict=True)]
        self.notes = [self._note(box, text, labels) for box, text in zip(boxes, labels.texts, strict=True)]
        middle = self.size[1] - TITLE / 2
        self._text(GAP, middle, title, _fitting(title, POINTS, self.size[0] - TIME - 2 * GAP), va="center")
        self.time = self._text(self.size[0] - GAP, middle, "", POINTS, ha="right", va="center", animated=True)
        if scale:
            self._bar(scale)
        self.canvas.draw()
        self.still = self.canvas.copy_from_bbox(self.figure.bbox)

    @property
    def colours(self) -> np.ndarray:
        """Those that the picture is about, (k, 3) as u8."""
        values = np.linspace(self.scale.low, self.scale.high, STEPS) if self.scale else np.arange(len(NAMED))
        about = np.concatenate([to_rgba_array((SKY, FLOOR, WHITE, INK)), colours_of(values, self.scale)])
        return (255 * about[:, :3]).round().astype(np.uint8)

    def picture(self, now: float) -> np.ndarray:
        """The picture at a time [s], (height, width, 3) as u8."""
        self.canvas.restore_region(self.still)
        for panel, ax, snow, note in zip(self.panels, self.axes, self.snow, self.notes, strict=True):
            if snow is not None:
                state = int(last_until(panel.times, now))
                snow.set_offsets(panel.places[state])
                snow.set_facecolors(colours_of(panel.paint.values[state], self.scale))
                note.set_text(panel.paint.notes[state])
                ax.draw_artist(snow)
                self.figure.draw_artist(note)
        self.time.set_text(f"{now:.2f} s")
        self.figure.draw_artist(self.time)
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()

    def _axes(self, panel: Panel, box: Box) -> Axes:
        """The panel's sky and floor, and why the snow is missing."""
        width, height = self.size
        ax = self.figure.add_axes((box.left / width, box.bottom / height, box.width / width, box.height / height))
        draw_stage(ax, panel.config)
        ax.set_ylim(0, crop(panel.config)[0] * box.height / box.width)
        if panel.paint is None:
            text = textwrap.fill(f"missing: {panel.reason}", _letters(0.9 * box.width, SMALL), max_lines=6)
            ax.text(0.5, 0.6, text, transform=ax.transAxes, size=SMALL, ha="center", va="center", color=INK)
        return ax

    def _note(self, box: Box, text: str, labels: Labels) -> Text:
        """Write a panel's label; what changes comes behind it, or into the line below."""
        bottom = box.bottom + box.height + 4
        lifted = bottom + labels.line if labels.note_line else bottom
        self._text(box.left, lifted, text, labels.points, va="bottom")
        x, ha = (box.left, "left") if labels.note_line else (box.left + box.width, "right")
        return self._text(x, bottom, "", labels.points, va="bottom", ha=ha, animated=True)

    def _text(self, x: float, y: float, text: str, points: float, **options) -> Text:
        return self.figure.text(x / self.size[0], y / self.size[1], text, size=points, color=INK, **options)

    def _bar(self, scale: Scale) -> None:
        """The scale of the colours, at the right."""
        width, height = self.size
        long = height - TITLE - 3 * GAP
        ax = self.figure.add_axes(((width - BAR + 8) / width, 2 * GAP / height, 14 / width, long / height))
        bar = self.figure.colorbar(scale.mappable, cax=ax)
        bar.ax.tick_params(labelsize=SMALL)
        bar.set_label(scale.field, size=_fitting(scale.field, SMALL, long))


def _labels(panels: Sequence[Panel], width: int, bar: int) -> Labels:
    """All labels alike: in one line with the notes if these fit, else in lines above them, in smaller letters."""
    side = _side(panels, width, bar)
    notes = max((len(note) for panel in panels if panel.paint for note in panel.paint.notes), default=0)
    longest = max(len(panel.label) for panel in panels) + notes + 2 * (notes > 0)
    for points in (POINTS, 8.0, SMALL):
        if longest <= _letters(side, points):
            return Labels([panel.label for panel in panels], False, points, 1)
    whole = [panel.label.replace(" ", "\xa0").replace(",\xa0", ", ") for panel in panels]  # broken at commas
    texts = [textwrap.fill(label, _letters(side, SMALL)) for label in whole]
    return Labels(texts, notes > 0, SMALL, max(text.count("\n") + 1 for text in texts) + (notes > 0))


def _side(panels: Sequence[Panel], width: int, bar: int) -> float:
    """Width of a panel [pixels]."""
    columns = 1 + max(panel.cell[1] for panel in panels)
    return (width - bar - GAP * (columns + 1)) / columns


def _boxes(panels: Sequence[Panel], width: int, bar: int, label: float) -> tuple[list[Box], tuple[int, int]]:
    """Where the panels go in a picture of about this width, and its size: even, as the codec wants.

    All panels are equally wide; the highest domain of a row sets its height.
    """
    side, rows = _side(panels, width, bar), 1 + max(panel.cell[0] for panel in panels)
    heights = [
        side * max((crop(p.config)[1] / crop(p.config)[0] for p in panels if p.cell[0] == row), default=0.0)
        for row in range(rows)
    ]
    total = 2 * round((TITLE + sum(heights) + rows * (label + GAP)) / 2)
    bottoms = total - TITLE - np.cumsum(heights) - label * np.arange(1, rows + 1) - GAP * np.arange(rows)
    boxes = [Box(GAP + p.cell[1] * (side + GAP), bottoms[p.cell[0]], side, heights[p.cell[0]]) for p in panels]
    return boxes, (2 * round(width / 2), total)


def _snow(ax: Axes, panel: Panel, box: Box) -> PathCollection | None:
    """The particles of a run that is not missing; they are drawn picture by picture."""
    if panel.paint is None:
        return None
    snow = draw_snow(ax, panel.config, panel.places[0], box.width * 72 / DPI / crop(panel.config)[0])
    snow.set_animated(True)
    return snow


def _width(text: str, points: float) -> float:
    """About how wide a text is [pixels]."""
    return len(text) * LETTER * points * DPI / 72


def _fitting(text: str, points: float, width: float) -> float:
    """A height of letters, or less if the text does not fit into a width [pixels]."""
    return points * min(1.0, width / _width(text or "x", points))


def _letters(width: float, points: float) -> int:
    """About how many letters fit into a width [pixels]."""
    return max(int(width / _width("x", points)), 1)
