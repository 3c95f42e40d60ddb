"""Ten built pictures that were made after the thresholds of conf/analysis/strain.yaml were fixed: how do they fare?

All ten were chosen, and what is seen in each was written down, before any of them was measured; none was left out.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from snowrepro.summary.classify import classify
from tests.analysis.bodies import fill_box, fill_disc, fill_layer, turn

DISC = fill_disc()


@dataclass(frozen=True)
class Picture:
    """A motion, and what an ordinary observer says of its last state.

    ``states``: places of the particles, at release first; ``seen``: parts of the mass that are lump, crushed and loose;
    ``bodies``: how many lumps are seen, None where an observer cannot say.
    """

    states: Callable[[], tuple[np.ndarray, ...]]
    seen: tuple[float, float, float]
    bodies: int | None


def bite_off() -> tuple[np.ndarray, ...]:
    """A ball, out of which a bite was broken that rolled away."""
    is_bite = np.hypot(DISC[:, 0] - 22, DISC[:, 1]) < 10
    rolled = turn(DISC[is_bite] - [18.0, 0.0], 2.0) + np.array([45.0, -14.0])
    bitten = DISC.copy()
    bitten[is_bite] = rolled
    return DISC, bitten


def open_ring() -> tuple[np.ndarray, ...]:
    """A ring, cut at one place, that is bent open to a C of three quarters of a circle, in ten steps."""
    ring = DISC[np.hypot(*DISC.T) > 14]
    radius, angle = np.hypot(*ring.T), np.arctan2(ring[:, 1], ring[:, 0])
    states = []
    for middle in np.linspace(18, 24, 11):
        now, at = middle + radius - 18, angle * 18 / middle
        states.append(np.stack([now * np.cos(at), now * np.sin(at)], axis=1))
    return tuple(states)


def crack_with_dust() -> tuple[np.ndarray, ...]:
    """A ball that a wavy crack opens by six cells; the 2 % of the snow nearest to it lie as dust in the gap."""
    above = DISC[:, 1] - 2.5 * np.sin(DISC[:, 0] / 4)
    opened = DISC + np.where(above[:, None] > 0, [0.0, 3.0], [0.0, -3.0])
    is_dust = np.abs(above) < np.quantile(np.abs(above), 0.02)
    rng = np.random.default_rng(11)
    x, across = rng.uniform(-21, 21, is_dust.sum()), rng.uniform(-2.5, 2.5, is_dust.sum())
    opened[is_dust] = np.stack([x, across + 2.5 * np.sin(x / 4)], axis=1)
    return DISC, opened


def slide_slabs() -> tuple[np.ndarray, ...]:
    """Three slabs on each other, cut out of one block, that slide: each by eight cells more than that below."""
    block = fill_layer(40, 18)
    slab = np.floor((block[:, 1:] + 9) / 6)
    return tuple(block + slab * [slip, 0.0] for slip in np.linspace(0, 8, 9))


def press_half() -> tuple[np.ndarray, ...]:
    """A ball of which the left half is pressed against a wall to 0.45 of its depth; the right half stays round."""
    return DISC, np.where(DISC[:, :1] < 0, DISC * [0.45, 1.0], DISC)


def heap_rubble() -> tuple[np.ndarray, ...]:
    """A ball in squares of three cells, each whole and turned, that lie on each other as a cone."""
    square = np.unique(np.floor(DISC / 3), axis=0, return_inverse=True)[1].ravel()
    rng = np.random.default_rng(12)
    slots = [(4.3 * (place - row / 2), -4.3 * row) for row in range(30) for place in range(row + 1)]
    order = rng.permutation(square.max() + 1)
    heap = np.empty_like(DISC)
    for number in range(square.max() + 1):
        mine = square == number
        heap[mine] = turn(DISC[mine] - DISC[mine].mean(axis=0), rng.uniform(-3, 3)) + slots[order[number]]
    return DISC, heap


def pile_up_powder() -> tuple[np.ndarray, ...]:
    """A ball that flies apart to a cloud and then lies as a heap, as dense as before, in about its old order."""
    rng = np.random.default_rng(13)
    cloud = 2.5 * DISC + rng.normal(0, 3, DISC.shape)
    line = np.arange(-60, 60, 0.5) + 0.25
    places = np.stack(np.meshgrid(line, line + 60), axis=-1).reshape(-1, 2)
    height = places[:, 1] + 0.6 * np.abs(places[:, 0])  # of the cone on which a place lies
    places = places[np.argsort(height, kind="stable")[: len(DISC)]]
    heap = np.empty_like(DISC)
    rows = np.lexsort(places.T)  # from below, each row from the left
    by_height = np.argsort(cloud[:, 1])
    for row in np.split(np.arange(len(rows)), np.flatnonzero(np.diff(places[rows, 1])) + 1):
        mine = by_height[row]
        heap[mine[np.argsort(cloud[mine, 0])]] = places[rows[row]]
    return DISC, cloud, heap


def swell() -> tuple[np.ndarray, ...]:
    """A ball that swells evenly, until it is 15 % wider and higher."""
    return tuple(DISC * size for size in (1.0, 1.05, 1.1, 1.15))


def neck() -> tuple[np.ndarray, ...]:
    """A bar that is drawn out until its middle is half as wide, at the same area everywhere; it does not part."""
    bar = fill_layer(60, 12)
    states = []
    for part in np.linspace(0, 0.5, 6):
        line = np.linspace(-30, 30, 6001)
        width = 1 - part * np.exp(-((line / 8) ** 2))
        along = np.concatenate([[0], np.cumsum((0.5 / width[1:] + 0.5 / width[:-1]) * np.diff(line))])
        x = np.interp(bar[:, 0], line, along - along[3000])
        states.append(np.stack([x, bar[:, 1] * np.interp(bar[:, 0], line, width)], axis=1))
    return tuple(states)


def break_octant() -> tuple[np.ndarray, ...]:
    """A box in three dimensions, of which one of the eight corners has broken off and lies beside it, turned."""
    box = fill_box()
    is_corner = (box > 0).all(axis=1)
    broken = box.copy()
    broken[is_corner, :2] = turn(box[is_corner, :2] - 3, 0.7) + np.array([12.0, 3.0])
    return box, broken


PICTURES = {
    "bite": Picture(bite_off, (1, 0, 0), 2),
    "ring to C": Picture(open_ring, (1, 0, 0), 1),
    "wavy crack and dust": Picture(crack_with_dust, (0.98, 0, 0.02), 2),
    "slabs that slide": Picture(slide_slabs, (1, 0, 0), None),
    "half against a wall": Picture(press_half, (0.5, 0.5, 0), 1),
    "cone of rubble": Picture(heap_rubble, (0, 0, 1), 0),
    "powder piled up": Picture(pile_up_powder, (0, 0, 1), 0),
    "swollen by 15 %": Picture(swell, (1, 0, 0), 1),
    "neck": Picture(neck, (1, 0, 0), 1),
    "octant of a box": Picture(break_octant, (1, 0, 0), 2),
}
EYE = 0.03  # of the mass: what an observer cannot tell
# Where the measure says something else, for a known reason: what it says, and of how many lumps.
DISAGREEMENTS = {
    # Three times two squares that had been neighbours lie side by side again, as the shuffle has it, and count as
    # joined still: two states alone do not say that they were apart.
    "cone of rubble": ((0.035, 0, 0.965), 3),
    # 15 % in width are 32 % in area, and snow begins to count as loose at 22 %.  A body that grows as a whole looks as
    # it did; the measure goes by what became of each bit of snow.
    "swollen by 15 %": ((0.735, 0, 0.265), 1),
}


def measure(name: str) -> tuple[np.ndarray, int]:
    """Measure the last state of a picture: parts of the mass that are lump, crushed and loose, and how many lumps."""
    states = np.stack(PICTURES[name].states())
    cell_mass = 4.0 if states.shape[2] == 2 else 8.0
    found = classify(states, release=0, grid_spacing=1.0, cell=1.0, cell_mass=cell_mass).last
    return np.array(list(found.shares.values())), found.lumps


@pytest.mark.parametrize("name", [name for name in PICTURES if name not in DISAGREEMENTS])
def test_what_is_measured_is_seen(name):
    shares, lumps = measure(name)
    np.testing.assert_allclose(shares, PICTURES[name].seen, rtol=0, atol=EYE)
    assert PICTURES[name].bodies in {None, lumps}


@pytest.mark.parametrize("name", DISAGREEMENTS)
def test_known_disagreements_of_measure_and_observer(name):
    expected, expected_lumps = DISAGREEMENTS[name]
    shares, lumps = measure(name)
    np.testing.assert_allclose(shares, expected, rtol=0, atol=0.001)
    assert np.abs(shares - PICTURES[name].seen).max() > EYE
    assert lumps == expected_lumps
