"""Pairs of particles that are near each other, counted before they are listed, and how far apart they are."""

import numpy as np
from scipy.spatial import cKDTree

from ..errors import DataError

MOST_PAIRS = 40_000_000


def find_near_pairs(places: np.ndarray, reach: float) -> np.ndarray:
    """Find the pairs (m, 2) of places (n, 2 or 3) at most ``reach`` apart.

    Raises DataError where there are more than MOST_PAIRS: where a body collapsed, or the reach is as large as it.
    """
    tree = cKDTree(places)
    count = len(places)
    if count * (count - 1) // 2 > MOST_PAIRS:
        pairs = (int(tree.count_neighbors(tree, reach)) - count) // 2
        if pairs > MOST_PAIRS:
            raise DataError(
                f"{pairs:,} pairs of particles are nearer than {reach:.4g}, more than the {MOST_PAIRS:,} that are "
                "looked at: is grid_spacing (--grid-spacing) in the unit of the positions?"
            )
    return np.asarray(tree.query_pairs(reach, output_type="ndarray"))


def square_distances(positions: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Return the squared distance (m,) between the two particles of each of ``pairs`` (m, 2) at ``positions``."""
    total = np.zeros(len(pairs))
    for axis in positions.T:
        along = np.ascontiguousarray(axis, dtype=float)
        total += (along.take(pairs[:, 0]) - along.take(pairs[:, 1])) ** 2
    return total
