"""``snowrepro.plot``: a picture of a run, or of two columns of a sweep."""

from pathlib import Path

import pandas as pd
import xarray as xr

from ..errors import ConfigError
from ..report.drawing.plot import assign_roles, collect_remembered, describe_lacking, draw_columns
from .named import find_sweep
from .shown import Plot
from .states import plot_state
from .tables import read_sweep

USUAL = "fragment"  # what colours of a run show


def plot(  # noqa: PLR0913 - what says how a sweep is drawn, and what says how a run is
    data: xr.Dataset | pd.DataFrame | str | Path,
    x: str = "",
    y: str = "",
    colour: str = "",
    panel: str = "",
    *,
    log: str = "",
    by: str = "",
    frame: int | None = None,
    store: str | Path = "runs",
) -> Plot:
    """Draw a run in one frame, or two columns of a sweep; a notebook shows the picture, ``save(path)`` writes it.

    ``data``: a run as ``simulate`` or ``open_run`` gives it, a sweep of ``store`` as ``open_sweep`` or ``run_sweep``
    gives it, or ``sweep_table`` or a part of its rows, or the id, path or name of one in ``store``.
    Of a sweep: ``x``, ``y``, ``colour``, ``panel``: columns of ``sweep_table``, by default the lumps over what varies,
    a point for each run and a line through the means over seeds; ``log``: axes with a logarithmic scale, x, y or xy.
    Of a run: ``by``: what colours show, fragment, snow, density, J_P or damage; ``frame``: a stored one, by default the
    last.  Raises ConfigError for a wrong name or frame, StoreError where data is broken.
    """
    name = "" if isinstance(data, pd.DataFrame) else find_sweep(data, store)
    if not isinstance(data, pd.DataFrame) and not name:
        if any((x, y, colour, panel, log)):
            raise ConfigError("x, y, colour, panel and log are for sweeps: a run is drawn by 'by' and 'frame'")
        return plot_state(data, by or USUAL, frame, store)
    if by or frame is not None:
        raise ConfigError("by and frame are for runs: a sweep is drawn by x, y, colour and panel")
    sweep = read_sweep(data) if isinstance(data, pd.DataFrame) else collect_remembered(name, store)
    roles = assign_roles(sweep, x, y, colour, panel, log)
    lacking = describe_lacking(sweep, roles)
    description = f"{roles.y} over {roles.x} of the sweep {sweep.name}"
    return Plot(draw_columns(sweep, roles), f"{description}, without {lacking}" if lacking else description)
