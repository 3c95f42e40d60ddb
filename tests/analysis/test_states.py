"""Lump, crushed or loose, on bodies of which an honest observer can say what became of them.

The thresholds of conf/analysis/strain.yaml were fixed on these bodies, before any run was judged by them.
"""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snowrepro.analysis.gauge import Gauge
from snowrepro.analysis.layout import Names
from snowrepro.analysis.motion import read_motion
from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.summary.classify import classify
from tests.analysis.bodies import (
    bend,
    break_apart,
    crumble,
    crush_below,
    fall_to_heap,
    fill_box,
    fill_disc,
    fill_layer,
    throw_dust,
    turn,
)

# The same disc, sampled otherwise: particles a cell, and degrees of the lattice or a seed.
SAMPLES = {
    **{f"lattice at {degrees} degrees": fill_disc(degrees=degrees) for degrees in (0, 15, 30, 45)},
    "anywhere": fill_disc(seed=1),
    "9 a cell": fill_disc(9),
    "16 a cell": fill_disc(16, 20),
}
DISC = SAMPLES["lattice at 0 degrees"]


def judge(*states: np.ndarray) -> np.ndarray:
    """The parts of the mass that are lump, crushed and loose after ``states`` of a body with cells of length 1."""
    found = classify_states(*states).last
    shares = np.array([found.lump_fraction, found.crushed_fraction, found.loose_fraction])
    assert shares.sum() == pytest.approx(1, abs=1e-12)
    return shares


def classify_states(*states: np.ndarray):
    """The classification of states of a body with cells of length 1."""
    per_cell = len(states[0]) / (np.pi * 22.0**2)
    cell_mass = per_cell if states[0].shape[1] == 2 else 8.0
    return classify(np.stack(states), release=0, grid_spacing=1.0, cell=1.0, cell_mass=cell_mass)


def assert_near(shares: np.ndarray, lump: float, crushed: float, loose: float, within: float = 0.02) -> None:
    """The three shares are these."""
    np.testing.assert_allclose(shares, [lump, crushed, loose], rtol=0, atol=within)


def test_shares_do_not_hang_on_threads():
    """Of the library of linear algebra, which sums long vectors in parts: a row has the same bits in any process."""
    threads = pytest.importorskip("threadpoolctl").threadpool_limits
    body = SAMPLES["16 a cell"]
    found = classify_states(body, crush_below(body)).last
    shares = []
    for count in (1, 2):
        with threads(count):
            shares.append((found.crushed_fraction, found.loose_fraction))
    assert shares[0] == shares[1]


@pytest.mark.parametrize("sample", SAMPLES)
def test_how_a_body_is_sampled_does_not_matter(sample):
    places = SAMPLES[sample]
    crushed = judge(DISC, crush_below(DISC))
    assert 0.2 < crushed[1] < 0.5
    assert_near(judge(places, crush_below(places)), *crushed)
    assert_near(judge(places, break_apart(places)), 1, 0, 0)
    loose = float((places[:, 0] > 8).mean())
    assert_near(judge(places, *fall_to_heap(places, right_of=8)), 1 - loose, 0, loose)


@pytest.mark.parametrize("kind", ["shrunk evenly", "pressed flat", "swollen"])
def test_a_hair_more_strain_moves_a_hair_of_the_mass(kind):
    grow = {"shrunk evenly": [-1, -1], "pressed flat": [0, -1], "swollen": [1, 1]}[kind]
    places = fill_disc(1, 10)
    shares = [judge(places, places * np.exp(0.025 * step * np.array(grow))) for step in range(23)]
    lumps = np.array(shares)[:, 0]
    assert lumps[0] == 1
    assert lumps[-1] == 0
    assert max(abs(after - before) for before, after in pairwise(lumps)) < 0.18
    assert (np.diff(lumps) <= 1e-9).all()


@given(st.floats(0, 6.3), st.floats(-0.08, 0.08), st.floats(-0.08, 0.08), st.floats(-0.3, 0.3))
@settings(max_examples=8, deadline=None)
def test_whole_snow_is_a_lump_wherever_it_turns(angle, wide, high, shear):
    moved = turn(DISC * np.exp([wide, high]) @ np.array([[1, 0], [shear, 1]]), angle)
    moved += [500.0, -300.0]
    assert_near(judge(DISC, moved), 1, 0, 0, within=1e-9)


@pytest.mark.parametrize("shear", [0.6, 0.8, 1.5])
def test_shear_that_leaves_a_body_whole_breaks_nothing(shear):
    assert_near(judge(DISC, DISC @ np.array([[1, 0], [shear, 1]])), 1, 0, 0)


@pytest.mark.parametrize("height", [0.75, 0.7, 0.5, 0.3])
def test_a_puddle_that_flows_holds_together(height):
    states = [DISC * [1 / h, h] for h in np.linspace(1, height, 8)]
    assert_near(judge(*states), 1, 0, 0)
    assert classify_states(*states).last.lumps == 1


def test_a_rubber_ball_that_is_round_again_is_a_lump():
    assert_near(judge(DISC, DISC * [1.5, 0.6], DISC), 1, 0, 0)
    assert_near(judge(DISC, DISC * [1.1, 0.4], DISC), 1, 0, 0)


def test_a_flattened_ball_is_crushed():
    assert_near(judge(DISC, DISC * [1, 0.5]), 0, 1, 0)
    assert_near(judge(DISC, DISC * [1.3, 0.3]), 0, 1, 0)


@pytest.mark.parametrize("per_cell", [1, 4])
def test_small_jitter_breaks_nothing(per_cell):
    places, rng = fill_disc(per_cell, 10), np.random.default_rng(0)
    jitter = 0.1 * per_cell**-0.5
    assert_near(judge(places, *(places + rng.normal(0, jitter, places.shape) for _ in range(100))), 1, 0, 0)


@pytest.mark.parametrize("per_cell", [4, 16])
@pytest.mark.parametrize("share", [0.01, 0.05])
def test_a_dusty_lump_is_a_lump_and_dust(per_cell, share):
    places = fill_disc(per_cell, 7)
    moved, thrown = throw_dust(places, share)
    assert_near(judge(places, moved), 1 - thrown, 0, thrown)


def test_dust_is_loose_in_the_air_and_on_a_heap():
    rng = np.random.default_rng(2)
    cloud = DISC + rng.normal(0, 30, DISC.shape)
    assert_near(judge(DISC, cloud), 0, 0, 1)
    assert_near(judge(DISC, cloud, rng.permutation(DISC)), 0, 0, 1)


@pytest.mark.parametrize(("size", "lump"), [(2.0, (0, 0.02)), (3.0, (0, 0.02)), (6.0, (0.8, 1)), (8.0, (0.95, 1))])
def test_crumbs_are_loose_and_pieces_are_lumps(size, lump):
    shares = judge(DISC, crumble(DISC, size))
    assert lump[0] <= shares[0] <= lump[1]
    assert shares[1] < 0.02


def test_pieces_are_counted_and_those_that_touch_again_stay_apart():
    assert classify_states(DISC, break_apart(DISC, 9)).last.lumps == 9
    left = DISC[:, :1] < 0
    apart = np.where(left, DISC - [10.0, 0.0], DISC)
    assert classify_states(DISC, apart, DISC).last.lumps == 2
    assert classify_states(DISC, np.where(left, DISC - [0.3, 0.0], DISC)).last.lumps == 1


def test_what_slides_along_a_cut_is_whole():
    for slip in (1.0, 4.0):
        assert_near(judge(DISC, np.where(DISC[:, :1] < 0, DISC - [0.0, slip], DISC)), 1, 0, 0)


def test_where_nothing_came_apart_nothing_is_loose():
    """Not even by round-off: what is said of loose snow is that there is none."""
    flat = DISC * [1, 0.65] + [0, 30]
    assert classify_states(DISC, flat).last.loose_fraction == 0.0


def test_a_draped_layer_is_whole_unless_it_is_bent_sharply():
    layer = fill_layer()
    assert_near(judge(layer, bend(layer, 20)), 1, 0, 0)
    sharp = judge(layer, bend(layer, 6))
    assert 0.5 < sharp[0] < 0.9
    assert sharp[1] > 0.1  # inside of the bend
    assert sharp[2] > 0.05  # and outside


def test_boxes_in_three_dimensions():
    box, rng = fill_box(), np.random.default_rng(3)
    assert_near(judge(box, box[:, [1, 2, 0]] + 50), 1, 0, 0, within=1e-9)
    assert_near(judge(box, box * [1, 1, 0.3]), 0, 1, 0)
    assert_near(judge(box, box + rng.normal(0, 10, box.shape)), 0, 0, 1)
    cut = box + np.where(box[:, :1] > 0, [4.0, 0.0, 0.0], 0.0)
    assert classify_states(box, cut).last.lumps == 2
    assert_near(judge(box, cut), 1, 0, 0)


def test_snow_that_still_crumbles_has_not_settled():
    right_to_left = np.argsort(-DISC[:, 0])
    states, places = [DISC], DISC.copy()
    rng = np.random.default_rng(4)
    for step in range(5):  # 0.4 % of the mass every 20 frames
        gone = right_to_left[int(0.004 * step * len(DISC)) : int(0.004 * (step + 1) * len(DISC))]
        places = places.copy()
        places[gone] += rng.normal([40.0, 0.0], 10, (len(gone), 2))
        states.append(places)
    frames = np.stack([state for state in states for _ in range(20)])
    crumbling = classify(frames, release=0, grid_spacing=1.0, cell=1.0, cell_mass=4.0)
    assert not crumbling.settled
    at_rest = classify(
        np.concatenate([frames, frames[-1:].repeat(25, axis=0)]), release=0, grid_spacing=1.0, cell_mass=4.0
    )
    assert at_rest.settled
    assert 0.01 < at_rest.last.loose_fraction < 0.03


def test_bonds_hang_on_the_lattice_and_call_a_flat_body_powder():
    """Which is why strain is the measure of what is seen: crushed to 0.65 of its height, lattice along and across."""
    shares = []
    for sample in ("lattice at 0 degrees", "lattice at 45 degrees"):
        places = SAMPLES[sample]
        flat = np.stack([places, places * [1, 0.65]])
        by_bonds = classify(
            flat, compose(["analysis=bonds"]).question.analysis, release=0, grid_spacing=1.0, cell=1.0, cell_mass=4.0
        )
        shares.append((by_bonds.lump_fraction, judge(places, flat[1])[0]))
    (along, strained), (across, strained_too) = shares
    assert across - along > 10 * 0.02  # ten times what strain may differ by
    assert strained == pytest.approx(strained_too, abs=0.02)


@pytest.mark.parametrize("wrong", [{"volume_change": (0.5, 0.2)}, {"volume_change": (-0.1, 0.2)}, {"join_reach": 3.0}])
def test_thresholds_that_cannot_be_are_refused(wrong):
    with pytest.raises(ConfigError, match=r"volume_change must be|join_reach .* must not exceed"):
        classify(np.stack([DISC, DISC]), release=0, grid_spacing=1.0, **wrong)


@pytest.mark.parametrize("sample", SAMPLES)
@pytest.mark.parametrize(("change", "strain"), [([0, -0.4], 0.4), ([0.1, -0.3], 0.3), ([0.2, 0.1], 0.2), ([0, 0], 0.0)])
def test_the_strain_at_the_gauge_is_that_of_the_body(sample, change, strain):
    """However it is sampled, and wherever it was moved and turned."""
    places = SAMPLES[sample]
    moved = turn(places * np.exp(change), 2.0) + np.array([90.0, 0.0])
    assert classify_states(places, moved).strain == pytest.approx(strain, abs=1e-6)


def test_a_crack_strains_what_it_runs_through():
    """As far as the gauge reaches, whether its sides have parted or not; a wider one strains it more."""
    strains = [classify_states(DISC, np.where(DISC[:, :1] < 0, DISC - [gap, 0.0], DISC)).strain for gap in (0.3, 3, 6)]
    assert 0 < strains[0] < strains[1] < strains[2]


def test_what_vanishes_moves_nothing_that_stays():
    """However heavy it was, and however the body has turned: neighbourhoods are as they were, and hold together."""
    rng = np.random.default_rng(6)
    vanishing = rng.random(len(DISC)) < 0.3
    mass = np.where(vanishing, 50.0, 1.0)
    states = np.stack([turn(DISC, angle) for angle in (0.0, 1.0, 2.0, 3.0)])
    states[2:, vanishing] = np.nan
    motion = read_motion(states, names=Names(particle_id="none"), mass=mass, release=0, grid_spacing=1.0, cell=1.0)
    gauge = Gauge(motion, compose().question.analysis)
    *_, (_, centre) = gauge.follow(3)
    maps = gauge.judge_clusters(centre)[1]
    is_there = np.isfinite(centre).all(axis=1)
    assert gauge.neighbours.pairs.size and gauge.partings.is_joined[is_there[gauge.neighbours.pairs].all(axis=1)].all()
    known = maps.is_known & is_there
    assert known.mean() > 0.9
    np.testing.assert_allclose(maps.matrix[known], np.broadcast_to(turn(np.eye(2), 3.0).T, maps.matrix[known].shape))
    found = classify(states, release=0, mass=mass, grid_spacing=1.0, cell=1.0, particle_id="none").last
    assert found.lump_fraction == pytest.approx(1 - found.vanished, abs=1e-9)
