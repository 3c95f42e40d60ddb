"""Panels of one movie: what stands still is drawn once, and what moves is drawn over it in each picture."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection
from matplotlib.colors import to_rgba_array
from matplotlib.figure import Figure
from matplotlib.text import Text

from ...store.run import Run
from ..drawing.colouring import PALETTE, Colouring, Scale, convert_to_colours
from ..drawing.common import FLOOR, SKY, draw_background, draw_snow, get_panel_size
from ..drawing.states import LEGEND, add_state_legend

DPI = 120
TITLE, GAP = 30, 12  # height of the title, distance of panels [pixels]
TIME, BAR, FOOT = 90, 84, 24  # widths of the time and of a scale, height of a legend of states [pixels]
WHITE, INK = "#ffffff", "#1a1a1a"
POINTS, SMALL = 9.0, 7.0  # heights of letters
LETTER, LINE = 0.58, 1.45  # width of a letter, and distance of lines, in these heights
STEPS = 48  # of a scale
MOMENT = 1e-9  # by which times may be rounded [s]


@dataclass(frozen=True)
class MovingSnow:
    """The particles of a run over time.

    ``times`` (state,): from when on each state is shown [s]; ``places`` (state, particle, axis) [length units];
    ``colouring``: the colours of each state.
    """

    times: np.ndarray
    places: np.ndarray
    colouring: Colouring


@dataclass(frozen=True)
class Panel:
    """One run in one colouring.

    ``cell``: its row and column; ``snow``: None if the run has no result, and then ``reason`` says why.
    """

    run: Run
    label: str
    cell: tuple[int, int]
    snow: MovingSnow | None = None
    reason: str = ""


@dataclass(frozen=True)
class Box:
    """The place of a panel without its label [pixels, from the lower left corner]."""

    left: float
    bottom: float
    width: float
    height: float


@dataclass(frozen=True)
class Labels:
    """The labels of all panels.

    ``note_line``: whether notes stand in a line below them, and not at the right end; ``points``: height of letters;
    ``lines``: of labels and notes together.
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
        """Height of all lines [pixels]."""
        return self.lines * self.line + 2


def find_last_state(times: np.ndarray, now: np.ndarray | float) -> np.ndarray:
    """Find the last of rising ``times`` (n,) that is not after ``now``, or the first one; returns its index."""
    return np.maximum(np.searchsorted(times, np.asarray(now) + MOMENT, side="right") - 1, 0)


class Stage:
    """A figure of panels; ``draw_picture`` draws it as it is at a time."""

    def __init__(self, panels: Sequence[Panel], title: str, scale: Scale | None, width: int) -> None:
        self.panels, self.scale = panels, scale
        labels = _make_labels(panels, width, BAR if scale else 0)
        names_states = any(panel.snow and panel.snow.colouring.is_of_states for panel in panels)
        boxes, self.size = _place_boxes(panels, width, BAR if scale else 0, labels.height, FOOT * names_states)
        self.figure = Figure(figsize=(self.size[0] / DPI, self.size[1] / DPI), dpi=DPI, facecolor=WHITE)
        self.canvas = FigureCanvasAgg(self.figure)
        self.axes = [self._add_axes(panel, box) for panel, box in zip(panels, boxes, strict=True)]
        self.discs = [_add_discs(*each) for each in zip(self.axes, panels, boxes, strict=True)]
        self.notes = [self._add_label(box, text, labels) for box, text in zip(boxes, labels.texts, strict=True)]
        middle = self.size[1] - TITLE / 2
        self._add_text(GAP, middle, title, _fit_letters(title, POINTS, self.size[0] - TIME - 2 * GAP), va="center")
        self.time = self._add_text(self.size[0] - GAP, middle, "", POINTS, ha="right", va="center", animated=True)
        if scale:
            self._add_scale(scale)
        if names_states:
            points = _fit_letters(LEGEND, SMALL, 0.7 * self.size[0])  # the rest is for swatches
            add_state_legend(self.figure, points, loc="center", bbox_to_anchor=(0.5, FOOT / 2 / self.size[1]))
        self.canvas.draw()
        self.still = self.canvas.copy_from_bbox(self.figure.bbox)

    @property
    def colours(self) -> np.ndarray:
        """The colours that the picture is about, (k, 3) as u8."""
        values = np.linspace(self.scale.low, self.scale.high, STEPS) if self.scale else np.arange(len(PALETTE))
        colours = np.concatenate([to_rgba_array((SKY, FLOOR, WHITE, INK)), convert_to_colours(values, self.scale)])
        return (255 * colours[:, :3]).round().astype(np.uint8)

    def draw_picture(self, now: float) -> np.ndarray:
        """Draw the picture at the time ``now`` [s]; returns (height, width, 3) as u8."""
        self.canvas.restore_region(self.still)
        for panel, ax, discs, note in zip(self.panels, self.axes, self.discs, self.notes, strict=True):
            if panel.snow is not None and discs is not None:
                state = int(find_last_state(panel.snow.times, now))
                discs.set(
                    offsets=panel.snow.places[state],
                    facecolor=convert_to_colours(panel.snow.colouring.values[state], self.scale),
                )
                note.set_text(panel.snow.colouring.notes[state])
                ax.draw_artist(discs)
                self.figure.draw_artist(note)
        self.time.set_text(f"{now:.2f} s")
        self.figure.draw_artist(self.time)
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()

    def _add_axes(self, panel: Panel, box: Box) -> Axes:
        """Add the axes of a panel, with sky and floor, or with the reason why the snow is missing."""
        width, height = self.size
        ax = self.figure.add_axes((box.left / width, box.bottom / height, box.width / width, box.height / height))
        draw_background(ax, panel.run)
        ax.set_ylim(0, get_panel_size(panel.run)[0] * box.height / box.width)
        if panel.snow is None:
            text = textwrap.fill(f"missing: {panel.reason}", _count_letters(0.9 * box.width, SMALL), max_lines=6)
            ax.text(0.5, 0.6, text, transform=ax.transAxes, size=SMALL, ha="center", va="center", color=INK)
        return ax

    def _add_label(self, box: Box, text: str, labels: Labels) -> Text:
        """Write a panel's label; returns the text for notes, which is behind it or in the line below."""
        bottom = box.bottom + box.height + 4
        lifted = bottom + labels.line if labels.note_line else bottom
        self._add_text(box.left, lifted, text, labels.points, va="bottom")
        x, ha = (box.left, "left") if labels.note_line else (box.left + box.width, "right")
        return self._add_text(x, bottom, "", labels.points, va="bottom", ha=ha, animated=True)

    def _add_text(self, x: float, y: float, text: str, points: float, **options: Any) -> Text:
        """Write a text at ``x``, ``y`` [pixels]; ``options``: further properties for Matplotlib."""
        return self.figure.text(x / self.size[0], y / self.size[1], text, size=points, color=INK, **options)

    def _add_scale(self, scale: Scale) -> None:
        """Add the scale of the colours at the right."""
        width, height = self.size
        long = height - TITLE - 3 * GAP
        ax = self.figure.add_axes(((width - BAR + 8) / width, 2 * GAP / height, 14 / width, long / height))
        bar = self.figure.colorbar(scale.mappable, cax=ax)
        bar.ax.tick_params(labelsize=SMALL)
        bar.set_label(scale.field, size=_fit_letters(scale.field, SMALL, long))


def _make_labels(panels: Sequence[Panel], width: int, bar: int) -> Labels:
    """Make all labels alike: in one line with the notes if these fit, else in lines above them, in smaller letters."""
    side = _compute_panel_width(panels, width, bar)
    notes = max((len(note) for panel in panels if panel.snow for note in panel.snow.colouring.notes), default=0)
    longest = max(len(panel.label) for panel in panels) + notes + 2 * (notes > 0)
    for points in (POINTS, 8.0, SMALL):
        if longest <= _count_letters(side, points):
            return Labels([panel.label for panel in panels], False, points, 1)
    whole = [panel.label.replace(" ", "\xa0").replace(",\xa0", ", ") for panel in panels]  # broken at commas
    texts = [textwrap.fill(label, _count_letters(side, SMALL)) for label in whole]
    return Labels(texts, notes > 0, SMALL, max(text.count("\n") + 1 for text in texts) + (notes > 0))


def _compute_panel_width(panels: Sequence[Panel], width: int, bar: int) -> float:
    """Compute the width of a panel [pixels].  ``bar``: width of the scale."""
    columns = 1 + max(panel.cell[1] for panel in panels)
    return (width - bar - GAP * (columns + 1)) / columns


def _place_boxes(
    panels: Sequence[Panel], width: int, bar: int, label: float, foot: int
) -> tuple[list[Box], tuple[int, int]]:
    """Place the panels; returns their boxes and the size of the picture [pixels], even numbers as the codec wants.

    All panels are equally wide; the highest domain of a row sets its height.  ``foot``: what is free below them.
    """
    side, rows = _compute_panel_width(panels, width, bar), 1 + max(panel.cell[0] for panel in panels)
    sizes = [get_panel_size(panel.run) for panel in panels]
    aspects = [(panel.cell[0], height / width) for panel, (width, height) in zip(panels, sizes, strict=True)]
    heights = [side * max((aspect for r, aspect in aspects if r == row), default=0.0) for row in range(rows)]
    total = 2 * round((TITLE + sum(heights) + rows * (label + GAP) + foot) / 2)
    bottoms = total - TITLE - np.cumsum(heights) - label * np.arange(1, rows + 1) - GAP * np.arange(rows)
    boxes = [Box(GAP + p.cell[1] * (side + GAP), bottoms[p.cell[0]], side, heights[p.cell[0]]) for p in panels]
    return boxes, (2 * round(width / 2), total)


def _add_discs(ax: Axes, panel: Panel, box: Box) -> PathCollection | None:
    """Add the particles of a run that is not missing, to be drawn in each picture."""
    if panel.snow is None:
        return None
    discs = draw_snow(ax, panel.run, panel.snow.places[0], box.width * 72 / DPI / get_panel_size(panel.run)[0])
    discs.set_animated(True)
    return discs


def _estimate_width(text: str, points: float) -> float:
    """Estimate the width of a text [pixels]."""
    return len(text) * LETTER * points * DPI / 72


def _fit_letters(text: str, points: float, width: float) -> float:
    """Return the height of letters, reduced if the text does not fit into a width [pixels]."""
    return points * min(1.0, width / _estimate_width(text or "x", points))


def _count_letters(width: float, points: float) -> int:
    """Estimate how many letters fit into a width [pixels]."""
    return max(int(width / _estimate_width("x", points)), 1)
