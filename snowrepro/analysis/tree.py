"""All break strains at once: one weight a bond, one spanning tree, and every threshold is a cut of it.

A particle is *core* while it has lost less than a set part of its bonds.  Two cores that an unbroken bond joins are
in one fragment; any other particle hangs on one core that it is still bonded to and joins nothing.  For growing
break strain e, particle i is core from a_i on, the strain at which few enough of its bonds are broken; and it hangs
on its first core j from b_i = min over j of max(d_ij, a_j) on.  So bond ij holds from max(d_ij, a_i, a_j) on, or, if
i hangs on j by it, from b_i on.  Fragments only join as e grows, which is what a tree can hold.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree


@dataclass(frozen=True)
class HalfBonds:
    """Each bond seen from both its ends, grouped by particle, the most strained bond of each first.

    ``own``, ``other``, ``bond`` (2m,): the particle, its neighbour and the bond's number; ``strain`` (2m,) of it;
    ``first`` (n,): where each particle's bonds begin; ``degree`` (n,): how many it has.
    """

    own: np.ndarray
    other: np.ndarray
    bond: np.ndarray
    strain: np.ndarray
    first: np.ndarray
    degree: np.ndarray


def half_bonds(pairs: np.ndarray, strain: np.ndarray, count: int) -> HalfBonds:
    """Sort bonds ``pairs`` (m, 2) with ``strain`` (m,) between ``count`` particles by particle and strain."""
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


def core_strain(halves: HalfBonds, core_fraction: float) -> np.ndarray:
    """Break strain from which on each particle is core, (n,); infinite for one without bonds.

    Core: less than ``core_fraction`` of the bonds are broken, that is strained beyond the break strain.
    """
    may_lose = np.ceil(core_fraction * halves.degree).astype(int) - 1
    result = np.full(len(halves.degree), np.inf)
    bonded = halves.degree > 0
    result[bonded] = halves.strain[(halves.first + may_lose)[bonded]]
    return result


def holding_strain(halves: HalfBonds, core: np.ndarray) -> np.ndarray:
    """Break strain from which on each bond, (m,), holds its two particles in one fragment; ``core`` (n,) as above."""
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
    _, chosen = np.unique(halves.own[candidate], return_index=True)  # one bond a particle, the first if several tie
    hanging = candidate[chosen]
    np.minimum.at(weight, halves.bond[hanging], to_core[hanging])
    return weight


@dataclass(frozen=True)
class Tree:
    """Fragments at every break strain: at most n - 1 ``edges``, (m, 2), of rising ``weight``, (m,); n is ``count``."""

    edges: np.ndarray
    weight: np.ndarray
    count: int

    def cut(self, break_strain: float) -> np.ndarray:
        """Component of each particle, (n,), where bonds break beyond ``break_strain``."""
        held = self.edges[: np.searchsorted(self.weight, break_strain, side="right")]
        return components(held, self.count)

    def lumps(self, mass: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray]:
        """Mass in components of at least ``least``, part of all, as a step function of the break strain.

        Returns the strains at which it changes, rising from 0, and the value from each on.
        """
        whole = [*range(self.count)]  # union-find
        weigh = mass.tolist()
        in_lumps = sum(m for m in weigh if m >= least)
        values = [in_lumps]
        for one, other in self.edges.tolist():
            while whole[one] != one:
                whole[one] = one = whole[whole[one]]
            while whole[other] != other:
                whole[other] = other = whole[whole[other]]
            if weigh[one] < weigh[other]:
                one, other = other, one
            in_lumps -= sum(m for m in (weigh[one], weigh[other]) if m >= least)
            whole[other] = one
            weigh[one] += weigh[other]
            in_lumps += weigh[one] if weigh[one] >= least else 0.0
            values.append(in_lumps)
        return np.concatenate([[0.0], self.weight]), np.array(values) / mass.sum()


def grow_tree(pairs: np.ndarray, weight: np.ndarray, count: int) -> Tree:
    """The minimum spanning tree (or forest) of bonds ``pairs`` (m, 2) with ``weight`` (m,)."""
    finite = np.isfinite(weight)
    pairs, weight = pairs[finite], weight[finite]
    order = np.argsort(weight)  # which of equal ones comes first does not change a cut
    rank = np.empty(len(order))
    rank[order] = np.arange(1, len(order) + 1)  # ranks: SciPy takes a weight of zero for no edge
    graph = csr_matrix((rank, (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    kept = np.sort(minimum_spanning_tree(graph).data).astype(int) - 1
    chosen = order[kept]
    return Tree(pairs[chosen], weight[chosen], count)


def components(pairs: np.ndarray, count: int) -> np.ndarray:
    """Connected component of each of ``count`` particles that ``pairs`` (m, 2) join, (n,)."""
    graph = coo_matrix((np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return connected_components(graph, directed=False)[1]
