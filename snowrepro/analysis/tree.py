"""Fragments at all break strains at once: a weight for each bond, and a spanning tree that each threshold cuts.

A particle is *core* while it has lost less than a set part of its bonds.  Two cores that an unbroken bond joins are in
one fragment; any other particle hangs on one core that it is still bonded to, and joins nothing.  Let the break strain
e grow: particle i is core from a_i on, the strain at which few enough of its bonds are broken; and it hangs on its
first core j from b_i = min over j of max(d_ij, a_j) on.  So bond ij holds from max(d_ij, a_i, a_j) on, or, if i hangs
on j by it, from b_i on.  As e grows fragments only join, so a tree can describe them.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree


@dataclass(frozen=True)
class HalfBonds:
    """Each bond listed from both its ends, grouped by particle, the most strained bond of each first.

    ``own``, ``other``, ``bond`` (2m,): the particle, its neighbour and the bond's number; ``strain`` (2m,) of it;
    ``first`` (n,): where each particle's bonds begin; ``degree`` (n,): how many it has.
    """

    own: np.ndarray
    other: np.ndarray
    bond: np.ndarray
    strain: np.ndarray
    first: np.ndarray
    degree: np.ndarray


def sort_by_particle(pairs: np.ndarray, strain: np.ndarray, count: int) -> HalfBonds:
    """List the bonds of each of ``count`` particles by strain, from ``pairs`` (m, 2) and their ``strain`` (m,)."""
    by_strain = np.argsort(-strain)
    own = pairs[by_strain].T.ravel()
    other = pairs[by_strain][:, ::-1].T.ravel()
    bond = np.tile(by_strain, 2)
    # by particle; equal ones keep the order of their strain, once the two halves are merged
    rank = np.tile(np.arange(len(by_strain)), 2)
    order = np.argsort(own.astype(np.int64) * max(len(by_strain), 1) + rank)
    own, other, bond = own[order], other[order], bond[order]
    degree = np.bincount(own, minlength=count)
    return HalfBonds(own, other, bond, strain[bond], np.cumsum(degree) - degree, degree)


def find_core_strain(halves: HalfBonds, core_fraction: float) -> np.ndarray:
    """Find the break strain from which on each particle is core, (n,); infinite for one without bonds.

    Core: less than ``core_fraction`` of the bonds are broken, that is strained beyond the break strain.
    """
    may_lose = np.ceil(core_fraction * halves.degree).astype(int) - 1
    result = np.full(len(halves.degree), np.inf)
    bonded = halves.degree > 0
    result[bonded] = halves.strain[(halves.first + may_lose)[bonded]]
    return result


def find_holding_strain(halves: HalfBonds, core: np.ndarray) -> np.ndarray:
    """Find the break strain (m,) from which on each bond holds its two particles in one fragment.

    ``core`` (n,): as ``find_core_strain`` gives it.
    """
    holds = np.maximum(halves.strain, np.maximum(core[halves.own], core[halves.other]))
    weight = np.empty(len(halves.bond) // 2)
    weight[halves.bond] = holds
    if not len(weight):
        return weight
    to_core = np.maximum(halves.strain, core[halves.other])
    earliest = np.full(len(halves.degree), np.inf)
    bonded = halves.degree > 0
    earliest[bonded] = np.minimum.reduceat(to_core, halves.first[bonded])
    candidate = np.flatnonzero(to_core == earliest[halves.own])
    candidate = candidate[np.lexsort((halves.bond[candidate], halves.own[candidate]))]
    _, first = np.unique(halves.own[candidate], return_index=True)  # one bond a particle, the first if several tie
    hanging = candidate[first]
    np.minimum.at(weight, halves.bond[hanging], to_core[hanging])
    return weight


@dataclass(frozen=True)
class Tree:
    """The fragments of ``count`` particles at every break strain: ``edges`` (m, 2) of rising ``weight`` (m,)."""

    edges: np.ndarray
    weight: np.ndarray
    count: int

    def cut(self, break_strain: float) -> np.ndarray:
        """Return the component of each particle (n,) where bonds break beyond ``break_strain``."""
        unbroken = self.edges[: np.searchsorted(self.weight, break_strain, side="right")]
        return find_components(unbroken, self.count)


def grow_tree(pairs: np.ndarray, weight: np.ndarray, count: int) -> Tree:
    """Make the minimum spanning tree, or forest, of bonds ``pairs`` (m, 2) with ``weight`` (m,)."""
    finite = np.isfinite(weight)
    pairs, weight = pairs[finite], weight[finite]
    order = np.argsort(weight)  # which of equal ones comes first does not change a cut
    rank = np.empty(len(order))
    rank[order] = np.arange(1, len(order) + 1)  # ranks: SciPy takes a weight of zero for no edge
    graph = csr_matrix((rank, (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    in_tree = order[np.sort(minimum_spanning_tree(graph).data).astype(int) - 1]
    return Tree(pairs[in_tree], weight[in_tree], count)


def find_components(pairs: np.ndarray, count: int) -> np.ndarray:
    """Number the connected component of each of ``count`` particles that ``pairs`` (m, 2) join; returns (count,)."""
    graph = coo_matrix((np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return connected_components(graph, directed=False)[1]
