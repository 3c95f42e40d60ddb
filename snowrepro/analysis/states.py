"""Lump, crushed or loose: what became of each bit of snow, as an eye sees it.

*Lump*: it holds together, in a body of some mass.  *Crushed*: it was compacted where it lies.  *Loose*: it came apart.
What is said of snow changes little by little with its strain, so that a hair more or less of it decides nothing: a bit
of snow has a part of each state.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..settings.analysis import Analysis
from .clusters import Clusters
from .strain import Maps, Neighbours, Partings
from .tree import find_components

STATES = ("lump", "crushed", "loose")
NEAR = 8  # clusters beside its own that may carry a particle
AT_ONCE = 20_000  # particles, to be spare with memory


@dataclass(frozen=True)
class Bodies:
    """Which bits of snow hang together, and what happened to each.

    ``component`` (n,): body of each bit, -1 for what hangs on none; ``crushed`` and ``opened`` (n,): how far it was
    compacted, and how far it came apart, from 0 to 1.
    """

    component: np.ndarray
    crushed: np.ndarray
    opened: np.ndarray

    @property
    def whole(self) -> np.ndarray:
        """Which part of each bit is neither compacted nor opened (n,)."""
        return np.where(self.component < 0, 0.0, (1.0 - self.crushed) * (1.0 - self.opened))


def join_clusters(
    neighbours: Neighbours, is_near: np.ndarray, partings: Partings, maps: Maps, analysis: Analysis
) -> Bodies:
    """Find the bodies of clusters: those that were near at release (``is_near``, (m,)) and hold together still.

    What came apart altogether joins nothing; a cluster that lost all that it was joined to is in no body.
    """
    with np.errstate(divide="ignore"):
        change = np.log(np.maximum(maps.change_of_volume, 0.0))
    least, most = analysis.volume_change
    crushed, opened = (np.clip((sign * change - least) / (most - least), 0.0, 1.0) for sign in (-1, 1))
    holds = partings.is_joined & is_near & (opened[neighbours.pairs] < 1.0).all(axis=1)
    before, now = (np.bincount(neighbours.pairs[kind].ravel(), minlength=len(change)) for kind in (is_near, holds))
    component = find_components(neighbours.pairs[holds], len(change))
    return Bodies(np.where((before > 0) & (now == 0), -1, component), crushed, opened)


def find_near(neighbours: Neighbours, count: int, reach: float) -> np.ndarray:
    """Find the pairs (m,) at most ``reach`` long, or of which one of ``count`` clusters has no nearer neighbour."""
    shortest = np.full(count, np.inf)
    np.minimum.at(shortest, neighbours.pairs, neighbours.length[:, None])
    is_nearest = (neighbours.length[:, None] <= shortest[neighbours.pairs]).any(axis=1)
    return (neighbours.length <= reach) | is_nearest


def find_carriers(clusters: Clusters, start: np.ndarray) -> np.ndarray:
    """Find the clusters that may carry each particle at ``start`` (n, d): its own, then the nearest, (n, c)."""
    tree, near = cKDTree(clusters.position), range(1, min(NEAR + 1, len(clusters.mass)) + 1)
    carriers = np.empty((len(start), 1 + len(near)), dtype=np.int32)
    carriers[:, 0] = clusters.member
    for first in range(0, len(start), AT_ONCE):
        block = slice(first, first + AT_ONCE)
        carriers[block, 1:] = tree.query(start[block], k=near)[1]
    return carriers


def attach_particles(
    clusters: Clusters,
    carriers: np.ndarray,
    bodies: Bodies,
    maps: Maps,
    centre: np.ndarray,
    start: np.ndarray,
    now: np.ndarray,
    stray: float,
) -> Bodies:
    """Find what became of each particle: that of the cluster, of its ``carriers``, whose map best says where it is now.

    ``bodies``, ``maps``, ``centre`` (k, d): of the clusters now; ``start`` and ``now`` (n, d): places of the particles.
    A particle farther than ``stray`` from where any of them would carry it is loose.
    """
    cluster, miss = np.empty(len(now), dtype=np.int64), np.empty(len(now))
    for first in range(0, len(now), AT_ONCE):
        block = slice(first, first + AT_ONCE)
        tried = carriers[block]
        misses = measure_misses(tried, clusters.position, maps, centre, start[block], now[block])
        misses = np.where((bodies.component < 0)[tried] | np.isnan(misses), np.inf, misses)
        best = misses.argmin(axis=1)[:, None]
        cluster[block] = np.take_along_axis(tried, best, axis=1)[:, 0]
        miss[block] = np.take_along_axis(misses, best, axis=1)[:, 0]
    is_held = miss <= stray
    component = np.where(is_held, bodies.component[cluster], -1)
    return Bodies(
        component, np.where(is_held, bodies.crushed[cluster], 0.0), np.where(is_held, bodies.opened[cluster], 1.0)
    )


def measure_misses(
    tried: np.ndarray, origin: np.ndarray, maps: Maps, centre: np.ndarray, start: np.ndarray, now: np.ndarray
) -> np.ndarray:
    """Measure how far each particle is from where each cluster that is ``tried`` (n, c) would carry it, (n, c).

    ``origin`` and ``centre`` (k, d): of the clusters at release and now; ``start``, ``now`` (n, d): of the particles.
    """
    axes = range(start.shape[1])  # axis by axis: to gather from arrays of numbers is several times as fast
    arm = [start[:, axis, None] - origin[:, axis].take(tried) for axis in axes]
    square = np.zeros(tried.shape)
    for axis in axes:
        carried = sum(maps.matrix[:, axis, other].take(tried) * arm[other] for other in axes)
        square += (centre[:, axis].take(tried) + carried - now[:, axis, None]) ** 2
    return np.sqrt(square)


def divide_mass(bodies: Bodies, mass: np.ndarray, least: float) -> np.ndarray:
    """Divide each bit of snow into its parts of STATES, (n, 3).

    ``mass`` (n,); ``least``: of a lump, all of it whole.  In a body that large all else is crushed or loose as it was
    strained; a smaller one came off, and is loose.  What opened is loose as it is, so that none is exactly none.
    """
    label = bodies.component + 1  # 0: none
    whole = bodies.whole
    is_lump = np.bincount(label, mass * whole) >= least
    is_body = np.bincount(label, mass) >= least
    is_lump[0] = is_body[0] = False
    lump = whole * is_lump[label]
    crushed = np.where(is_body[label], bodies.crushed * (1.0 - bodies.opened) + whole * ~is_lump[label], 0.0)
    loose = np.where(is_body[label], bodies.opened, 1.0)
    return np.stack([lump, crushed, loose], axis=1)
