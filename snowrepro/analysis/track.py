"""Where the clusters of a body are in every frame since its release: as a run stored it, or from its stored states."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr

from ..errors import DataError
from .clusters import FRAMES, MEMBER, POSITION, Clusters, group_particles, locate_clusters, make_clusters
from .values import read_numbers, require_plausible_size


@dataclass(frozen=True)
class Track:
    """The clusters that a run followed.

    ``member`` (n,): cluster of each particle; ``frames`` (t,): from the release on; ``position`` (t, k, 2): in each.
    """

    member: np.ndarray
    frames: np.ndarray
    position: np.ndarray


def has_track(dataset: xr.Dataset) -> bool:
    """Whether a Dataset says where clusters of its particles are."""
    return {MEMBER, POSITION, FRAMES} <= {*dataset.variables}


def read_track(dataset: xr.Dataset, release: int, count: int) -> Track | None:
    """Read the clusters that a run followed; None where they are of another release.

    ``count``: of the particles.  Raises DataError where they are not those of the run.
    """
    for name in (MEMBER, POSITION, FRAMES):
        require_plausible_size(dataset[name])
    member, frames = (read_numbers(dataset[name]) for name in (MEMBER, FRAMES))
    position = read_numbers(dataset[POSITION])
    clusters = position.shape[1] if position.ndim == 3 else 0
    fits = member.shape == (count,) and position.shape == (len(frames), clusters, 2) and len(frames) > 0
    if not (fits and np.array_equal(np.unique(member), np.arange(clusters)) and (np.diff(frames) == 1).all()):
        raise DataError(f"its variables {MEMBER!r}, {POSITION!r} and {FRAMES!r} do not fit its particles")
    if not np.isfinite(position).all():
        raise DataError(f"its variable {POSITION!r} has places that are no numbers")
    if frames[0] != release:
        return None
    return Track(member.astype(np.int64), frames.astype(np.int64), position.astype(float))


def make_motion_clusters(position: np.ndarray, mass: np.ndarray, size: float, track: Track | None) -> Clusters:
    """Make the clusters of a body from its particles at release (n, d), or those that its run followed."""
    return group_particles(position, mass, size) if track is None else make_clusters(track.member, position, mass, size)


def follow_clusters(
    clusters: Clusters, frames: np.ndarray, states: np.ndarray, track: Track | None
) -> Iterator[tuple[int, np.ndarray]]:
    """Give each frame and the places of the clusters (k, d) in it, from the release on.

    Every frame where the run followed them; otherwise ``frames`` (t,) with stored ``states`` (t, n, d) of particles.
    """
    if track is not None:
        yield from zip(track.frames.tolist(), track.position, strict=True)
        return
    for frame, positions in zip(frames.tolist(), states, strict=True):
        yield frame, locate_clusters(clusters, positions)
