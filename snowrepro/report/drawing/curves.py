"""Pictures of several curves, with their numbers as CSV; made to be readable on a phone."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ...text import make_cells
from .common import save_figure

SIZE = (5.2, 5.4)  # inches: letters keep a legible size on a narrow screen
FONT = 10
BAND = 0.18  # opacity of a spread
NO_UNIT = " [1]"  # in the names of the columns of files, and nowhere else


@dataclass(frozen=True)
class Curve:
    """One line or cloud of points.

    ``x``, ``y`` (n,); ``style``: arguments for Matplotlib; ``spread``: half the height of a band around the line.
    """

    label: str
    x: np.ndarray
    y: np.ndarray
    style: dict[str, Any] = field(default_factory=dict)
    spread: float = 0.0


def draw_curves(curves: Sequence[Curve], path: Path, x: str, y: str, columns: int = 2, **axes: Any) -> None:
    """Draw ``curves`` into ``path``, a PNG, and write their numbers beside it as CSV.

    ``x``, ``y``: labels of the axes; ``columns``: of the legend; ``axes``: further properties of Matplotlib's axes.
    """
    figure = Figure(figsize=SIZE, layout="constrained")
    ax = figure.subplots()
    for curve in curves:
        (line,) = ax.plot(curve.x, curve.y, label=curve.label, **curve.style)
        if curve.spread:
            low, high = curve.y - curve.spread, curve.y + curve.spread
            ax.fill_between(curve.x, low, high, color=line.get_color(), alpha=BAND, lw=0)
    ax.set(**axes)
    ax.set_xlabel(x.removesuffix(NO_UNIT), fontsize=FONT)
    ax.set_ylabel(y.removesuffix(NO_UNIT), fontsize=FONT)
    ax.grid(color="0.92", lw=0.6)
    figure.legend(
        loc="outside lower center", ncols=columns, fontsize=FONT - 1, frameon=False, columnspacing=1.2, handlelength=1.8
    )
    save_figure(figure, path)
    _write_points(curves, path.with_suffix(".csv"), x, y)


def _write_points(curves: Sequence[Curve], path: Path, x: str, y: str) -> None:
    """Write all points that are drawn, one row for each."""
    parts = [pd.DataFrame({"curve": curve.label, x: curve.x, y: curve.y, "spread": curve.spread}) for curve in curves]
    make_cells(pd.concat(parts).dropna()).to_csv(path, index=False, float_format="%.6g", lineterminator="\n")
