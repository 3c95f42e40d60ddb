"""How the neighbourhood of each cluster is deformed, and which neighbours have come apart since the release.

The map of a neighbourhood is the matrix F that carries the places at release of a cluster's neighbours, seen from it,
to their places now, by least squares over mass (Falk and Langer 1998).  It knows no direction: a body that is turned,
or whose particles lie otherwise, has the same.  Its determinant is the change of area, or of volume: what was opened
or compacted.  Shear alone changes none, and breaks nothing.
"""

from dataclasses import dataclass, replace

import numpy as np

from .clusters import Clusters, measure_lengths
from .near import find_near_pairs, square_distances

FLAT = 0.02  # of neighbours' second moments: their determinant over that of a disc, below which they lie in a line
LEAST_STRETCH = 1e-3  # less counts as this: a neighbourhood pressed into a line has a strain, too
MOST_ROUNDS = 10  # of parting pairs in one state
AT_ONCE = 10_000  # clusters, to be spare with memory


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

    def list_joined(self, chosen: np.ndarray, is_joined: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """List the neighbours that chosen clusters (c,) are still joined to (``is_joined``, (m,)), cluster by cluster.

        Returns the row in ``chosen`` of each, and where it is in ``other``, both (j,).
        """
        count = (self.first[1:] - self.first[:-1])[chosen]
        start = self.first[chosen] - (np.cumsum(count) - count)
        row = np.repeat(np.arange(len(chosen)), count)
        entry = np.arange(len(row)) + start[row]
        is_wanted = is_joined[self.pair[entry]]
        return row[is_wanted], entry[is_wanted]

    def see_from(self, position: np.ndarray) -> "Neighbours":
        """Return the same pairs where the clusters are at ``position`` (k, d) at release."""
        offset = position[self.pairs[:, 1]] - position[self.pairs[:, 0]]
        own = np.repeat(np.arange(len(position)), np.diff(self.first))
        seen = position[self.other] - position[own]
        return replace(self, offset=offset, length=measure_lengths(offset), seen=seen)


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

    @property
    def strain(self) -> np.ndarray:
        """Largest strain of each neighbourhood in any direction, |ln| of its stretch (k,)."""
        stretches = np.linalg.svd(self.matrix, compute_uv=False)
        return np.abs(np.log(np.maximum(stretches, LEAST_STRETCH))).max(axis=1)


def find_neighbours(clusters: Clusters, radius: float) -> Neighbours:
    """Find the pairs of clusters at most ``radius`` apart at release."""
    pairs = find_near_pairs(clusters.position, radius)
    offset = clusters.position[pairs[:, 1]] - clusters.position[pairs[:, 0]]
    own, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    by_cluster = np.sort(own * len(own) + np.arange(len(own))) % len(own)  # a stable argsort, several times as fast
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
        pairs = self.neighbours.pairs[chosen]
        own, ends_of = np.unique(pairs, return_inverse=True)
        maps = find_maps(self.neighbours, self.is_joined, position, own)
        opening = np.maximum(np.abs(maps.change_of_volume), 1.0) ** (1 / position.shape[1])
        offset = self.neighbours.offset[chosen]
        ends = [
            measure_lengths(np.einsum("mij,mj->mi", maps.matrix[end], offset)) / opening[end]
            for end in ends_of.reshape(pairs.shape).T
        ]
        return np.maximum.reduce([*ends, self.neighbours.length[chosen]])


def find_maps(
    neighbours: Neighbours, is_joined: np.ndarray, position: np.ndarray, chosen: np.ndarray | None = None
) -> Maps:
    """Fit the map of each cluster's neighbourhood, or of the ``chosen`` ones (c,), over what it is still joined to.

    ``is_joined`` (m,): as ``Partings`` has it; ``position`` (k, 2 or 3): of the clusters now.
    """
    own, places = np.arange(len(position)) if chosen is None else chosen, np.nan_to_num(position)
    parts = [
        _fit_maps(neighbours, is_joined, places, own[first : first + AT_ONCE]) for first in range(0, len(own), AT_ONCE)
    ]
    return Maps(np.concatenate([part.matrix for part in parts]), np.concatenate([part.is_known for part in parts]))


def _fit_maps(neighbours: Neighbours, is_joined: np.ndarray, places: np.ndarray, own: np.ndarray) -> Maps:
    """Fit the maps of the neighbourhoods of clusters ``own`` (c,); ``places`` (k, 2 or 3): of all clusters."""
    row, entry = neighbours.list_joined(own, is_joined)
    seen, weight = neighbours.seen.take(entry, axis=0), neighbours.weight[entry]
    arrived = places.take(neighbours.other[entry], axis=0)

    def add(values: np.ndarray) -> np.ndarray:
        """Add values of the neighbours (j,) up by cluster (c,)."""
        return np.bincount(row, values, len(own))

    dimensions = places.shape[1]
    both, before = np.empty((2, len(own), dimensions, dimensions))
    for axis in range(dimensions):
        moment = weight * seen[:, axis]
        total = add(moment)
        for other in range(dimensions):
            both[:, other, axis] = add(moment * arrived[:, other]) - total * places[own, other]
            before[:, other, axis] = add(moment * seen[:, other])
    size = np.trace(before, axis1=1, axis2=2) / dimensions
    is_known = (size > 0) & (np.linalg.det(before) > FLAT * size**dimensions)
    matrix = np.tile(np.eye(dimensions), (len(own), 1, 1))
    matrix[is_known] = both[is_known] @ np.linalg.inv(before[is_known])
    return Maps(matrix, is_known)
