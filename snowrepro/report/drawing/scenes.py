"""What the figures of scenes share."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from .common import save_figure


def add_row_of_axes(figure: Figure, count: int) -> np.ndarray:
    """Add ``count`` panels side by side to a figure; returns their axes (count,)."""
    return figure.subplots(1, count, squeeze=False)[0]


def save_with_padding(figure: Figure, path: Path) -> None:
    """Write a figure with room for its titles, which panels of equal aspect can push to the edge."""
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine), "other engines know no padding"
    engine.set(h_pad=0.1)
    save_figure(figure, path)
