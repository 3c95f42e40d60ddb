"""Lumps and powder against built truth."""

import json

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from snowrepro.analysis.fragments import Fragments, classify, classify_frames
from snowrepro.composition import compose
from snowrepro.scene.build import sample

FIDELITIES = ("preview", "paper")


def picture(fidelity: str = "paper", seed: int = 0) -> np.ndarray:
    """The ball's particles around the origin."""
    config = compose([f"fidelity={fidelity}"])
    return sample(config.shape.outline, config.dx, 4, seed)[0]


def run_of(*states: np.ndarray, fidelity: str = "paper", mass: np.ndarray | None = None) -> xr.Dataset:
    """A run whose release is the first state and whose frames 100, 101, ... are the states."""
    config = compose([f"fidelity={fidelity}"])
    mass = np.ones(len(states[0])) if mass is None else mass
    return xr.Dataset(
        {"position": (("snapshot", "particle", "axis"), np.stack(states)), "mass": ("particle", mass)},
        {"snapshot": np.arange(100, 100 + len(states))},
        {"config": config.model_dump_json(), "release_frame": 100, "grid_spacing": config.dx, "cell_mass": 0.0},
    )


def classified(*states: np.ndarray, fidelity: str = "paper", **changes) -> Fragments:
    analysis = compose([]).analysis.model_copy(update={"lump_cells": 0.0, **changes})
    return classify(run_of(*states, fidelity=fidelity), analysis)


@settings(deadline=None, max_examples=15)
@given(st.floats(-np.pi, np.pi), st.floats(-50, 50), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_rigid_motion_and_small_strain_break_nothing(angle, shift, a, b, c):
    """Moved, turned and strained by up to a tenth in any direction, the ball is one fragment."""
    x = picture("preview")
    Q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    found = classified(x, x @ (Q @ np.array([[1 + a, b], [b, 1 + c]])).T + shift, fidelity="preview")
    assert len(found.mass) == 1
    assert found.lump_fraction == 1.0


@pytest.mark.parametrize("fidelity", FIDELITIES)
@pytest.mark.parametrize(("height", "low", "high"), [(0.75, 0.97, 1.0), (0.5, 0.0, 0.1), (0.25, 0.0, 0.02)])
def test_evenly_crushed(fidelity, height, low, high):
    """Crushed to three quarters of its height the ball is a lump, to half of it powder, at every fidelity."""
    x = picture(fidelity)
    assert low <= classified(x, x * [1, height], fidelity=fidelity).lump_fraction <= high


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_known_cuts_give_known_pieces(fidelity):
    """Cut into three strips that move apart: three lumps with the strips' masses."""
    x = picture(fidelity)
    strip = np.digitize(x[:, 0], [-8.0, 8.0])
    moved = x + (strip - 1)[:, None] * [20.0, 0.0]
    found = classified(x, moved, fidelity=fidelity)
    assert found.lumps == 3
    expected = sorted(np.bincount(strip) / len(x), reverse=True)
    np.testing.assert_allclose(found.mass[:3] / len(x), expected, atol=0.01)


def test_lumps_that_touch_again_stay_two():
    """A bond that broke stays broken when its ends meet again."""
    x = picture()
    halves = x + np.where(x[:, :1] > 0, 10.0, 0.0) * [1.0, 0.0]
    found = classified(x, halves, x)
    assert found.lumps == 2
    assert len(classified(x, x).mass) == 1


def test_shuffled_snow_is_powder():
    """Particles that swapped places share no bonds, though the picture is the same."""
    x = picture()
    found = classified(x, np.random.default_rng(0).permutation(x))
    assert found.lump_fraction == 0.0


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_mixtures_are_recovered(share):
    """A lump of known mass above loose powder: its fraction to 0.02."""
    x = picture()
    order = np.argsort(x[:, 1])
    powder = order[: round((1 - share) * len(x))]
    moved = x.copy()
    moved[powder] = np.random.default_rng(1).uniform(-25, 25, (len(powder), 2)) * [3, 0.3] - [0, 60]
    assert classified(x, moved).lump_fraction == pytest.approx(share, abs=0.02)


@pytest.mark.parametrize("seed", range(3))
def test_a_bridge_of_damaged_particles_joins_nothing(seed):
    """Halves pulled apart, the bridge between them stretched to 1.7: steep bonds in it survive.

    Without the core rule they make one lump of the halves, with it there are two.
    """
    x = picture(seed=seed)
    bridge = np.abs(x[:, 1]) < 5
    apart = np.where(x[:, 0] > 0, 12.0, 0.0)
    moved = x + 0.7 * np.where(bridge, np.clip(x[:, 0] + 6, 0, 12), apart)[:, None] * [1.0, 0.0]
    assert classified(x, moved, core_fraction=1.0).lumps == 1
    found = classified(x, moved)
    assert found.lumps == 2
    np.testing.assert_allclose(found.mass[:2] / len(x), 0.475, atol=0.01)


def test_particle_order_does_not_matter():
    """The same run with its particles in another order has the same fragments."""
    x = picture()
    y = x * [1.0, 0.62] + 0.3 * np.sin(x[:, ::-1])
    order = np.random.default_rng(3).permutation(len(x))
    one, other = classified(x, y), classified(x[order], y[order])
    np.testing.assert_array_equal(one.mass, other.mass)
    assert one.broken == other.broken


def test_unequal_masses_count_as_mass():
    """Lumps are mass, not particle numbers."""
    x = picture()
    mass = np.where(x[:, 0] > 0, 3.0, 1.0)
    moved = x.copy()
    moved[x[:, 0] <= 0] = np.random.default_rng(4).permutation(x[x[:, 0] <= 0]) - [40, 0]
    found = classify(run_of(x, moved, mass=mass))
    assert found.lump_fraction == pytest.approx(0.75, abs=0.02)
    assert found.mass.sum() == pytest.approx(mass.sum())


def test_frames_before_release_are_refused(small_run):
    """There are no bonds before release, and no fragments of frames that were not kept."""
    with pytest.raises(ValueError, match="not stored at or after the release"):
        classify_frames(small_run, [8])
    with pytest.raises(ValueError, match="not stored at or after the release"):
        classify_frames(small_run, [21])


def test_the_config_travels_with_the_run(small_run, small_config):
    """A run says of itself how it is to be classified."""
    assert json.loads(small_run.attrs["config"])["analysis"]["break_strain"] == small_config.analysis.break_strain
    assert classify_frames(small_run, [20])[0].largest == 1.0
