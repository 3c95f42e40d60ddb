"""The rules that bonds are compared with: exact against other libraries, and shown where they fail."""

import freud
import numpy as np
import pytest
from sklearn.cluster import DBSCAN

from tests.analysis.pictures import ball, classified
from tests.analysis.test_tree import partition


def settled_powder(x: np.ndarray) -> np.ndarray:
    """The particles in any order in a heap of 60 % of the first density, as a slab on the ground."""
    rng = np.random.default_rng(5)
    area = len(x) / 4 / 0.6
    return rng.uniform([0.0, 0.0], [area / 20, 20.0], x.shape)


def test_settled_powder_is_powder_by_bonds_and_a_lump_by_proximity_and_grid():
    """The case that distance cannot decide; damage fails where powder was crushed, not here."""
    x = ball()
    heap = settled_powder(x)
    assert classified(x, heap).lump_fraction == 0.0
    assert classified(x, heap, definition="damage").lump_fraction == 0.0
    assert classified(x, heap, definition="proximity").lump_fraction > 0.95
    assert classified(x, heap, definition="grid").lump_fraction > 0.95


def test_lumps_that_touch_are_two_by_bonds_and_one_by_proximity_grid_and_damage():
    """Halves that parted and met again, hardly harmed."""
    x = ball()
    halves = x + np.where(x[:, :1] > 0, 10.0, 0.0) * [1.0, 0.0]
    states = (x, halves, x + np.where(x[:, :1] > 0, 0.2, 0.0) * [1.0, 0.0])
    assert classified(*states).last.lumps == 2
    for definition in ("proximity", "grid", "damage"):
        assert classified(*states, definition=definition).last.lumps == 1


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("spread", [1.5, 3.0, 6.0])
def test_proximity_is_the_partition_of_freud_and_scikit_learn(seed, spread):
    """Loose particles at three densities about the percolation threshold: the same sets, exactly."""
    x = ball("preview", seed=seed)
    rng = np.random.default_rng(seed)
    y = rng.uniform(-20 * spread, 20 * spread, x.shape)
    distance = 2.0  # a grid spacing at this fidelity
    found = partition(classified(x, y, fidelity="preview", definition="proximity").last.label)
    box = freud.box.Box.square(1000.0)
    cluster = freud.cluster.Cluster()
    flat = np.column_stack([y, np.zeros(len(y))])
    cluster.compute((box, flat), neighbors={"r_max": distance})
    assert found == partition(cluster.cluster_idx)
    assert found == partition(DBSCAN(eps=distance, min_samples=1).fit_predict(y))
    assert len(found) > 1


def test_grid_joins_cells_that_touch():
    """Over edges and corners, not over a gap of a cell; in any number of dimensions."""
    x = ball("preview")
    y = np.full(x.shape, 1.0) + [2.0, 0.0] * (np.arange(len(x)) % 2)[:, None]  # two cells side by side
    assert len(classified(x, y, fidelity="preview", definition="grid").last.mass) == 1
    y = np.full(x.shape, 1.0) + [2.0, 2.0] * (np.arange(len(x)) % 2)[:, None]  # over a corner
    assert len(classified(x, y, fidelity="preview", definition="grid").last.mass) == 1
    y = np.full(x.shape, 1.0) + [4.0, 0.0] * (np.arange(len(x)) % 2)[:, None]  # an empty cell between
    assert classified(x, y, fidelity="preview", definition="grid").last.mass.tolist() == [
        -(-len(x) // 2),
        len(x) // 2,
    ]


def test_damage_isolates_particles():
    """The crushed lower half is powder by damage, although it is still dense."""
    x = ball()
    low = x[:, 1] < 0
    y = x.copy()
    y[low] = np.random.default_rng(1).permutation(x[low])
    found = classified(x, y, definition="damage")
    assert found.lump_fraction == pytest.approx(0.5, abs=0.02)
    assert classified(x, y, definition="proximity").lump_fraction == 1.0
