"""A path of strain at one point, drawn: stress over strain, and pressure and shear beside each other."""

import matplotlib as mpl
import xarray as xr
from matplotlib.figure import Figure

from ...quantities import add_unit, format_unit
from .common import own_style

SHOWN = {"pressure": "#0072B2", "shear": "#D55E00", "von_mises": "0.45"}


def draw_path(dataset: xr.Dataset) -> Figure:
    """Draw what ``point.follow_path`` returns."""
    unit = format_unit(dataset.pressure.attrs["units"])
    with own_style(), mpl.rc_context({"font.size": 9}):
        figure = Figure(figsize=(9.0, 3.8), layout="constrained")
        over_strain, plane = figure.subplots(1, 2)
        for name, colour in SHOWN.items():
            over_strain.plot(dataset.strain, dataset[name], color=colour, label=dataset[name].attrs["long_name"])
        over_strain.set(xlabel=dataset.strain.attrs["long_name"], ylabel=add_unit("stress", unit))
        over_strain.legend(frameon=False)
        plane.plot(dataset.pressure, dataset.shear, color=SHOWN["shear"])
        plane.set(xlabel=add_unit("pressure", unit), ylabel=add_unit("largest shear stress", unit))
        figure.suptitle(dataset.attrs["title"])
    return figure
