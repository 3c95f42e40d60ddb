"""NetCDF files by the CF conventions, and the Datasets that they are read as.

CF wants some things otherwise than they are good to work with, so a file differs from what ``simulate``, ``open_run``
and ``open_sweep`` give:

* A particle is a trajectory: ``particle_id`` names it, the coordinates ``x`` and ``y`` (snapshot, particle) say where
  it is.  In Python these are ``position`` (snapshot, particle, axis), and so is ``velocity``.
* UDUNITS knows no cells.  They are a count, so ``units`` leaves them out, and ``reading_units`` has them.
* Names along a dimension are labels: ``sintering_label`` along ``sintering``.
* Coordinates in units of pressure are heights.  A sweep's ``pressure`` is none: it is data along ``nominal_pressure``,
  or, where a design sampled it, along ``point``.

No featureType is claimed.  All data of a file must then be of that type (CF 9.4), and those over ``frame`` are of the
whole snow; and a trajectory must have a date and two horizontal places (9.1), which a simulated slice has not.
"""

import re
from collections.abc import Sequence

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

CONVENTIONS = "CF-1.11"
PARTS = {"position": ("x", "y"), "velocity": ("velocity_x", "velocity_y")}
AXIS = {"long_name": "horizontal and upward axis", "units": "1"}
DIRECTIONS = {"x": "horizontal", "y": "upward"}
PLACES = {"x": {}, "y": {"axis": "Z", "positive": "up"}}  # checkers take an axis X for a longitude
KNOWN = re.compile(r"1|(kg|s|m|cm|mm|km)(-?\d+)?( (kg|s|m|cm|mm|km)(-?\d+)?)*")  # of the texts of ``units.text``
LABEL = "_label"
CELLS = "Cells are a count: 'units' leaves them out, 'reading_units' has them."
OF_FILES = ("Conventions", "history", "units_comment")  # attributes


def as_file(dataset: xr.Dataset, history: str) -> xr.Dataset:
    """A Dataset with its units as CF wants them; the conventions are claimed where UDUNITS knows all of them.

    ``history``: what made the file, in one line.
    """
    written = dataset.copy()
    for variable in written.variables.values():
        unit = variable.attrs.get("units", "1")
        if (bare := _without_cells(unit)) != unit:
            variable.attrs |= {"units": bare, "reading_units": unit}
    about = {"history": history}
    if any("reading_units" in variable.attrs for variable in written.variables.values()):
        about["units_comment"] = CELLS
    if all(KNOWN.fullmatch(variable.attrs.get("units", "1")) for variable in written.variables.values()):
        about = {"Conventions": CONVENTIONS, **about}
    return written.assign_attrs(about)


def run_as_file(dataset: xr.Dataset, history: str) -> xr.Dataset:
    """A run as it is written: particles as trajectories, if it has any.  ``history`` as in ``as_file``."""
    if not {*PARTS, "axis"} <= {*dataset.variables}:
        return as_file(dataset, history)
    parts = {}
    for name, names in PARTS.items():
        for part, axis in zip(names, dataset["axis"].values, strict=True):
            about = dataset[name].attrs
            long_name = f"{about['long_name']}, {DIRECTIONS[axis]}"
            parts[part] = dataset[name].sel(axis=axis, drop=True).assign_attrs(about, long_name=long_name)
    for name, about in PLACES.items():
        parts[name].attrs |= about
    ids = np.arange(dataset.sizes["particle"], dtype=np.int32)
    about = {"long_name": "number of the particle", "units": "1", "cf_role": "trajectory_id"}
    written = dataset.drop_vars([*PARTS, "axis"]).assign(parts).set_coords([*PLACES])
    return as_file(written.assign_coords(particle_id=("particle", ids, about)), history)


def run_as_read(dataset: xr.Dataset) -> xr.Dataset:
    """The run of a file as ``simulate`` gave it, nothing read yet; any other Dataset as it is."""
    parts = {part for names in PARTS.values() for part in names}
    if "config" not in dataset.attrs or "particle_id" not in dataset.coords or not parts <= {*dataset.variables}:
        return dataset
    if any(dataset[part].dims != dataset["x"].dims for part in parts) or "axis" in dataset.variables:
        return dataset  # another code's
    wholes = {name: _together(dataset, name) for name in PARTS}
    rest = dataset.drop_vars(["particle_id", *(part for parts in PARTS.values() for part in parts)])
    coords = {**rest.coords, "axis": ("axis", [*DIRECTIONS], AXIS)}
    return _as_read(xr.Dataset({**wholes, **rest.data_vars}, coords, dataset.attrs), dataset)


def sweep_as_file(grid: xr.Dataset, history: str) -> xr.Dataset:
    """A sweep's grid as it is written: names as labels.  ``history`` as in ``as_file``."""
    named = [dim for dim in grid.dims if grid[dim].dtype.kind not in "iuf"]
    indexed = [*named, "pressure"] if "pressure" in grid.dims else named
    labelled = grid.reset_index(indexed).rename_vars({dim: f"{dim}{LABEL}" for dim in named}).reset_coords("pressure")
    return as_file(labelled.rename_dims(pressure="nominal_pressure") if "pressure" in grid.dims else labelled, history)


def sweep_as_read(dataset: xr.Dataset) -> xr.Dataset:
    """The sweep's grid of a file as ``open_sweep`` gave it; any other Dataset as it is."""
    if not {"nominal_pressure", "point"} & {*dataset.dims} or "pressure" not in dataset:
        return dataset
    labels = {str(name).removesuffix(LABEL): name for name in dataset.coords if str(name).endswith(LABEL)}
    pressures = {"nominal_pressure": "pressure"} if "nominal_pressure" in dataset.dims else {}
    read = dataset.set_coords("pressure").swap_dims({**pressures, **labels})
    return _as_read(read.rename({label: dim for dim, label in labels.items()}), dataset)


def _as_read(changed: xr.Dataset, dataset: xr.Dataset) -> xr.Dataset:
    """What ``dataset`` was ``changed`` to, with the units of the reading and without what is said of files."""
    read = changed.copy()
    for name in OF_FILES:
        read.attrs.pop(name, None)
    for variable in read.variables.values():
        variable.encoding.pop("coordinates", None)  # names those of the file
        if "reading_units" in variable.attrs:
            variable.attrs["units"] = variable.attrs.pop("reading_units")
    read.encoding = dataset.encoding
    read.set_close(dataset.close)
    return read


def _without_cells(unit: str) -> str:
    """A unit without its powers of cells; "1" where nothing is left."""
    return " ".join(term for term in unit.split() if not re.fullmatch(r"cell(-?\d+)?", term)) or "1"


def _together(dataset: xr.Dataset, name: str) -> xr.Variable:
    """A vector of its parts in a file."""
    parts = [dataset[part].variable for part in PARTS[name]]
    about = {key: value for key, value in parts[0].attrs.items() if key in ("units", "reading_units")}
    long_name = str(parts[0].attrs.get("long_name", "")).rpartition(",")[0]
    values = indexing.LazilyIndexedArray(_Stacked(parts))
    return xr.Variable((*parts[0].dims, "axis"), values, {"long_name": long_name, **about})


class _Stacked(BackendArray):
    """Arrays of one shape side by side along a new last axis, read when used."""

    def __init__(self, parts: Sequence[xr.Variable]) -> None:
        self.parts = parts
        self.shape = (*parts[0].shape, len(parts))
        self.dtype = parts[0].dtype

    def __getitem__(self, key: indexing.ExplicitIndexer) -> np.ndarray:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self._read)

    def _read(self, key: tuple) -> np.ndarray:
        wanted = np.arange(len(self.parts))[key[-1]]
        if wanted.ndim == 0:
            return self.parts[wanted][key[:-1]].values
        return np.stack([self.parts[part][key[:-1]].values for part in wanted], axis=-1)
