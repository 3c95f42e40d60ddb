"""Places and masses of particles from the release on, read and checked from a run's Dataset or anyone's data."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from scipy.spatial import cKDTree

from ..errors import DataError
from ..settings.analysis import Analysis

NEIGHBOURS = 12  # by whose distance the particles' spacing is found
PER_AXIS = 2  # particles along a grid cell, where a file does not say how wide its cells are
AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Motion:
    """Particles over time, from the release on.

    ``frames`` (t,): numbers of the states, rising; ``time`` (t,): of each [s], or the frame numbers where it is not
    known; ``position`` (t, n, 2 or 3); ``velocity``: the same shape where the data has it, read from the file when it
    is used; ``mass`` (n,); ``grid_spacing``: in the unit of the positions; ``cell_mass``: of unpressed snow in a cell
    of the paper's grid; ``vanished`` (t, n): whether a particle is no longer there.  ``unit``: of the positions, empty
    where it is not known.  ``assumed``: what had to be assumed because the data does not say it, in words.
    """

    frames: np.ndarray
    time: np.ndarray
    position: np.ndarray
    velocity: xr.DataArray | None
    mass: np.ndarray
    grid_spacing: float
    cell_mass: float
    vanished: np.ndarray
    unit: str = ""
    assumed: list[str] = field(default_factory=list)

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
            return self.velocity[index].values.astype(float)
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
    mass: np.ndarray | float | None = None,
    release: int | None = None,
    grid_spacing: float | None = None,
    cell_mass: float | None = None,
) -> Motion:
    """Read the motion of particles from a Dataset or an array, and check it.

    A Dataset has ``position`` (time, particle, axis), or ``x``, ``y`` and maybe ``z`` (time, particle), under any names
    of the dimensions; where it has them too: ``velocity``, ``mass`` (particle,), a coordinate along time whose whole
    numbers are frame numbers, and the attributes ``release_frame``, ``grid_spacing`` and ``cell_mass``.  An array has
    shape (time, particle, axis).  The arguments win over the data.  A particle whose place is NaN from some state to
    the last has vanished.  Raises DataError with what is missing or wrong.
    """
    dataset = data if isinstance(data, xr.Dataset) else _wrap_array(data)
    position = _read_position(dataset)
    frames, time = _read_frames(dataset, position)
    start = _find_release(dataset, frames, release)
    assumed: list[str] = []
    values = position[start:].values
    vanished = _find_vanished(values, frames[start:])
    masses = _read_masses(dataset, mass, values.shape[1], assumed)
    spacing = _read_spacing(dataset, grid_spacing, values[0], assumed)
    if cell_mass is None:
        cell_mass = dataset.attrs.get("cell_mass")
    if cell_mass is None:
        cell_mass = float(masses.mean()) * PER_AXIS ** values.shape[2]
        assumed.append(f"mass of a cell: {cell_mass:.4g}, of {PER_AXIS ** values.shape[2]} mean particles")
    return Motion(
        frames[start:],
        time[start:],
        values,
        _read_velocity(dataset, position, start),
        masses,
        spacing,
        float(cell_mass),
        vanished,
        str(position.attrs.get("units", "")),
        assumed,
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


def _read_position(dataset: xr.Dataset) -> xr.DataArray:
    """Read the positions (time, particle, axis).  Raises DataError where they are missing or have another shape."""
    if "position" in dataset:
        position = dataset["position"]
    elif {"x", "y"} <= set(dataset.variables):
        parts = [dataset[name].reset_coords(drop=True) for name in AXES if name in dataset.variables]
        if any(part.ndim != 2 or part.dims != parts[0].dims for part in parts):
            raise DataError("x and y must have the same two dimensions, time and particle")
        position = xr.concat(parts, "axis").transpose(..., "axis")
    else:
        raise DataError(
            "there are no positions: a variable 'position' (time, particle, axis) is needed, or 'x' and 'y' "
            f"(time, particle); there are: {', '.join(map(str, dataset.data_vars)) or 'no variables'}"
        )
    if position.ndim != 3 or position.shape[2] not in (2, 3) or 0 in position.shape:
        shape = ", ".join(f"{name} {size}" for name, size in zip(position.dims, position.shape, strict=True))
        raise DataError(f"position must have dimensions time, particle and axis of 2 or 3, not ({shape})")
    if not np.issubdtype(position.dtype, np.number):
        raise DataError(f"position must be numbers, not {position.dtype}")
    return position


def _read_frames(dataset: xr.Dataset, position: xr.DataArray) -> tuple[np.ndarray, np.ndarray]:
    """Read the frame number of each state, and its time [s], or the frame number where there is none; both (t,).

    Raises DataError where the numbers do not rise.
    """
    along = position.dims[0]
    count = position.shape[0]
    label = dataset[along].values if along in dataset.coords else np.arange(count)
    whole = np.issubdtype(label.dtype, np.integer)
    frames = label.astype(np.int64) if whole else np.arange(count)
    if (np.diff(frames) <= 0).any():
        raise DataError(f"the frame numbers along '{along}' must rise")
    for name in (f"{along}_time", "time", str(along)):
        if name in dataset.variables and dataset[name].dims == (along,) and not (name == along and whole):
            values = dataset[name].values
            if np.issubdtype(values.dtype, np.number):
                return frames, values.astype(float)
    return frames, frames.astype(float)


def _find_release(dataset: xr.Dataset, frames: np.ndarray, release: int | None) -> int:
    """Find the index of the state at release.  Raises DataError where the data does not say it, or does not have it."""
    stored = f"stored are {len(frames)} frames from {frames[0]} to {frames[-1]}"
    if release is None:
        release = dataset.attrs.get("release_frame")
    if release is None:
        raise DataError(
            f"the data does not say when the snow was released: give the frame ({stored}), as --release or release=, "
            "or as the attribute release_frame"
        )
    places = np.flatnonzero(frames == int(release))
    if not len(places):
        raise DataError(f"the release in frame {int(release)} is not stored: {stored}")
    return int(places[0])


def _find_vanished(values: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Find the particles that have vanished: whether each has no place (NaN) in each state, (t, n).

    Raises DataError where a place is infinite, missing at the release or in all particles, or comes back.
    """
    if np.isinf(values).any():
        state, particle, _ = np.argwhere(np.isinf(values))[0]
        raise DataError(f"particle {particle} is at infinity in frame {frames[state]}")
    gone = np.isnan(values).any(axis=2)
    if gone[0].any():
        count, first = int(gone[0].sum()), int(np.argmax(gone[0]))
        raise DataError(
            f"{count} particles have no place (NaN) at the release in frame {frames[0]}, the first is particle "
            f"{first}: bonds are laid between all particles then"
        )
    if gone[-1].all():
        raise DataError(f"all particles have vanished (NaN) by frame {frames[-1]}: that is a run that failed")
    back = gone[:-1] & ~gone[1:]
    if back.any():
        state, particle = np.argwhere(back)[0]
        raise DataError(
            f"particle {particle} has no place (NaN) in frame {frames[state]} and one in frame {frames[state + 1]}: "
            "a particle may vanish, but not come back"
        )
    return gone


def _read_masses(dataset: xr.Dataset, mass: np.ndarray | float | None, count: int, assumed: list[str]) -> np.ndarray:
    """Read the mass of each particle (n,): given, in the data, or assumed.  Raises DataError where one is not > 0."""
    if mass is None and "mass" in dataset:
        mass = dataset["mass"].values
    if mass is None:
        assumed.append("mass: 1 a particle")
        mass = 1.0
    values = np.asarray(mass, dtype=float)
    if values.ndim > 1 or values.size not in (1, count):
        raise DataError(f"mass must be one number or one a particle ({count}), not of shape {values.shape}")
    masses = np.broadcast_to(values.ravel(), (count,)).copy()
    if not np.isfinite(masses).all() or (masses <= 0).any():
        wrong = int(np.argmax(~(np.isfinite(masses) & (masses > 0))))
        raise DataError(f"masses must be positive and finite: particle {wrong} has {masses[wrong]}")
    return masses


def _read_spacing(dataset: xr.Dataset, spacing_given: float | None, places: np.ndarray, assumed: list[str]) -> float:
    """Read the width of a grid cell: given, in the data, or assumed so that PER_AXIS particles lie along it.

    ``places`` (n, 2 or 3): of the particles at the release.  Raises DataError where it is not positive, or where most
    particles are at one place.
    """
    if spacing_given is None:
        spacing_given = dataset.attrs.get("grid_spacing")
    if spacing_given is not None:
        if not (np.isfinite(spacing_given) and spacing_given > 0):
            raise DataError(f"grid_spacing must be positive, not {spacing_given}")
        return float(spacing_given)
    count, dimensions = places.shape
    near = min(NEIGHBOURS, count - 1)
    if near == 0:
        return 1.0
    reach = float(np.median(cKDTree(places).query(places, k=[near + 1])[0]))
    ball = np.pi if dimensions == 2 else 4 / 3 * np.pi
    spacing = PER_AXIS * reach * (ball / near) ** (1 / dimensions)
    if not spacing > 0:
        raise DataError("most particles are at one place at the release: give grid_spacing")
    assumed.append(f"grid spacing: {spacing:.4g}, {PER_AXIS} times the particles' spacing at release")
    return spacing


def _read_velocity(dataset: xr.Dataset, position: xr.DataArray, start: int) -> xr.DataArray | None:
    """Take the velocities from the release on, not yet read from the file; None where the data has none."""
    if "velocity" not in dataset or dataset["velocity"].dims != position.dims:
        return None
    return dataset["velocity"][start:]


def require_frames(motion: Motion, frames: Sequence[int]) -> list[int]:
    """Return ``frames`` in rising order, each once.  Raises DataError naming those that are not stored."""
    missing = sorted(set(frames) - set(motion.frames.tolist()))
    if missing:
        raise DataError(f"frames {missing} are not stored at or after the release in frame {motion.release}")
    return sorted(set(frames))
