"""Whether the snow has come to rest, from its kinetic energy and from where its clusters were in each frame."""

from collections.abc import Sequence

import numpy as np

from ..settings.loading import Rest
from .clusters import Clusters, measure_lengths
from .near import find_near_pairs, square_distances

NEAR = 2.0  # widths of a cluster at release: how far neighbours are apart at most
APART = 1.5  # times their distance at release: farther apart they are no longer neighbours


def is_at_rest(
    energies: Sequence[float], track: Sequence[np.ndarray], clusters: Clusters, rest: Rest, frames: int, cell: float
) -> bool:
    """Whether the snow has been at rest for ``frames`` frames up to the last one.

    ``energies`` (t,): kinetic, and ``track``: places of the ``clusters`` (k, 2), of each frame since the release;
    ``cell``: of the paper's grid in the unit of the places.  At rest: in each of the frames the energy is below a part
    of its largest one so far, and from the first of them to the last hardly any cluster moves, and hardly any
    neighbours change their distance.  So falling snow is not, nor is rubble that rolls or a body that slowly sinks.
    """
    if len(track) <= frames or not max(energies[-frames:]) < rest.energy * max(energies):
        return False
    before, now = track[-1 - frames].astype(float), track[-1].astype(float)
    if np.mean(measure_lengths(now - before) > rest.distance * cell) > rest.part:
        return False
    pairs = find_near_pairs(clusters.position, NEAR * clusters.size)
    start, earlier, later = (np.sqrt(square_distances(places, pairs)) for places in (clusters.position, before, now))
    is_near = earlier < APART * start
    changes = is_near & (np.abs(later - earlier) > rest.strain * start)
    return bool(changes.sum() <= rest.part * is_near.sum())
