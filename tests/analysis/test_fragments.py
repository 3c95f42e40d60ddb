"""Lumps and powder against built truth."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snowrepro.analysis.bonds import Extremes, lay_bonds
from snowrepro.composition.compose import compose
from snowrepro.scene.build import sample
from snowrepro.summary.classify import classify
from tests.analysis.pictures import ball, classified

FIDELITIES = ("preview", "paper")


@settings(deadline=None, max_examples=15)
@given(st.floats(-np.pi, np.pi), st.floats(-50, 50), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_rigid_motion_and_small_strain_break_nothing(angle, shift, a, b, c):
    """Moved, turned and strained by up to a tenth in any direction, the ball is one fragment."""
    x = ball("preview")
    Q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    found = classified(x, x @ (Q @ np.array([[1 + a, b], [b, 1 + c]])).T + shift, fidelity="preview")
    assert len(found.last.mass) == 1
    assert found.lump_fraction == 1.0
    assert not found.broken.to_numpy().any()


@pytest.mark.parametrize("fidelity", FIDELITIES)
@pytest.mark.parametrize(("height", "low", "high"), [(0.75, 0.97, 1.0), (0.5, 0.0, 0.1), (0.25, 0.0, 0.02)])
def test_evenly_crushed(fidelity, height, low, high):
    """Crushed to three quarters of its height the ball is a lump, to half of it powder, at every fidelity."""
    x = ball(fidelity)
    assert low <= classified(x, x * [1, height], fidelity=fidelity).lump_fraction <= high


@pytest.mark.parametrize("by", ["stretch", "crush"])
def test_signs_are_kept_apart(by):
    """Pulled to twice its width the ball breaks by stretch alone, crushed to half of it by crushing alone."""
    x = ball("preview")
    moved = x * ([2.0, 1.0] if by == "stretch" else [0.5, 1.0])
    other = "crush" if by == "stretch" else "stretch"
    found = classified(x, moved, fidelity="preview", break_by=by)
    assert found.lump_fraction < 0.05
    assert found.broken[by].iloc[-1] == found.broken["both"].iloc[-1] > 0.4
    assert found.broken[other].iloc[-1] == 0.0
    assert classified(x, moved, fidelity="preview", break_by=other).lump_fraction == 1.0


def test_broken_bonds_are_those_strained_beyond_the_limit():
    """Counted by squared lengths as by the log strains, for each sign; bonds lie in all directions."""
    x = ball("preview")
    extremes = Extremes(lay_bonds(x, 3.0))
    extremes.extend(x * [1.4, 0.7])
    history = extremes.to_history()
    for limit in (0.1, 0.2, 0.3):
        for sign, part in extremes.measure_broken(limit).items():
            assert 0 < part < 1
            assert part == (history.strain(sign) > limit).mean(), (sign, limit)


@pytest.mark.parametrize("fidelity", FIDELITIES)
@pytest.mark.parametrize("cuts", [[0.0], [-8.0, 8.0], [-15.0, -5.0, 2.0, 12.0]])
def test_known_cuts_give_known_pieces(fidelity, cuts):
    """Cut into strips that move apart: the exact pieces and masses; under the core rule to a particle in a hundred."""
    x = ball(fidelity)
    strip = np.digitize(x[:, 0], cuts)
    moved = x + strip[:, None] * [20.0, 0.0]
    expected = np.sort(np.bincount(strip))[::-1]
    np.testing.assert_array_equal(classified(x, moved, fidelity=fidelity, core_fraction=1.0).last.mass, expected)
    found = classified(x, moved, fidelity=fidelity)
    assert found.last.lumps == len(expected)
    np.testing.assert_allclose(found.last.mass[: len(expected)] / len(x), expected / len(x), atol=0.01)


def test_lumps_that_touch_again_stay_two():
    """A bond that broke stays broken when its ends meet again."""
    x = ball()
    halves = x + np.where(x[:, :1] > 0, 10.0, 0.0) * [1.0, 0.0]
    assert classified(x, halves, x).last.lumps == 2
    assert len(classified(x, x).last.mass) == 1


def test_shuffled_snow_is_powder():
    """Particles that swapped places share no bonds, though the picture is the same."""
    x = ball()
    assert classified(x, np.random.default_rng(0).permutation(x)).lump_fraction == 0.0


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_mixtures_are_recovered(share, seed):
    """A lump of known mass above loose powder: its fraction to 0.01."""
    x = ball(seed=seed)
    powder = np.argsort(x[:, 1])[: round((1 - share) * len(x))]
    moved = x.copy()
    moved[powder] = np.random.default_rng(seed).uniform(-25, 25, (len(powder), 2)) * [3, 0.3] - [0, 60]
    assert classified(x, moved).lump_fraction == pytest.approx(share, abs=0.01)


@pytest.mark.parametrize("seed", range(3))
def test_a_bridge_of_damaged_particles_joins_nothing(seed):
    """Halves pulled apart, the bridge between them stretched to 1.7: steep bonds in it survive.

    Without the core rule they make one lump of the halves, with it there are two.
    """
    x = ball(seed=seed)
    bridge = np.abs(x[:, 1]) < 5
    apart = np.where(x[:, 0] > 0, 12.0, 0.0)
    moved = x + 0.7 * np.where(bridge, np.clip(x[:, 0] + 6, 0, 12), apart)[:, None] * [1.0, 0.0]
    assert classified(x, moved, core_fraction=1.0).last.lumps == 1
    found = classified(x, moved).last
    assert found.lumps == 2
    np.testing.assert_allclose(found.mass[:2] / len(x), 0.475, atol=0.01)


def test_particle_order_does_not_matter():
    """The same run with its particles in another order has the same fragments."""
    x = ball()
    y = x * [1.0, 0.62] + 0.3 * np.sin(x[:, ::-1])
    order = np.random.default_rng(3).permutation(len(x))
    one, other = classified(x, y), classified(x[order], y[order])
    np.testing.assert_array_equal(one.last.mass, other.last.mass)
    assert len(one.last.mass) > 10
    assert one.last.broken == other.last.broken


def test_four_times_the_particles_give_the_same_curve():
    """The same picture, a corner cut off and a band crushed, sampled twice as finely: Phi within 0.01 at any mass."""
    curves = []
    for dx in (1.0, 0.5):
        x = sample(compose().case.shape.outline, dx, 4, 0)[0]
        y = x + np.where((x[:, :1] > 9) & (x[:, 1:] > 3), 20.0, 0.0)
        y[:, 1] = np.where(x[:, 1] < -6, -6 + 0.3 * (x[:, 1] + 6), y[:, 1])
        found = classified(x, y).last
        masses, part = found.survival()
        at_least = np.geomspace(0.003, 1, 50)  # from half a lump's mass up
        heavy = masses[None, :] >= at_least[:, None]
        curves.append(np.where(heavy.any(axis=1), np.where(heavy, part, 0).max(axis=1), 0.0))
    assert 0.5 < curves[0][0] < 0.9
    np.testing.assert_allclose(*curves, atol=0.01)


def test_unequal_masses_count_as_mass():
    """Lumps are mass, not particle numbers; all mass is accounted for to round-off."""
    x = ball()
    mass = np.where(x[:, 0] > 0, 3.0, 1.0)
    moved = x.copy()
    moved[x[:, 0] <= 0] = np.random.default_rng(4).permutation(x[x[:, 0] <= 0]) - [40, 0]
    found = classified(x, moved, mass=mass)
    assert found.lump_fraction == pytest.approx(0.75, abs=0.02)
    assert found.last.mass.sum() == pytest.approx(mass.sum(), rel=1e-13)
    assert found.lump_fraction + found.last.powder_fraction == pytest.approx(1.0, abs=1e-13)


def test_measures_of_a_known_split():
    """Pieces of 0.6, 0.3 and 0.1 of the mass: every measure by hand."""
    x = ball()
    order = np.argsort(x[:, 0])
    piece = np.empty(len(x), dtype=int)
    piece[order] = np.digitize(np.arange(len(x)), [round(0.6 * len(x)), round(0.9 * len(x))])
    found = classified(x, x + piece[:, None] * [30.0, 0.0], core_fraction=1.0).last
    parts = np.array([0.6, 0.3, 0.1])
    np.testing.assert_allclose(found.survival()[1], [0.6, 0.9, 1.0], atol=1e-4)
    assert found.joined_chance == pytest.approx((parts**2).sum(), abs=1e-4)
    assert found.effective_number == pytest.approx(1 / (parts**2).sum(), abs=1e-3)
    assert found.second_moment == pytest.approx(0.3**2 + 0.1**2, abs=1e-4)
    assert found.median_mass == found.largest == pytest.approx(0.6, abs=1e-4)
    halves = classified(x, x + (np.argsort(order) > 0.55 * len(x))[:, None] * [30.0, 0.0], core_fraction=1.0).last
    assert halves.median_mass == pytest.approx(0.55, abs=1e-3)
    shuffled = classified(x, np.random.default_rng(0).permutation(x)).last
    assert shuffled.effective_number > 0.5 * len(x)
    assert shuffled.median_mass == pytest.approx(1 / len(x))


def test_settled_or_not():
    """A body that breaks in the last frames has not settled; one that broke long ago has."""
    x = ball("preview")
    halves = x + np.where(x[:, :1] > 0, 10.0, 0.0)
    late = [x] * 25 + [halves]
    early = [x] + [halves] * 25
    assert not classified(*late, fidelity="preview").settled
    assert classified(*early, fidelity="preview").settled


def test_ancestry():
    """A body halves, then its lighter half halves: names stay with the heaviest heir, the others know their parent."""
    x = ball("preview")
    right = x[:, 0] > -3
    low = ~right & (x[:, 1] < -2)
    one = x + right[:, None] * [20.0, 0.0]
    two = one - low[:, None] * [0.0, 20.0]
    found = classified(x, one, two, two, fidelity="preview", frames="all", core_fraction=1.0).fragments
    assert [f.frame for f in found] == [100, 101, 102, 103]
    assert found[0].id.tolist() == [0]
    assert found[0].parent.tolist() == [-1]
    assert found[1].id.tolist() == [0, 1]
    assert found[1].parent.tolist() == [0, 0]
    assert found[2].id.tolist() == [0, 1, 2]
    assert found[2].parent.tolist() == [0, 1, 1]
    assert found[3].parent.tolist() == found[3].id.tolist()
    assert (found[2].id[found[2].label[right]] == 0).all()
    assert (found[2].id[found[2].label[low]] == 2).all()


def test_fragments_that_join_again_have_the_heavier_parent():
    """By proximity a light piece is lost in a heavy one and comes out again under a new name."""
    x = ball("preview")
    light = x[:, 0] < -8
    apart = x - light[:, None] * [20.0, 0.0]
    found = classified(x, apart, x, apart, fidelity="preview", frames="all", definition="proximity").fragments
    assert [f.id.tolist() for f in found] == [[0], [0, 1], [0], [0, 2]]
    assert [f.parent.tolist() for f in found] == [[-1], [0, 0], [0], [0, 0]]
    late = classified(apart, apart, x, fidelity="preview", frames="all", definition="proximity").fragments
    assert late[0].id.tolist() == [0, 1]
    assert late[2].parent.tolist() == [0]


def test_a_fragment_that_turns_and_flies():
    """Centre, velocity and spin of two halves, one of which turns; velocities by differences are of second order."""
    x = ball("preview")
    right = x[:, 0] > 0
    centre = x[right].mean(axis=0)
    states = []
    for t in np.arange(5) * 0.01:
        moved = x - ~right[:, None] * [20.0 + 3.0 * t, 0.0]
        arm = x[right] - centre
        turned = arm @ np.array([[np.cos(2 * t), np.sin(2 * t)], [-np.sin(2 * t), np.cos(2 * t)]])
        moved[right] = centre + turned + [0.0, 5.0 * t + 20]
        states.append(moved)
    dataset = classified(x, *states, fidelity="preview", frames=[103]).motion
    table = classify(
        np.stack([x, *states]),
        release=0,
        frames=[3],
        grid_spacing=dataset.grid_spacing,
        core_fraction=1.0,
        lump_cells=0,
    )
    table.motion.time[:] = np.concatenate([[-0.01], np.arange(5) * 0.01])
    rows = table.table()
    assert len(rows) == 2
    one, other = (rows.iloc[0], rows.iloc[1])
    if one["velocity_y"] < 1:
        one, other = other, one
    assert one["velocity_y"] == pytest.approx(5.0, rel=1e-6)
    assert one["spin"] == pytest.approx(2.0, rel=1e-3)
    assert other["velocity_x"] == pytest.approx(-3.0, rel=1e-6)
    assert other["spin"] == pytest.approx(0.0, abs=1e-9)
    assert other["extent_y"] == pytest.approx(np.ptp(x[~right, 1]))
    assert one["mass"] == right.sum()
    assert one["centre_x"] == pytest.approx(centre[0])


def test_three_dimensions():
    """A cube cut in two, one half turning about a slanted axis."""
    rng = np.random.default_rng(0)
    x = np.stack(np.meshgrid(*[np.arange(10.0)] * 3, indexing="ij"), -1).reshape(-1, 3) + rng.uniform(
        -0.2, 0.2, (1000, 3)
    )
    upper = x[:, 2] > 4.5
    omega = np.array([1.0, 2.0, -1.0])
    states = []
    for t in (0.0, 1e-4, 2e-4):
        moved = x + upper[:, None] * [0.0, 0.0, 5.0]
        moved[upper] += t * np.cross(omega, x[upper] - x[upper].mean(axis=0))
        states.append(moved)
    found = classify(
        np.stack([x, *states]), release=0, frames=[2], definition="bonds", core_fraction=1.0, lump_cells=0.0,
        mass=2.0, grid_spacing=2.0,
    )  # fmt: skip
    found.motion.time[:] = [-1e-4, 0.0, 1e-4, 2e-4]
    assert found.last.mass.tolist() == [1000.0, 1000.0]
    turning = found.table().loc[lambda rows: rows["centre_z"] > 5].iloc[0]
    np.testing.assert_allclose(turning[["spin_x", "spin_y", "spin_z"]].to_numpy(dtype=float), omega, rtol=1e-3)
