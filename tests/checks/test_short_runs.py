"""Tiers 1 and 2 on built numbers: what is noticed, what is left alone, what cannot be compared."""

import numpy as np
import pandas as pd
import pytest

from snowrepro.checks import cases, fingerprints, horizon
from snowrepro.checks.finding import MOVED, NOT_MEASURED, OK, REGRESSED
from snowrepro.simulation import simulate_case


def states(seed: int = 0, particles: int = 50) -> dict[int, cases.State]:
    rng = np.random.default_rng(seed)
    return {
        frame: {"J_P": rng.normal(1, 0.1, particles), "velocity": rng.normal(0, 3, (particles, 2))} for frame in (1, 20)
    }


@pytest.fixture
def start() -> np.ndarray:
    return np.random.default_rng(1).uniform(0, 10, (50, 2))


@pytest.fixture
def reference(start) -> pd.DataFrame:
    return horizon.tabulate_numbers(states(), start).assign(case="a", tolerance=1e-9)


def changed(by: float, where: int = 7) -> dict[int, cases.State]:
    """The states with the velocity of one particle changed in the last frame."""
    found = states()
    found[20]["velocity"][where, 1] += by
    return found


def test_numbers_within_their_tolerance_are_fine(start, reference):
    assert horizon.compare_with_reference("a", horizon.tabulate_numbers(states(), start), reference).state == OK
    found = horizon.compare_with_reference("a", horizon.tabulate_numbers(changed(1e-9), start), reference)
    assert found.state == OK and "frame 20" in found.measured


def test_one_particle_beyond_is_noticed_and_named(start, reference):
    found = horizon.compare_with_reference("a", horizon.tabulate_numbers(changed(1e-5), start), reference)
    assert found.state == REGRESSED and "velocity 1" in found.measured and "frame 20" in found.measured


@pytest.mark.parametrize("broken", [np.nan, np.inf])
def test_what_is_no_number_is_noticed(start, reference, broken):
    assert (
        horizon.compare_with_reference("a", horizon.tabulate_numbers(changed(broken), start), reference).state
        == REGRESSED
    )


def test_a_quantity_that_is_gone_or_new_is_noticed(start, reference):
    less = states()
    del less[20]["J_P"]
    more = states()
    more[20]["young"] = np.ones(50)
    for other in (less, more):
        assert horizon.compare_with_reference("a", horizon.tabulate_numbers(other, start), reference).state == REGRESSED


def test_a_case_without_a_reference_is_not_measured(start, reference):
    assert (
        horizon.compare_with_reference("b", horizon.tabulate_numbers(states(), start), reference).state == NOT_MEASURED
    )


def test_fingerprints_name_the_first_frame_and_quantity_that_moved():
    here = fingerprints.name_platform()
    platforms = {here: {"processor": "another", "cases": {"a": fingerprints.take_fingerprints(states())}}}
    assert fingerprints.compare_with_reference("a", fingerprints.take_fingerprints(states()), platforms).state == OK
    moved = fingerprints.compare_with_reference("a", fingerprints.take_fingerprints(changed(1e-15)), platforms)
    assert moved.state == MOVED and "frame 20" in moved.measured and "velocity" in moved.measured
    assert "tier 2 takes over; the reference was taken on another" in moved.note


def test_a_platform_without_a_fingerprint_falls_to_tier_2_and_says_so():
    found = fingerprints.compare_with_reference(
        "a", fingerprints.take_fingerprints(states()), {"Plan9 mips, taichi 1.7.4": {}}
    )
    assert found.state == MOVED
    assert (
        fingerprints.name_platform() in found.measured and "tier 2 takes over" in found.note and "Plan9" in found.note
    )


def test_another_compiler_is_compared_with_the_one_that_was_there(monkeypatch):
    """On the same system and architecture, and only while it has no fingerprints of its own."""
    prints, here = fingerprints.take_fingerprints(states()), fingerprints.name_platform()
    other = {"processor": "another", "cases": {"a": fingerprints.take_fingerprints(changed(1e-15))}}
    monkeypatch.setattr(fingerprints, "name_platform", lambda: f"{here.partition(',')[0]}, another 1.0")
    as_it_was = {"Plan9 mips, another 1.0": other, here: {"processor": "another", "cases": {"a": prints}}}
    found = fingerprints.compare_with_reference("a", prints, as_it_was)
    assert (found.state, found.allowed) == (OK, f"the same bits as on {here}")
    with_its_own = {**as_it_was, fingerprints.name_platform(): other}
    found = fingerprints.compare_with_reference("a", prints, with_its_own)
    assert (found.state, found.allowed) == (MOVED, "the same bits")


def test_a_fingerprint_is_of_numbers_and_not_of_how_they_are_kept():
    values = {1: {"x": np.arange(6.0).reshape(3, 2)}}
    turned = {1: {"x": np.asfortranarray(np.arange(6.0).reshape(3, 2))}}
    assert fingerprints.take_fingerprints(values) == fingerprints.take_fingerprints(turned)


@pytest.mark.nightly
def test_the_bounds_act_in_the_runs_that_are_for_them():
    """Else a bound could be lost and no tier would notice."""
    acting = {"bounded": ("density_capped", "poisson_capped"), "readings": ("hardening_capped", "volume_bounded")}
    for name, case in cases.compose_short_runs(acting).items():
        run = simulate_case(case)
        assert all(int(run[bound].max()) > 10 for bound in acting[name])
