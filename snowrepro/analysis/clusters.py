"""Clusters of particles that lie together at release, and where each is later: the gauge of what is seen.

A cluster is as wide as a cell of the paper's grid, whatever the run's own grid and particles are, so that strain is
measured over the same length in every run.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.sparse import csr_matrix

MEMBER, POSITION, FRAMES = "cluster", "cluster_position", "tracked"  # variables of a run that followed them
FAR = 1.5  # sizes of a cluster from its middle: a particle so far away has left it


@dataclass(frozen=True)
class Clusters:
    """Clusters of the particles of a body.

    ``size``: their width; ``member`` (n,): cluster of each particle; ``particle_mass`` (n,); ``position`` (k, 2 or 3):
    centre of mass of each cluster at release; ``mass`` (k,); ``average`` (k, n): turns values of particles into their
    mean over each cluster.
    """

    size: float
    member: np.ndarray
    particle_mass: np.ndarray
    position: np.ndarray
    mass: np.ndarray
    average: csr_matrix


def group_particles(positions: np.ndarray, mass: np.ndarray, size: float) -> Clusters:
    """Make clusters of the particles in the same square, or cube, of side ``size``.

    ``positions`` (n, 2 or 3) and ``mass`` (n,): of the particles at release.
    """
    places = positions.astype(float)
    squares = pd.DataFrame(np.floor(places / size).astype(np.int64))
    return make_clusters(squares.groupby([*squares]).ngroup().to_numpy(), places, mass, size)


def make_clusters(member: np.ndarray, positions: np.ndarray, mass: np.ndarray, size: float) -> Clusters:
    """Make the clusters of which each particle is a ``member`` (n,); all else as in ``group_particles``."""
    total = np.bincount(member, mass)
    average = csr_matrix((mass / total[member], (member, np.arange(len(member)))), shape=(len(total), len(member)))
    return Clusters(size, member, mass, average @ positions.astype(float), total, average)


def locate_clusters(clusters: Clusters, positions: np.ndarray) -> np.ndarray:
    """Return the centre of mass of each cluster (k, 2 or 3) where its particles are at ``positions`` (n, 2 or 3).

    Particles that left it do not count: those FAR from the median of a cluster that spread so far.  A cluster whose
    particles have all vanished (NaN) has no centre (NaN).
    """
    places, member = positions.astype(float), clusters.member
    is_there = np.isfinite(places).all(axis=1) if np.isnan(places.sum()) else np.ones(len(places), dtype=bool)
    centre = clusters.average @ places if is_there.all() else _average_some(clusters, places, np.flatnonzero(is_there))
    is_spread = np.zeros(len(centre), dtype=bool)
    is_spread[member[is_there & _is_far(places, centre.take(member, axis=0), clusters.size)]] = True
    if not is_spread.any():
        return centre
    doubtful = np.flatnonzero(is_there & is_spread[member])
    medians = pd.DataFrame(places[doubtful]).groupby(member[doubtful]).median()
    middle = centre.copy()
    middle[medians.index] = medians.to_numpy()
    near = doubtful[~_is_far(places[doubtful], middle.take(member[doubtful], axis=0), clusters.size)]
    has_near = np.bincount(member[near], minlength=len(centre)) > 0
    return np.where(has_near[:, None], _average_some(clusters, places, near), centre)


def locate_rest(clusters: Clusters, start: np.ndarray, is_there: np.ndarray) -> np.ndarray:
    """Return the centre of mass at release (k, d) of those particles of each cluster that have not vanished since.

    ``start`` (n, d): places at release; ``is_there`` (n,).  Where all have vanished it stays that of the cluster.
    """
    centre = _average_some(clusters, start, np.flatnonzero(is_there))
    return np.where(np.isnan(centre), clusters.position, centre)


def _average_some(clusters: Clusters, places: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return the centre of mass of the ``chosen`` (c,) particles of each cluster, (k, d); NaN where there are none."""
    own, count = clusters.member[chosen], len(clusters.mass)
    weight = clusters.particle_mass[chosen] / clusters.mass[own]
    part = np.bincount(own, weight, count)
    sums = np.stack([np.bincount(own, weight * along, count) for along in places[chosen].T], axis=1)
    return sums / np.where(part > 0, part, np.nan)[:, None]


def _is_far(places: np.ndarray, centre: np.ndarray, size: float) -> np.ndarray:
    """Whether each place is FAR from its centre; both (n, 2 or 3)."""
    return measure_lengths(places - centre) > FAR * size


def measure_lengths(vectors: np.ndarray) -> np.ndarray:
    """Return the lengths (n,) of vectors (n, 2 or 3); several times as fast as NumPy's norm along so short an axis."""
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
