"""The map of the mechanisms of sintering: an area of each, and lines of equal rate."""

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ...quantities import add_unit, format_unit
from .common import own_style

COLOURS = ("#56B4E9", "#F0E442", "#E69F00", "#009E73", "0.85")  # by the order of the mechanisms


def _draw_rates(ax: Axes, logarithm: xr.DataArray) -> None:
    """Draw lines of equal rate, one for each power of ten, and label every other."""
    levels = np.arange(np.floor(float(logarithm.min())), np.ceil(float(logarithm.max())) + 1)
    lines = ax.contour(
        logarithm.density, logarithm.stress, logarithm.T, levels, colors="0.2", linewidths=0.6, linestyles="solid"
    )
    ax.clabel(lines, levels[::2], fmt=lambda level: f"$10^{{{level:.0f}}}$/s", fontsize=7)


def draw_map(dataset: xr.Dataset) -> Figure:
    """Draw what ``sintering_map.map_sintering`` returns."""
    names, colours = dataset.mechanisms.values, ListedColormap(COLOURS)
    with own_style(), mpl.rc_context({"font.size": 9}):
        figure = Figure(figsize=(7.5, 4.6), layout="constrained")
        ax = figure.subplots()
        axes = (dataset.density, dataset.stress)
        ax.pcolormesh(*axes, dataset.mechanism.T, cmap=colours, vmin=-0.5, vmax=len(names) - 0.5, rasterized=True)
        is_settling = dataset.mechanism == names.tolist().index("settling")
        for side in (is_settling, ~is_settling):  # the rate has a step between them
            if side.any():
                _draw_rates(ax, np.log10(dataset.rate).where(side))
        labels = [add_unit(each.attrs["long_name"], format_unit(each.attrs["units"])) for each in axes]
        ax.set(xlabel=labels[0], ylabel=labels[1], yscale="log", title=dataset.attrs["title"])
        acting = np.unique(dataset.mechanism)
        handles = [Patch(color=COLOURS[number], label=names[number]) for number in acting]
        figure.legend(handles=handles, loc="outside right upper", frameon=False)
    return figure
