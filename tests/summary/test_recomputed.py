"""Diagnostics and summary columns of a small run, once more by plain NumPy from what the run stored."""

import json

import numpy as np
import pytest

from snowrepro.mpm.ledger import WORKS
from snowrepro.summary.row import summarise

SINGLE = 3e-6  # relative: states are stored as f32


@pytest.fixture(scope="module")
def states(small_run):
    """The stored states in f64, by name, and the rows of the frames that they were stored in."""
    names = ("position", "velocity", "J_P", "density", "young", "poisson", "hardening", "mass", "snapshot")
    return {name: small_run[name].values.astype(float) for name in names}, small_run.sel(
        frame=small_run.snapshot.values
    )


def test_times(small_run):
    """A frame's time is that of its end; the start is frame 0."""
    frame_time = json.loads(small_run.attrs["config"])["loading"]["frame_time"]
    np.testing.assert_array_equal(small_run.time.values, np.arange(61) * frame_time)
    np.testing.assert_array_equal(small_run.snapshot_time.values, small_run.snapshot.values * frame_time)
    assert {0, 20, 60} <= set(small_run.snapshot.values.tolist())


@pytest.mark.parametrize("name", ["density", "young", "hardening"])
def test_means(states, name):
    stored, frames = states
    np.testing.assert_allclose(frames[f"mean_{name}"], stored[name].mean(axis=1), rtol=SINGLE)


def test_mean_factor(states):
    """The geometric mean of exp(xi (1 - J_P)), its exponent between the reading's bounds."""
    stored, frames = states
    exponent = np.clip(stored["hardening"] * (1 - stored["J_P"]), -16.118, 5)
    np.testing.assert_allclose(frames.mean_factor, np.exp(exponent.mean(axis=1)), rtol=1e-4)


def test_motion(states):
    """Mass, momentum, centre, potential energy under the gravity of the frame, and the fastest particle."""
    stored, frames = states
    mass, x, v = stored["mass"], stored["position"], stored["velocity"]
    np.testing.assert_allclose(frames.total_mass, mass.sum(), rtol=SINGLE)
    scale = SINGLE * mass.sum() * np.abs(v).max()
    for axis, name in enumerate("xy"):
        np.testing.assert_allclose(frames[f"momentum_{name}"], v[:, :, axis] @ mass, atol=scale)
    centre = x[:, :, 1] @ mass / mass.sum()
    np.testing.assert_allclose(frames.centre_height, centre, rtol=SINGLE)
    gravity = np.where(stored["snapshot"] > 20, 40.0, 0.0)
    np.testing.assert_allclose(frames.gravitational_energy, gravity * mass.sum() * centre, rtol=SINGLE)
    np.testing.assert_allclose(frames.top_speed, np.hypot(*np.moveaxis(v, -1, 0)).max(axis=1), rtol=SINGLE)


def test_height(states):
    """The middle nine tenths of the mass: equal masses here, so quantiles between the middles of their shares."""
    stored, frames = states
    heights = np.sort(stored["position"][:, :, 1], axis=1)
    shares = (np.arange(heights.shape[1]) + 0.5) / heights.shape[1]
    expected = [np.interp(0.95, shares, row) - np.interp(0.05, shares, row) for row in heights]
    np.testing.assert_allclose(frames.body_height, expected, rtol=1e-5)


def test_counts(states):
    """Particles at a bound; a bound that f32 rounds across is not counted twice."""
    stored, frames = states
    exponent = stored["hardening"] * (1 - stored["J_P"])
    counts = {
        "poisson_capped": stored["poisson"] >= np.float32(0.45),
        "density_capped": stored["density"] >= 700,
        "hardening_capped": exponent >= 5,
        "hardening_floored": exponent <= -16.118,
        "volume_bounded": (stored["J_P"] <= np.float32(0.1)) | (stored["J_P"] >= 10),
    }
    for name, at_bound in counts.items():
        np.testing.assert_allclose(frames[name], at_bound.sum(axis=1), atol=1, err_msg=name)


def test_columns_of_frames(small_run):
    """Largest, sum and the row of the release, each over the frames that its meaning names."""
    row, falling = summarise(small_run), small_run.isel(frame=slice(20, None))
    for name in ("poisson_capped", "density_capped", "hardening_capped", "hardening_floored", "volume_bounded"):
        assert row[name] == max(small_run[name].values)
    for name in ("ended_inside", "substeps"):
        assert row[name] == sum(small_run[name].values)
    for name in ("density", "young", "hardening", "factor"):
        assert row[f"{name}_at_release"] == small_run[f"mean_{name}"].values[20]
    assert row["impact_speed"] == max(falling.top_speed.values)
    turned_over = sum(np.abs(falling[name].values).sum() for name in WORKS)
    assert row["energy_unclosed"] == pytest.approx(np.abs(falling.unclosed_energy.values).sum() / turned_over)
    heights, speeds = falling.body_height.values, falling.momentum_y.values / falling.total_mass.values
    assert row["flattening_most"] == pytest.approx((heights[0] - min(heights)) / heights[0])
    assert row["flattening_end"] == pytest.approx((heights[0] - heights[-1]) / heights[0])
    impact = min(speeds)
    upward = max(0.0, *speeds[list(speeds).index(impact) :])
    assert row["rebound"] == pytest.approx(upward / -impact)


def test_energies_close(small_run):
    """What is called unclosed is the change of both energies less all works, frame by frame."""
    change = np.diff(small_run.kinetic_energy.values + small_run.elastic_energy.values)
    works = sum(small_run[name].values[1:] for name in WORKS)
    scale = 1e-12 * small_run.elastic_energy.values.max()
    np.testing.assert_allclose(small_run.unclosed_energy.values[1:], change - works, atol=scale)
