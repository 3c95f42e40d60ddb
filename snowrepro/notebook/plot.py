"""``snowrepro.plot``: a picture of a run."""

from pathlib import Path

import xarray as xr

from .shown import Plot
from .states import plot_state


def plot(
    data: xr.Dataset | str | Path, *, by: str = "fragment", frame: int | None = None, store: str | Path = "runs"
) -> Plot:
    """Draw a run in one frame; a notebook shows the picture, ``save(path)`` writes it.

    ``data``: a run as ``simulate`` or ``open_run`` gives it, or the id or path of one in ``store``.  ``by``: what
    colours show: fragment, snow, density, J_P or damage.  ``frame``: a stored one, by default the last.
    Raises ConfigError for a wrong name or frame, StoreError where there is no such run.
    """
    return plot_state(data, by, frame, store)
