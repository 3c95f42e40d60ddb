"""How the neighbourhood of each cluster is deformed, and which neighbours have come apart since the release.

The map of a neighbourhood is the matrix F that carries the places at release of a cluster's neighbours, seen from it,
to their places now, by least squares over mass (Falk and Langer 1998).  It knows no direction: a body that is turned,
or whose particles lie otherwise, has the same.  Its determinant is the change of area, or of volume: what was opened
or compacted.  Shear alone changes none, and breaks nothing.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from .clusters import Clusters, measure_lengths
from .near import find_near_pairs, square_distances

FLAT = 0.02  # of neighbours' second moments: their determinant over that of a disc, below which they lie in a line
MOST_ROUNDS = 10  # of parting pairs in one state


@dataclass(frozen=True)
class Neighbours:
    """Pairs of clusters that are near each other at release.

    ``pairs`` (m, 2); ``offset`` (m, d): from the first to the second; ``length`` (m,).  The same from both ends, by
    cluster: ``first`` (k + 1,) counts the neighbours before each, ``other`` (2m,) are they, ``pair`` (2m,) which pair,
    ``seen`` (2m, d) their offset and ``weight`` (2m,) their mass.
    """

    pairs: np.ndarray
    offset: np.ndarray
    length: np.ndarray
    first: np.ndarray
    other: np.ndarray
    pair: np.ndarray
    seen: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True)
class Maps:
    """The map F of the neighbourhood of each cluster, ``matrix`` (k, d, d), and whether it ``is_known`` (k,).

    It is not known where hardly any neighbours are left, or all in one line; it is the identity then.
    """

    matrix: np.ndarray
    is_known: np.ndarray

    @property
    def change_of_volume(self) -> np.ndarray:
        """Volume, or area, of each neighbourhood over that at release (k,)."""
        return np.linalg.det(self.matrix)


def find_neighbours(clusters: Clusters, radius: float) -> Neighbours:
    """Find the pairs of clusters at most ``radius`` apart at release."""
    pairs = find_near_pairs(clusters.position, radius)
    offset = clusters.position[pairs[:, 1]] - clusters.position[pairs[:, 0]]
    own, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    by_cluster = np.argsort(own, kind="stable")
    other = other[by_cluster]
    first = np.concatenate([[0], np.cumsum(np.bincount(own, minlength=len(clusters.mass)))])
    seen = np.concatenate([offset, -offset])[by_cluster]
    pair = np.tile(np.arange(len(pairs)), 2)[by_cluster]
    length = measure_lengths(offset)
    return Neighbours(pairs, offset, length, first, other, pair, seen, clusters.mass[other])


class Partings:
    """Which pairs of neighbours still hold together, ``is_joined`` (m,), state by state; ``extend`` takes one more.

    A pair parts, for good, where it is longer than ``stretch`` times what its neighbourhood's change of shape makes of
    it, without the opening.  So a gap parts what it divides, a swelling body parts everywhere, and flow parts nothing.
    """

    def __init__(self, neighbours: Neighbours, stretch: float) -> None:
        self.neighbours, self.stretch = neighbours, stretch
        self.is_joined = np.ones(len(neighbours.pairs), dtype=bool)

    def extend(self, position: np.ndarray) -> None:
        """Take one more state of the clusters (k, 2 or 3) into account; what has no place (NaN) parts."""
        pairs = self.neighbours.pairs
        length = np.sqrt(square_distances(position, pairs))
        self.is_joined &= ~np.isnan(length)
        limit = self.stretch * self.neighbours.length
        for _ in range(MOST_ROUNDS):  # whatever parts changes the maps of what it belonged to
            long = np.flatnonzero(self.is_joined & (length > limit))
            if not len(long):
                return
            parts = length[long] > self.stretch * self._predict_lengths(long, position)
            if not parts.any():
                return
            self.is_joined[long[parts]] = False

    def _predict_lengths(self, chosen: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Predict the lengths of chosen pairs from the change of shape at either end: the longer one, (chosen,)."""
        maps = find_maps(self.neighbours, self.is_joined, position)
        opening = np.maximum(np.abs(maps.change_of_volume), 1.0) ** (1 / position.shape[1])
        offset = self.neighbours.offset[chosen]
        ends = [
            measure_lengths(np.einsum("mij,mj->mi", maps.matrix[end], offset)) / opening[end]
            for end in self.neighbours.pairs[chosen].T
        ]
        return np.maximum.reduce([*ends, self.neighbours.length[chosen]])


def find_maps(neighbours: Neighbours, is_joined: np.ndarray, position: np.ndarray) -> Maps:
    """Fit the map of each cluster's neighbourhood, over the neighbours that it is still joined to.

    ``is_joined`` (m,): as ``Partings`` has it; ``position`` (k, 2 or 3): of the clusters now.
    """
    count, dimensions = position.shape
    weight = neighbours.weight * is_joined[neighbours.pair]
    places = np.nan_to_num(position)
    both, before = np.empty((2, count, dimensions, dimensions))
    for axis in range(dimensions):
        moment = weight * neighbours.seen[:, axis]
        table = csr_matrix((moment, neighbours.other, neighbours.first), shape=(count, count))
        both[:, :, axis] = table @ places - (table @ np.ones(count))[:, None] * places
        sums = csr_matrix((moment, np.arange(len(moment)), neighbours.first), shape=(count, len(moment)))
        before[:, :, axis] = sums @ neighbours.seen
    size = np.trace(before, axis1=1, axis2=2) / dimensions
    is_known = (size > 0) & (np.linalg.det(before) > FLAT * size**dimensions)
    matrix = np.tile(np.eye(dimensions), (count, 1, 1))
    matrix[is_known] = both[is_known] @ np.linalg.inv(before[is_known])
    return Maps(matrix, is_known)
