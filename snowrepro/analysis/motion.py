"""Places and masses of particles from the release on, read and checked from a run's Dataset or anyone's data."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from scipy.spatial import cKDTree

from ..errors import DataError
from ..foreign import parse_json
from ..settings.analysis import Analysis
from ..text import quote, quote_all
from .clock import SECOND, read_clock
from .identity import Identity, read_identity
from .layout import AXES, Layout, Names, find_ids, find_layout, find_places, find_velocities
from .track import Track, has_track, read_track
from .values import NOTHING, find_variable, read_number, read_numbers, read_unit, require_plausible_size

NEIGHBOURS = 12  # by whose distance the particles' spacing is found
PER_AXIS = 2  # particles along a grid cell, where a file does not say how wide its cells are
MOST_PARTICLES = 4_000_000
LARGEST_PLACE = 1e100  # its square can be computed
MOST_CELLS = 1e12  # along an axis
LEVEL = 1e-9  # of the size of the body: particles differ less in height where they are at one height
USUAL = Names()


@dataclass(frozen=True)
class Motion:
    """Particles over time, from the release on.

    ``frames`` (t,): numbers of the states, rising; ``time`` (t,): of each, in ``time_unit``, or the frame numbers where
    it is not known; ``position`` (t, n, 2 or 3), along ``axes``; ``velocity``: reads those of the state at an index
    (n, 2 or 3), where the data has them; ``mass`` (n,); ``grid_spacing``: in the unit of the positions; ``cell_mass``:
    of unpressed snow in a cell of the paper's grid; ``vanished`` (t, n): whether a particle is no longer there.
    ``cell``: a cell of the paper's grid in the unit of the positions; ``track``: clusters that the run followed.
    ``unit``: of the positions, empty where it is not known.  ``assumed``: what had to be assumed because the data does
    not say it, in words.  ``particle_id`` (n,): the data's own names of the particles, where it has them.
    """

    frames: np.ndarray
    time: np.ndarray
    position: np.ndarray
    velocity: Callable[[int], np.ndarray] | None
    mass: np.ndarray
    grid_spacing: float
    cell_mass: float
    cell: float
    vanished: np.ndarray
    unit: str = ""
    assumed: list[str] = field(default_factory=list)
    axes: tuple[str, ...] = AXES
    particle_id: np.ndarray | None = None
    time_unit: str = SECOND
    track: Track | None = None

    @property
    def release(self) -> int:
        """The frame of the release."""
        return int(self.frames[0])

    @property
    def dimensions(self) -> int:
        """The number of dimensions, 2 or 3."""
        return self.position.shape[2]

    def index(self, frame: int) -> int:
        """Return the index of a frame in the arrays.  Raises DataError if it is not stored."""
        places = np.flatnonzero(self.frames == frame)
        if not len(places):
            raise DataError(f"frame {frame} is not stored at or after the release in frame {self.release}")
        return int(places[0])

    def velocities(self, index: int) -> np.ndarray:
        """Return the velocity of each particle in the state at ``index``, (n, 2 or 3).

        As it is stored, or else by differences of the positions in time; NaN where there is one state alone.
        """
        if self.velocity is not None:
            return self.velocity(index)
        low, high = max(index - 1, 0), min(index + 1, len(self.frames) - 1)
        if low == high:
            return np.full(self.position.shape[1:], np.nan)
        return (self.position[high].astype(float) - self.position[low]) / (self.time[high] - self.time[low])

    def least_lump(self, analysis: Analysis) -> float:
        """Return the least mass of a lump.

        It is set in cells of the paper's grid too, so that it is the same at every fidelity.
        """
        return max(analysis.lump_mass * float(self.mass.sum()), analysis.lump_cells * self.cell_mass)


def read_motion(
    data: xr.Dataset | np.ndarray,
    *,
    names: Names = USUAL,
    mass: np.ndarray | float | None = None,
    release: int | None = None,
    grid_spacing: float | None = None,
    cell_mass: float | None = None,
    cell: float | None = None,
) -> Motion:
    """Read the motion of particles from a Dataset or an array, and check it.

    A Dataset has ``position`` (time, particle, axis), or ``x``, ``y`` and maybe ``z`` (time, particle), the dimensions
    in any order: see ``find_layout``; where it has them too: ``velocity``, ``mass`` (particle,), ``id`` (particle,) or
    (time, particle), times, a coordinate along time whose whole numbers are frame numbers, and the attributes
    ``release_frame``, ``grid_spacing``, ``cell`` and ``cell_mass``.  ``names``: where these have other names.  An array
    has shape (time, particle, axis).  The arguments win over the data.  A particle whose place is NaN from some state
    to the last has vanished.  Raises DataError with what is missing or wrong.
    """
    dataset = data if isinstance(data, xr.Dataset) else _wrap_array(data)
    places = find_places(dataset, names)
    layout = find_layout(dataset, places, names)
    _require_few(places, layout)
    clock = read_clock(dataset, layout, names)
    start, assumed = _find_release(dataset, clock.frames, release), list(clock.assumed)
    identity = read_identity(find_ids(dataset, names, layout), layout, start)
    values = identity.sort_states(_read_states(places, layout, start))
    vanished = _find_vanished(values, clock.frames[start:])
    if vanished.any():
        is_known = dataset is not data or names.particle_id is not None or identity.ids is not None
        _judge_vanished(vanished, clock.frames[start:], is_known, assumed)
    axes = _find_axes(values, assumed)
    values = values if len(axes) == values.shape[2] else values[:, :, axes]
    masses = _read_masses(_find_mass(dataset, mass, names, layout, identity, start), values.shape[1], assumed)
    spacing = _read_spacing(dataset, grid_spacing, values[0], assumed)
    width = _read_cell(dataset, cell, spacing, assumed)
    _require_moderate(values, min(spacing, width))
    return Motion(
        clock.frames[start:],
        clock.time[start:],
        values,
        _read_velocity(find_velocities(dataset, names, places), layout, start, identity, axes),
        masses,
        spacing,
        _read_cell_mass(dataset, cell_mass, masses, values.shape[2], assumed),
        width,
        vanished,
        _read_length_unit(places),
        assumed,
        tuple(AXES[axis] for axis in axes),
        identity.ids,
        clock.unit,
        read_track(dataset, int(clock.frames[start]), len(masses)) if has_track(dataset) else None,
    )


def _wrap_array(positions: np.ndarray) -> xr.Dataset:
    """Make a Dataset of positions (time, particle, axis).  Raises DataError for other shapes, and for no numbers."""
    try:
        values = np.asarray(positions, dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError(f"positions must be numbers of shape (time, particle, axis): {error}") from error
    if values.ndim != 3:
        raise DataError(f"positions must have shape (time, particle, axis), not {values.shape}")
    return xr.Dataset({"position": (("snapshot", "particle", "axis"), values)})


def _require_few(places: Sequence[xr.DataArray], layout: Layout) -> None:
    """Check that the positions can be read and classified.  Raises DataError with their number and the bound if not."""
    for part in places:
        require_plausible_size(part, len(places))
    count = places[0].sizes[layout.particle]
    if count > MOST_PARTICLES:
        raise DataError(f"there are {count:,} particles, more than the {MOST_PARTICLES:,} that are classified at once")


def _read_states(places: Sequence[xr.DataArray], layout: Layout, start: int) -> np.ndarray:
    """Read the positions (time, particle, axis) from the state at ``start`` on."""
    since = slice(start, None)
    if len(places) == 1:
        return _sort_axes(layout.read(places[0], since), places[0], layout)
    sizes = places[0].sizes
    kind = np.result_type(np.float32, *(part.dtype for part in places))
    values = np.empty((sizes[layout.time] - start, sizes[layout.particle], len(places)), kind)
    for axis, part in enumerate(places):
        values[:, :, axis] = layout.read(part, since)
    return values


def _sort_axes(values: np.ndarray, place: xr.DataArray, layout: Layout) -> np.ndarray:
    """Return positions with their axes in the order x, y, z where the coordinate along the axis says another one."""
    if layout.axis not in place.coords:
        return values
    names = place[layout.axis].values.tolist()
    labels = [(name.decode("latin-1") if isinstance(name, bytes) else str(name)).strip().lower() for name in names]
    return values[:, :, sorted(range(len(labels)), key=labels.__getitem__)] if set(labels) <= set(AXES) else values


def _read_length_unit(places: Sequence[xr.DataArray]) -> str:
    """Read the unit of the positions.  Raises DataError where the axes differ in it, or where it is no length."""
    units = [read_unit(part) for part in places]
    if len(set(units)) > 1:
        raise DataError(f"the axes have different units: {quote_all(units)}")
    if units[0].lower().startswith("degree"):
        raise DataError(
            f"the positions are in {quote(units[0])}: distances need lengths, so give others with --position"
        )
    return units[0]


def _find_axes(values: np.ndarray, assumed: list[str]) -> list[int]:
    """Find the axes that count, of positions (t, n, 2 or 3): in 3D one along which all particles are level does not."""
    axes = list(range(values.shape[2]))
    if len(axes) == 2 or values.shape[1] < 2:
        return axes
    lowest, highest = np.nanmin(values, axis=1), np.nanmax(values, axis=1)  # (t, 3)
    is_level = (highest - lowest <= LEVEL * (highest - lowest).max(axis=1, keepdims=True)).all(axis=0)
    for axis in reversed(axes):
        if is_level[axis]:
            least = lowest[:, axis]
            at = f"{least[0]:.4g} everywhere" if np.ptp(least) == 0 else "the same for all particles in each state"
            assumed.append(f"dimensions: 2, as {AXES[axis]} is {at}")
            return [other for other in axes if other != axis]
    return axes


def _find_release(dataset: xr.Dataset, frames: np.ndarray, release: int | None) -> int:
    """Find the index of the state at release.  Raises DataError where the data does not say it, or does not have it."""
    stored = f"stored are {len(frames)} frames from {frames[0]} to {frames[-1]}"
    wanted = release if release is not None else dataset.attrs.get("release_frame")
    if wanted is None:
        raise DataError(
            f"the data does not say when the snow was released: give the frame ({stored}), with --release, "
            "or as the attribute release_frame"
        )
    name = "the attribute release_frame" if release is None else "release"
    number = read_number(wanted, name, f"give the frame ({stored}) with --release")
    places = np.flatnonzero(frames == number)
    if not len(places):
        raise DataError(f"the release in frame {number:.15g} is not stored: {stored}")
    return int(places[0])


def _find_vanished(values: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Find the particles that have vanished: whether each has no place (NaN) in each state, (t, n).

    Raises DataError where a place is infinite, missing at the release or in all particles, or comes back.
    """
    if np.isinf(values).any():
        state, particle, _ = np.argwhere(np.isinf(values))[0]
        raise DataError(f"particle {particle} is at infinity in frame {frames[state]}")
    missing = [np.isnan(along) for along in np.moveaxis(values, 2, 0)]
    gone = np.logical_or.reduce(missing)
    if gone[0].any():
        count, first = int(gone[0].sum()), int(np.argmax(gone[0]))
        raise DataError(
            f"{count} particles have no place (NaN) at the release in frame {frames[0]}, the first is particle "
            f"{first}: bonds are laid between all particles then"
        )
    partly = gone & ~np.logical_and.reduce(missing)
    if partly.any():
        state, particle = np.argwhere(partly)[0]
        raise DataError(
            f"{int(partly.sum())} places are NaN along one axis and not along another, the first is that of particle "
            f"{particle} in frame {frames[state]}"
        )
    if gone[-1].all():
        raise DataError(f"all particles have vanished (NaN) by frame {frames[-1]}: that is a run that failed")
    back = gone[:-1] & ~gone[1:]
    if back.any():
        state, particle = np.argwhere(back)[0]
        raise DataError(
            f"particle {particle} has no place (NaN) in frame {frames[state]} and one in frame {frames[state + 1]}: "
            f"a particle may vanish, but not come back ({int(back.sum())} do so)"
        )
    return gone


def _judge_vanished(vanished: np.ndarray, frames: np.ndarray, is_order_known: bool, assumed: list[str]) -> None:
    """Say which particles vanished, (t, n), and check that they are no padding behind a number that changes.

    Raises DataError where the order of the particles is not known and in each state exactly the last are missing.
    """
    state = int(np.argmax(vanished.any(axis=1)))
    gone = int(vanished[-1].sum())
    assumed.append(f"vanished: {gone} particles have no place at the end, the first from frame {frames[state]} on")
    there = (~vanished).sum(axis=1)
    if not is_order_known and all(not vanished[row, :count].any() for row, count in enumerate(there)):
        raise DataError(
            f"the last {int(vanished[state].sum())} of {vanished.shape[1]} particles have no place (NaN) in frame "
            f"{frames[state]}: if they vanished, say that all states have one order, --id none; if the number of "
            "particles changes, name the variable with their ids, --id NAME"
        )


def _require_moderate(values: np.ndarray, spacing: float) -> None:
    """Check that places can be counted in cells.  Raises DataError if not."""
    farthest = float(np.nanmax(np.abs(values)))
    if farthest > LARGEST_PLACE or farthest > MOST_CELLS * spacing:
        raise DataError(
            f"places are up to {farthest:.3g}, which is too far to count in grid cells of {spacing:.3g}: are they "
            "values for what is missing?"
        )


def _find_mass(
    dataset: xr.Dataset, mass: Any, names: Names, layout: Layout, identity: Identity, start: int
) -> np.ndarray | float | None:
    """Find the masses: those given, or those in the data, in the order of the particles; None where there are none."""
    if mass is not None or names.mass == NOTHING:
        return mass
    if names.mass is None and "mass" not in dataset.variables:
        return None
    variable = find_variable(dataset, names.mass or "mass", "--mass")
    if variable.ndim == 2 and layout.has_particles(variable):
        states = identity.sort_states(layout.read(variable, slice(start, None)))
        if (states != states[0]).any():
            raise DataError(f"the masses {quote(variable.name)} change in time: give constant ones with --mass")
        return np.asarray(states[0])
    masses = read_numbers(variable)
    if identity.order is not None and masses.size > 1 and np.ptp(masses) > 0:
        raise DataError(
            f"the masses {quote(variable.name)} do not say of which particle they are, as the ids change their order "
            "from state to state: give them by state, or with --mass"
        )
    return masses


def _read_masses(mass: np.ndarray | float | None, count: int, assumed: list[str]) -> np.ndarray:
    """Return the mass of each particle (n,), of what is known or assumed.  Raises DataError where one is not > 0."""
    if mass is None:
        assumed.append("mass: 1 a particle")
        mass = 1.0
    try:
        values = np.asarray(mass, dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError(f"mass must be numbers, not {quote(mass)}") from error
    if values.ndim > 1 or values.size not in (1, count):
        raise DataError(f"mass must be one number or one a particle ({count}), not of shape {values.shape}")
    masses = np.broadcast_to(values.ravel(), (count,)).copy()
    if not np.isfinite(masses).all() or (masses <= 0).any() or not np.isfinite(masses.sum()):
        wrong = int(np.argmax(~(np.isfinite(masses) & (masses > 0))))
        raise DataError(f"masses must be positive and finite: particle {wrong} has {masses[wrong]}")
    return masses


def _read_cell_mass(
    dataset: xr.Dataset, cell_mass: float | None, masses: np.ndarray, dimensions: int, assumed: list[str]
) -> float:
    """Read the mass of unpressed snow in a cell: given, in the data, or assumed.  Raises DataError if negative."""
    wanted = cell_mass if cell_mass is not None else dataset.attrs.get("cell_mass")
    if wanted is None:
        mean = float(masses.mean()) * PER_AXIS**dimensions
        assumed.append(f"mass of a cell: {mean:.4g}, of {PER_AXIS**dimensions} mean particles")
        return mean
    number = read_number(wanted, "cell_mass", "give it with --cell-mass")
    if not (np.isfinite(number) and number >= 0):
        raise DataError(f"cell_mass must not be negative or infinite ({number:g}): give it with --cell-mass")
    return number


def _read_spacing(dataset: xr.Dataset, spacing_given: float | None, places: np.ndarray, assumed: list[str]) -> float:
    """Read the width of a grid cell: given, in the data, or assumed so that PER_AXIS particles lie along it.

    ``places`` (n, 2 or 3): of the particles at the release.  Raises DataError where it is not positive, or where most
    particles are at one place.
    """
    wanted = spacing_given if spacing_given is not None else dataset.attrs.get("grid_spacing")
    if wanted is None:
        return _estimate_spacing(places, assumed)
    number = read_number(wanted, "grid_spacing", "give it with --grid-spacing, in the unit of the positions")
    if not (np.isfinite(number) and number > 0):
        raise DataError(f"grid_spacing must be positive, not {number:g}")
    return number


def _read_cell(dataset: xr.Dataset, cell: float | None, spacing: float, assumed: list[str]) -> float:
    """Read the width of a cell of the paper's grid: given, in the data, or assumed to be that of a grid cell.

    Raises DataError where it is not positive.
    """
    wanted = next(
        (value for value in (cell, dataset.attrs.get("cell"), _find_cell_of_run(dataset)) if value is not None), None
    )
    if wanted is None:
        assumed.append(f"cell: {spacing:.4g}, as wide as a grid cell; strain is measured over some")
        return spacing
    number = read_number(wanted, "cell", "give it with --cell, in the unit of the positions")
    if not (np.isfinite(number) and number > 0):
        raise DataError(f"cell must be positive, not {number:g}")
    return number


def _find_cell_of_run(dataset: xr.Dataset) -> Any:
    """Find the width of a cell of the paper's grid in the configuration of a run of ours; None for other data."""
    try:
        return parse_json(dataset.attrs["config"])["reading"]["cell"]
    except (KeyError, TypeError, ValueError, RecursionError):
        return None


def _estimate_spacing(places: np.ndarray, assumed: list[str]) -> float:
    """Estimate the width of a grid cell from the places of the particles (n, 2 or 3) at the release."""
    is_repeated = pd.DataFrame(places).duplicated().to_numpy()
    if len(places) > 1 and 2 * is_repeated.sum() >= len(places):
        raise DataError("most particles are at one place at the release: give grid_spacing")
    count, dimensions = int((~is_repeated).sum()), max(2, int((np.ptp(places, axis=0) > 0).sum()))
    near = min(NEIGHBOURS, count - 1)
    if near == 0:
        return 1.0
    single = places[~is_repeated] if is_repeated.any() else places
    reach = float(np.median(cKDTree(single).query(single, k=[near + 1])[0]))
    ball = np.pi if dimensions == 2 else 4 / 3 * np.pi
    spacing = float(PER_AXIS * reach * (ball / near) ** (1 / dimensions))
    if not (spacing > 0 and np.isfinite(spacing)):
        raise DataError("most particles are at one place at the release: give grid_spacing")
    assumed.append(f"grid spacing: {spacing:.4g}, {PER_AXIS} times the particles' spacing at release")
    return spacing


def _read_velocity(
    parts: Sequence[xr.DataArray], layout: Layout, start: int, identity: Identity, axes: list[int]
) -> Callable[[int], np.ndarray] | None:
    """Make what reads the velocities of a state since the release from the file; None where the data has none."""
    if not parts:
        return None

    def read_state(index: int) -> np.ndarray:
        """Read the velocities (n, 2 or 3) in the state at ``index``."""
        states = [layout.read(part, start + index) for part in parts]
        whole = np.stack(states, axis=-1) if layout.axis is None else _sort_axes(states[0][None], parts[0], layout)[0]
        return identity.sort_state(whole, index)[:, axes].astype(float)

    return read_state


def require_frames(motion: Motion, frames: Sequence[int]) -> list[int]:
    """Return ``frames`` in rising order, each once.  Raises DataError naming those that are not stored."""
    missing = sorted(set(frames) - set(motion.frames.tolist()))
    if missing:
        raise DataError(f"frames {missing} are not stored at or after the release in frame {motion.release}")
    return sorted(set(frames))
