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
AT_ONCE = 100_000  # particles, to be spare with memory


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


def join_clusters(neighbours: Neighbours, partings: Partings, maps: Maps, reach: float, analysis: Analysis) -> Bodies:
    """Find the bodies of clusters: those near at release (at most ``reach``, or nearest) that hold together still.

    What came apart altogether joins nothing; a cluster that lost all that it was joined to is in no body.
    """
    with np.errstate(divide="ignore"):
        change = np.log(np.maximum(maps.change_of_volume, 0.0))
    least, most = analysis.volume_change
    crushed, opened = (np.clip((sign * change - least) / (most - least), 0.0, 1.0) for sign in (-1, 1))
    is_near = (neighbours.length <= reach) | find_nearest(neighbours, len(change))
    holds = partings.is_joined & is_near & (opened[neighbours.pairs] < 1.0).all(axis=1)
    before, now = (np.bincount(neighbours.pairs[kind].ravel(), minlength=len(change)) for kind in (is_near, holds))
    component = find_components(neighbours.pairs[holds], len(change))
    return Bodies(np.where((before > 0) & (now == 0), -1, component), crushed, opened)


def find_nearest(neighbours: Neighbours, count: int) -> np.ndarray:
    """Find the pairs (m,) of which one end has no nearer neighbour than the other, among ``count`` clusters."""
    shortest = np.full(count, np.inf)
    np.minimum.at(shortest, neighbours.pairs, neighbours.length[:, None])
    return (neighbours.length[:, None] <= shortest[neighbours.pairs]).any(axis=1)


def attach_particles(
    clusters: Clusters, bodies: Bodies, maps: Maps, centre: np.ndarray, start: np.ndarray, now: np.ndarray, stray: float
) -> Bodies:
    """Find what became of each particle: that of the near cluster whose map best says where it is now.

    ``bodies``, ``maps``, ``centre`` (k, d): of the clusters now; ``start`` and ``now`` (n, d): places of the particles.
    A particle farther than ``stray`` from where any of them would carry it is loose.
    """
    tree, cluster, miss = cKDTree(clusters.position), np.empty(len(now), dtype=np.int64), np.empty(len(now))
    for first in range(0, len(now), AT_ONCE):
        block = slice(first, first + AT_ONCE)
        near = tree.query(start[block], k=range(1, min(NEAR + 1, len(centre)) + 1))[1]
        tried = np.concatenate([clusters.member[block, None], near], axis=1)
        arm = start[block, None] - clusters.position[tried]
        carried = centre[tried] + np.einsum("ncij,ncj->nci", maps.matrix[tried], arm)
        misses = np.linalg.norm(carried - now[block, None], axis=2)
        misses = np.where((bodies.component[tried] < 0) | np.isnan(misses), np.inf, misses)
        best = misses.argmin(axis=1)[:, None]
        cluster[block] = np.take_along_axis(tried, best, axis=1)[:, 0]
        miss[block] = np.take_along_axis(misses, best, axis=1)[:, 0]
    is_held = miss <= stray
    component = np.where(is_held, bodies.component[cluster], -1)
    return Bodies(
        component, np.where(is_held, bodies.crushed[cluster], 0.0), np.where(is_held, bodies.opened[cluster], 1.0)
    )


def divide_mass(bodies: Bodies, mass: np.ndarray, least: float) -> np.ndarray:
    """Divide each bit of snow into its parts of STATES, (n, 3).

    ``mass`` (n,); ``least``: of a lump, all of it whole.  In a body that large all else is crushed or loose as it was
    strained; a smaller one came off, and is loose.
    """
    label = bodies.component + 1  # 0: none
    whole = bodies.whole
    is_lump = np.bincount(label, mass * whole) >= least
    is_body = np.bincount(label, mass) >= least
    is_lump[0] = is_body[0] = False
    lump = whole * is_lump[label]
    crushed = np.where(is_body[label], bodies.crushed * (1.0 - bodies.opened) + whole * ~is_lump[label], 0.0)
    return np.stack([lump, crushed, np.maximum(1.0 - lump - crushed, 0.0)], axis=1)
