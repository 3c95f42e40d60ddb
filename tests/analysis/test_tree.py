"""The spanning tree against fragments worked out one threshold at a time, by the definition alone."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from snowrepro.analysis.tree import find_core_strain, find_holding_strain, grow_tree, sort_by_particle


def direct(pairs, strain, count, core_fraction, break_strain) -> list[frozenset[int]]:
    """The partition by the definition, in plain Python: cores, the bonds between them, and one bond for the others."""
    bonds = [[] for _ in range(count)]
    for (i, j), d in zip(pairs.tolist(), strain.tolist(), strict=True):
        bonds[i].append((j, d))
        bonds[j].append((i, d))

    def is_core(i: int, e: float) -> bool:
        return bool(bonds[i]) and sum(d > e for _, d in bonds[i]) < core_fraction * len(bonds[i])

    group = list(range(count))

    def find(i: int) -> int:
        while group[i] != i:
            i = group[i]
        return i

    for i in range(count):
        held = [(j, d) for j, d in bonds[i] if d <= break_strain]
        if is_core(i, break_strain):
            for j, _ in held:
                if is_core(j, break_strain):
                    group[find(i)] = find(j)
        else:
            # the core that it hung on first, as bonds that break ever later are taken away
            since = {}
            for j, d in held:
                if is_core(j, break_strain):
                    steps = sorted({d, *(x for _, x in bonds[j])})
                    since[j] = next(e for e in steps if e >= d and is_core(j, e))
            if since:
                group[find(i)] = find(min(since, key=lambda j: (since[j], j)))
    found: dict[int, set[int]] = {}
    for i in range(count):
        found.setdefault(find(i), set()).add(i)
    return sorted(map(frozenset, found.values()), key=min)


def partition(label: np.ndarray) -> list[frozenset[int]]:
    groups: dict[int, set[int]] = {}
    for i, name in enumerate(label.tolist()):
        groups.setdefault(name, set()).add(i)
    return sorted(map(frozenset, groups.values()), key=min)


@pytest.mark.parametrize("seed", range(20))
def test_a_cut_of_the_tree_is_the_direct_answer(seed):
    """Random bodies, strains and core rules, 50 random thresholds each: 1,000 partitions, all the same."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(20, 80))
    places = rng.uniform(0, 1, (count, 2))
    triangles = Delaunay(places).simplices
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    pairs = np.unique(np.sort(edges, axis=1), axis=0)
    pairs = pairs[rng.uniform(size=len(pairs)) < 0.9]
    strain = rng.gamma(0.7, 0.3, len(pairs))
    core_fraction = float(rng.choice([0.2, 0.25, 0.3333, 0.5, 0.75, 1.0]))
    halves = sort_by_particle(pairs, strain, count)
    tree = grow_tree(pairs, find_holding_strain(halves, find_core_strain(halves, core_fraction)), count)
    sizes = set()
    for threshold in [*rng.gamma(0.7, 0.3, 45), *rng.choice(strain, 5)]:  # also exactly at a bond's strain
        expected = direct(pairs, strain, count, core_fraction, threshold)
        assert partition(tree.cut(threshold)) == expected
        sizes.add(len(expected))
    assert len(sizes) > 5


def test_no_bonds_no_fragments():
    """Particles without bonds are each alone, at any threshold."""
    halves = sort_by_particle(np.zeros((0, 2), dtype=int), np.zeros(0), 3)
    tree = grow_tree(np.zeros((0, 2), dtype=int), find_holding_strain(halves, find_core_strain(halves, 0.5)), 3)
    assert len(set(tree.cut(10.0).tolist())) == 3
