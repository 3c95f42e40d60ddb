"""``snowrepro.classify`` and ``snowrepro.summarise``: numbers of a run, also by its id or path."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr

from ..analysis.lumps import Classification
from ..settings.analysis import Analysis
from ..store.find import open_run
from ..summary import classify as classifying
from ..summary import row
from .arguments import naming_arguments


def classify(
    data: xr.Dataset | np.ndarray | str | Path,
    analysis: Analysis | None = None,
    *,
    frames: Sequence[int] | int | Literal["all"] | None = None,
    mass: np.ndarray | float | str | None = None,
    release: int | None = None,
    grid_spacing: float | None = None,
    cell_mass: float | None = None,
    store: str | Path = "runs",
    **settings: Any,
) -> Classification:
    """Classify particles over time, ours or anyone's, into lumps and powder.

    ``data``: a Dataset (a run, or particles of another code), positions (time, particle, axis), the id of a run in
    ``store`` or its beginning or end, or the path of a file.
    ``frames``: those (or the one) whose fragments are wanted, "all" stored ones since release, or by default the last.
    ``mass`` (n,), ``release`` (a frame), ``grid_spacing``, ``cell`` and ``cell_mass`` win over what the data says.
    ``analysis`` and ``settings`` by name (``definition="proximity"``, ``break_strain=0.2``) define what a lump is; by
    default the run's own configuration does, or conf/analysis/strain.yaml.
    Variables and dimensions that have other names than the usual ones are named likewise:
    ``position="coordinates"`` or ``"x,y"``, ``velocity``, ``particle_id``, ``time``, ``time_dimension``,
    ``particle_dimension``; ``mass`` may be a name too.  "none": the data has none.
    Raises DataError for data that cannot be classified, ConfigError for wrong settings, StoreError where there is no
    such run or file.
    """
    with naming_arguments(), _opened(data, store) as opened:
        return classifying.classify(
            opened,
            analysis,
            frames=frames,
            mass=mass,
            release=release,
            grid_spacing=grid_spacing,
            cell_mass=cell_mass,
            **settings,
        )


def summarise(
    data: xr.Dataset | str | Path, analysis: Analysis | None = None, *, store: str | Path = "runs"
) -> dict[str, Any]:
    """Return the row of a run: what was simulated, what broke, what had to be bounded, what it cost; by column name.

    ``data``: a run as ``simulate`` or ``open_run`` gives it, its id in ``store`` or the beginning or end of it, or its
    path.  ``analysis``: what a lump is, by default as the run's own configuration says.
    Raises StoreError if the data is not that of a run, or there is none, ConfigError if several runs are meant.
    """
    with naming_arguments(), _opened(data, store) as opened:
        return row.summarise(opened, analysis)


@contextmanager
def _opened(data: Any, store: str | Path) -> Iterator[Any]:
    """Give data as it is, or those of a run or file that is opened for as long as the block lasts."""
    if isinstance(data, str | Path):
        with open_run(data, store) as dataset:
            yield dataset
    else:
        yield data
