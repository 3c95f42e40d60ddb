"""Which variables of anybody's Dataset are places, and which of their dimensions is time, particle and axis.

It is told by names, by what the CF conventions say of trajectories, or by who asks; never by the order or the sizes of
dimensions.  What stays open is refused.
"""

import re
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, fields

import numpy as np
import xarray as xr

from ..errors import DataError
from ..text import make_printable, quote, quote_all
from .values import NOTHING, find_variable, list_variables, read_numbers, read_text, read_unit, require_numbers

AXES = ("x", "y", "z")
PLACES = ("position", "positions", "coordinates")
VELOCITIES = ("velocity", "velocities")
PARTS_OF_VELOCITY = (tuple(f"velocity_{axis}" for axis in AXES), tuple(f"v{axis}" for axis in AXES))
IDS = ("id", "ids", "particle_id", "particle_ids", "atom_id", "atom_ids", "pid", "trajectory_id", "trajectory")
# Names of dimensions, in lower case, without "n" or "number of" before them and "s" behind.
NAMES_OF_TIME = {
    "time", "t", "frame", "snapshot", "state", "step", "timestep", "time_step", "tstep", "obs", "observation", "record",
    "rec", "iteration", "cycle", "date",
}  # fmt: skip
NAMES_OF_PARTICLES = {
    "particle", "p", "part", "atom", "point", "trajectory", "traj", "drifter", "float", "bead", "body", "grain",
    "molecule", "marker", "tracer", "node", "vertex", "id", "pid", "sphere", "agent", "particle_id",
}  # fmt: skip
NAMES_OF_AXES = {
    "axis", "axe", "axi", "xyz", "xy", "space", "spatial", "dim", "dimension", "d", "component", "comp", "coord",
    "coordinate", "cartesian", "vector", "vec", "direction",
}  # fmt: skip


@dataclass(frozen=True)
class Names:
    """Names of variables and dimensions, where they are not the usual ones; ``NOTHING`` where the data has none.

    ``position``, ``velocity``: of a variable with an axis, or of one an axis, "x,y".
    """

    position: str | Sequence[str] | None = None
    velocity: str | Sequence[str] | None = None
    particle_id: str | None = None
    mass: str | None = None
    time: str | None = None
    time_dimension: str | None = None
    particle_dimension: str | None = None

    @classmethod
    def list_fields(cls) -> list[str]:
        """List what can be named."""
        return [field.name for field in fields(cls)]


@dataclass(frozen=True)
class Layout:
    """The names of the dimensions of places; ``axis`` is None where each axis is a variable."""

    time: Hashable
    particle: Hashable
    axis: Hashable | None

    def read(self, variable: xr.DataArray, states: slice | int) -> np.ndarray:
        """Read the numbers of a variable in some states, or in one, with their dimensions in the order of the layout.

        They are turned when they are in memory: xarray would make lists of the indices of all of them before.
        """
        return self.turn(variable, read_numbers(variable.isel({self.time: states})), states)

    def turn(self, variable: xr.DataArray, values: np.ndarray, states: slice | int) -> np.ndarray:
        """Return the values of a variable in some states, or in one, with dimensions in the order of the layout."""
        dims = [dim for dim in variable.dims if isinstance(states, slice) or dim != self.time]
        wanted = [dim for dim in (self.time, self.particle, self.axis) if dim in dims]
        return values.transpose([dims.index(dim) for dim in wanted])

    def has_particles(self, variable: xr.DataArray) -> bool:
        """Whether a variable is along the particles, or along time and the particles in any order."""
        return sorted(map(str, variable.dims)) in ([str(self.particle)], sorted([str(self.time), str(self.particle)]))

    def has_times(self, variable: xr.DataArray) -> bool:
        """Whether a variable is along time, or along time and the particles in any order."""
        return sorted(map(str, variable.dims)) in ([str(self.time)], sorted([str(self.time), str(self.particle)]))


def find_places(dataset: xr.Dataset, names: Names) -> list[xr.DataArray]:
    """Find the variables with the places: a single one with an axis, or one an axis.

    Raises DataError where there are none, or where they do not fit together.
    """
    if names.position:
        return _find_parts(dataset, names.position, "--position")
    for name in PLACES:
        if name in dataset.variables:
            return _find_parts(dataset, name, "--position")
    if {"x", "y"} <= set(dataset.variables):
        return _find_parts(dataset, [name for name in AXES if name in dataset.variables], "--position")
    raise DataError(
        "there are no positions: a variable 'position' (time, particle, axis) is needed, or 'x' and 'y' (time, "
        f"particle), or others that --position names; {list_variables(dataset)}"
    )


def find_velocities(dataset: xr.Dataset, names: Names, places: Sequence[xr.DataArray]) -> list[xr.DataArray]:
    """Find the variables with the velocities, in the form of the places; none where the data has none that fit.

    Raises DataError where those that were named do not fit.
    """
    if names.velocity == NOTHING:
        return []
    if names.velocity:
        parts = _find_parts(dataset, names.velocity, "--velocity")
        if not _have_same_form(parts, places):
            raise DataError(
                f"the velocities {quote_all(part.name for part in parts)} (--velocity) have other dimensions than the "
                "positions"
            )
        return parts
    for name in VELOCITIES:
        if name in dataset.variables and _have_same_form([dataset[name]], places):
            return [dataset[name]]
    for group in PARTS_OF_VELOCITY:
        parts = [dataset[name] for name in group[: len(places)] if name in dataset.variables]
        if len(places) > 1 and _have_same_form(parts, places):
            return parts
    return []


def find_layout(dataset: xr.Dataset, places: Sequence[xr.DataArray], names: Names) -> Layout:
    """Find which dimension of the places is time, which is particle and which is axis.

    Raises DataError where that is not clear, with the option that says it.
    """
    dims = places[0].dims
    for name, option in (
        (names.time_dimension, "--time-dimension"),
        (names.particle_dimension, "--particle-dimension"),
    ):
        if name is not None and name not in dims:
            raise DataError(f"the positions have no dimension {quote(name)} ({option}); they have {quote_all(dims)}")
    axis = _find_axis(places[0], names) if len(dims) == 3 else None
    others = [dim for dim in dims if dim != axis]
    times = {names.time_dimension} if names.time_dimension else set(_list_times(dataset, others))
    particles = {names.particle_dimension} if names.particle_dimension else set(_list_particles(dataset, others))
    if names.time_dimension:
        particles &= {dim for dim in others if dim != names.time_dimension}
    if names.particle_dimension:
        times -= {names.particle_dimension}
    if times & particles or len(times) > 1 or len(particles) > 1 or not (times or particles):
        sizes = dict(zip(dims, places[0].shape, strict=True))
        shown = " or ".join(f"{quote(dim)} ({sizes[dim]})" for dim in others)
        raise DataError(f"it is not clear which dimension is time, {shown}: say it with --time-dimension")
    time = next(iter(times)) if times else next(dim for dim in others if dim not in particles)
    return Layout(time, next(dim for dim in others if dim != time), axis)


def find_ids(dataset: xr.Dataset, names: Names, layout: Layout) -> xr.DataArray | None:
    """Find the variable that says which particle is which, (particle) or (time, particle); None where there is none.

    Raises DataError where one that was named has other dimensions.
    """
    if names.particle_id == NOTHING:
        return None
    if names.particle_id:
        found = find_variable(dataset, names.particle_id, "--id")
        if not layout.has_particles(found):
            raise DataError(f"the ids {quote(found.name)} (--id) have dimensions {quote_all(found.dims)}")
        return found
    usual = [name for name in dataset.variables if str(name).lower() in IDS or _is_trajectory_id(dataset, name)]
    usual += [layout.particle] if layout.particle in dataset.coords else []
    return next((dataset[name] for name in usual if layout.has_particles(dataset[name])), None)


def _find_parts(dataset: xr.Dataset, given: str | Sequence[str], option: str) -> list[xr.DataArray]:
    """Find variables by names, "x,y" for several, and check that their dimensions are those of places."""
    whole = isinstance(given, str) and (given in dataset.variables or "," not in given)
    listed = [str(given)] if whole else given.split(",") if isinstance(given, str) else list(given)
    parts = [find_variable(dataset, str(name).strip() if len(listed) > 1 else name, option) for name in listed]
    for part in parts:
        require_numbers(part)
    dims, shape = parts[0].dims, parts[0].shape
    sizes = _show_sizes(parts[0])
    if len(parts) == 1 and len(dims) != 3:
        raise DataError(f"{quote(listed[0])} must have dimensions time, particle and axis of 2 or 3, not ({sizes})")
    if len(parts) > 3:
        raise DataError(f"{option} names {len(parts)} variables: there are 2 or 3 axes")
    if len(parts) > 1 and any(len(part.dims) != 2 or set(part.dims) != set(dims) for part in parts):
        raise DataError(f"{quote_all(listed)} must have the same two dimensions, time and particle")
    if len(set(dims)) < len(dims):
        raise DataError(f"{quote(listed[0])} has a dimension twice: ({sizes})")
    if 0 in shape:
        raise DataError(f"{quote(listed[0])} is empty: must have dimensions time, particle and axis, not ({sizes})")
    return parts


def _show_sizes(part: xr.DataArray) -> str:
    return ", ".join(f"{make_printable(dim)} {size}" for dim, size in zip(part.dims, part.shape, strict=True))


def _find_axis(place: xr.DataArray, names: Names) -> Hashable:
    """Find the dimension of a variable along which the axes are: by its name, or as the only one of 2 or 3."""
    taken = {names.time_dimension, names.particle_dimension}
    possible = [
        dim
        for dim, size in zip(place.dims, place.shape, strict=True)
        if size in (2, 3) and dim not in taken and _simplify(dim) not in NAMES_OF_TIME | NAMES_OF_PARTICLES
    ]
    named = [dim for dim in possible if _simplify(dim) in NAMES_OF_AXES]
    if len(named or possible) == 1:
        return (named or possible)[0]
    if not possible:
        raise DataError(
            f"{quote(place.name)} must have dimensions time, particle and axis of 2 or 3, not ({_show_sizes(place)})"
        )
    raise DataError(
        f"it is not clear which dimension of {quote(place.name)} is the axis, {quote_all(possible)}: say which are "
        "time and particle with --time-dimension and --particle-dimension"
    )


def _list_times(dataset: xr.Dataset, dims: Iterable[Hashable]) -> list[Hashable]:
    """List the dimensions that have the name of a time, or along which a variable is the time."""
    return [
        dim
        for dim in dims
        if _simplify(dim) in NAMES_OF_TIME
        or any(variable.dims == (dim,) and _is_time(name, variable) for name, variable in dataset.variables.items())
    ]


def _list_particles(dataset: xr.Dataset, dims: Iterable[Hashable]) -> list[Hashable]:
    """List the dimensions that have the name of particles, or along which CF has a trajectory's id."""
    return [
        dim
        for dim in dims
        if _simplify(dim) in NAMES_OF_PARTICLES
        or any(dataset[name].dims == (dim,) and _is_trajectory_id(dataset, name) for name in dataset.variables)
    ]


def _is_time(name: Hashable, variable: xr.Variable) -> bool:
    """Whether a variable is a time: by its name, its unit, or what CF says of it."""
    return (
        str(name).lower() in ("time", "t")
        or variable.dtype.kind == "M"
        or read_text(variable, "standard_name") == "time"
        or read_text(variable, "axis") == "T"
        or " since " in read_unit(variable)
    )


def _is_trajectory_id(dataset: xr.Dataset, name: Hashable) -> bool:
    return read_text(dataset[name], "cf_role") == "trajectory_id"


def _have_same_form(parts: Sequence[xr.DataArray], places: Sequence[xr.DataArray]) -> bool:
    """Whether variables have the dimensions of the places, in any order."""
    if len(parts) != len(places):
        return False
    return all(
        sorted(map(str, part.dims)) == sorted(map(str, places[0].dims)) and part.dtype.kind in "iuf" for part in parts
    )


def _simplify(dim: Hashable) -> str:
    """Return the name of a dimension in lower case, without "n" or "number of" before it and "s" behind it."""
    name = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", str(dim)).lower()
    known = NAMES_OF_TIME | NAMES_OF_PARTICLES | NAMES_OF_AXES
    bare = re.sub(r"^(number_?of_?|num_?|n_?)", "", name)
    candidates = (name, name.rstrip("s"), name.replace("_", ""), bare, bare.rstrip("s"), bare.replace("_", ""))
    return next((candidate for candidate in candidates if candidate in known), name)
