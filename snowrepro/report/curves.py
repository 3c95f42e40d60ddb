"""Pictures of curves over one another, each with its numbers beside it, made to be read on a telephone."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from .drawing import save

SIZE = (5.2, 5.4)  # inches: letters keep a legible size on a narrow screen
FONT = 10
BAND = 0.18  # opacity of a spread


@dataclass(frozen=True)
class Curve:
    """One line or cloud: ``x``, ``y`` (n,), how it is drawn, and half the height of a band around it."""

    label: str
    x: np.ndarray
    y: np.ndarray
    style: dict[str, Any] = field(default_factory=dict)
    spread: float = 0.0


def draw(curves: Sequence[Curve], path: Path, x: str, y: str, columns: int = 2, **axes: Any) -> None:
    """Draw ``curves`` into ``path``, a PNG, and write their numbers beside it, as CSV.

    ``x``, ``y``: names of the axes; ``columns``: of the legend; ``axes``: properties of matplotlib's axes.
    """
    figure = Figure(figsize=SIZE, layout="constrained")
    ax = figure.subplots()
    for curve in curves:
        (line,) = ax.plot(curve.x, curve.y, label=curve.label, **curve.style)
        if curve.spread:
            low, high = curve.y - curve.spread, curve.y + curve.spread
            ax.fill_between(curve.x, low, high, color=line.get_color(), alpha=BAND, lw=0)
    ax.set(**axes)
    ax.set_xlabel(x, fontsize=FONT)
    ax.set_ylabel(y, fontsize=FONT)
    ax.grid(color="0.92", lw=0.6)
    figure.legend(
        loc="outside lower center", ncols=columns, fontsize=FONT - 1, frameon=False, columnspacing=1.2, handlelength=1.8
    )
    save(figure, path)
    _write(curves, path.with_suffix(".csv"), x, y)


def _write(curves: Sequence[Curve], path: Path, x: str, y: str) -> None:
    """All that is drawn, a row a point."""
    parts = [pd.DataFrame({"curve": curve.label, x: curve.x, y: curve.y, "spread": curve.spread}) for curve in curves]
    pd.concat(parts).dropna().to_csv(path, index=False, float_format="%.6g", lineterminator="\n")
