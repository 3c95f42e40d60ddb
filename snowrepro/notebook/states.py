"""One state of a run as a picture."""

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ..composition.compose import config_of
from ..errors import ConfigError
from ..report.drawing.colouring import COLOURINGS, convert_to_colours, make_scale
from ..report.drawing.common import draw_background, draw_snow, get_panel_size, own_style
from ..report.drawing.states import add_state_legend
from ..report.film.panels import format_title
from ..store import cf
from ..store.find import open_run
from ..store.run import Run
from ..text import quote
from .shown import Plot

WIDTH = 6.0  # of a picture [inches]
NOTE = 9  # height of letters


def plot_state(
    data: xr.Dataset | str | Path, by: str, frame: int | None, store: str | Path, width: float = WIDTH
) -> Plot:
    """Draw a run in one stored frame, by default the last: see ``plot``.  ``width``: in inches.  Raises ConfigError."""
    require_colouring(by)
    dataset = read_run(data, store)
    run = Run(config_of(dataset))
    stored = dataset["snapshot"].values.tolist()
    shown = stored[-1] if frame is None else frame
    if shown not in stored:
        nearest = min(stored, key=lambda known: abs(known - shown))
        raise ConfigError(f"frame: {shown} is not stored; the nearest that is: {nearest}")
    seconds = float(dataset["snapshot_time"].values[stored.index(shown)])
    title = f"{format_title([run], [])}, frame {shown}, {seconds:.1f} s"
    return Plot(_draw_state(dataset, run, by, shown, title, width), f"{title}, coloured by {by}")


def require_colouring(by: str) -> None:
    """Raise ConfigError with the names that there are where ``by`` is none of them."""
    if by not in COLOURINGS:
        raise ConfigError(f"by: should be {', '.join(COLOURINGS)} (got {quote(by)})")


def read_run(data: xr.Dataset | str | Path, store: str | Path) -> xr.Dataset:
    """Return a run as ``simulate`` gave it, opened where its id or path is given.  Raises StoreError."""
    return cf.run_as_read(data) if isinstance(data, xr.Dataset) else open_run(data, store)


@own_style()
def _draw_state(dataset: xr.Dataset, run: Run, by: str, frame: int, title: str, width: float) -> Figure:
    """Draw the particles of a run in one stored frame over its scene."""
    colouring = COLOURINGS[by](dataset, run, [frame])
    scale = make_scale([colouring])
    size = get_panel_size(run)
    figure = Figure(figsize=(width, width * size[1] / size[0] + 0.4), layout="constrained")
    ax = figure.add_subplot()
    draw_background(ax, run)
    places = dataset["position"].sel(snapshot=frame).values
    values = np.asarray(colouring.values[0])
    draw_snow(ax, run, places, width * 72 / size[0], convert_to_colours(values, scale))
    ax.set_title("\n".join(filter(None, (title, colouring.notes[0]))), fontsize=NOTE, loc="left")
    if colouring.is_of_states:
        add_state_legend(figure, NOTE, loc="outside lower center")
    if scale:
        figure.colorbar(scale.mappable, ax=ax, shrink=0.8).set_label(scale.field, size=NOTE)
    return figure
