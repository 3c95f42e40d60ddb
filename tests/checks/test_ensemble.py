"""Tier 3 on built ensembles: rounding is left alone, shifts are noticed, what lacks is not measured."""

import numpy as np
import pandas as pd
import pytest

from snowrepro.checks import ensemble
from snowrepro.checks.finding import FAILED, NOT_MEASURED, OK, REGRESSED

CELLS = [(sintering, pressure) for sintering in ("none", "paper") for pressure in (340.0, 530.0, 3300.0)]
SPREAD = 0.02  # over seeds
ROUNDING = 1e-3  # of a run


def members(seeds: range, rounding: int | None = None, shift: float = 0.0, measure: str = "lump_fraction"):
    """An ensemble: each seed has its own numbers; with ``rounding`` they are moved a little, and one by ``shift``."""
    rows = []
    for seed in seeds:
        for number, (sintering, pressure) in enumerate(CELLS):
            values = 0.5 + SPREAD * np.random.default_rng((seed, number)).normal(size=len(ensemble.MEASURES))
            if rounding is not None:
                values += ROUNDING * np.random.default_rng((rounding, seed, number)).normal(size=len(values))
            row = dict(zip(ensemble.MEASURES, values, strict=True))
            row[measure] += shift * ((sintering, pressure) == ("paper", 530.0))
            rows.append({"experiment": "fig5", "sintering": sintering, "pressure": pressure, "seed": seed, **row})
    return pd.DataFrame(rows)


@pytest.fixture(scope="module")
def reference() -> pd.DataFrame:
    seeds = range(ensemble.SEEDS)
    twins = members(seeds, rounding=99).assign(summation="fixed_point")
    return pd.concat([members(seeds).assign(summation="in_order"), twins], ignore_index=True)


def test_the_same_runs_are_the_same(reference):
    found = ensemble.compare_with_reference("fig5", members(range(3)), reference)
    assert (found.state, found.measured) == (OK, "every number is the same")
    assert "margin" in found.note and "power" in found.note


def test_rounding_alone_is_left_alone(reference):
    """In all but the few that its level allows."""
    states = [
        ensemble.compare_with_reference("fig5", members(range(3), rounding=n), reference).state for n in range(40)
    ]
    assert states.count(OK) >= 39


@pytest.mark.parametrize("measure", ["lump_fraction", "fragments"])
def test_a_shift_within_what_other_seeds_do_is_noticed_by_pairs(reference, measure):
    """Half of what a seed does, in one cell of six: pairs notice it, means alone would not."""
    found = ensemble.compare_with_reference(
        "fig5", members(range(3), rounding=5, shift=0.5 * SPREAD, measure=measure), reference
    )
    assert found.state == REGRESSED and f"{measure} at 530, paper" in found.measured
    assert "no more than other seeds would do" in found.note


def test_a_shift_beyond_other_seeds_is_said_to_be(reference):
    found = ensemble.compare_with_reference("fig5", members(range(3), shift=10 * SPREAD), reference)
    assert found.state == REGRESSED and found.note.startswith("more than other seeds")


def test_other_members_are_noticed(reference):
    """Other snow under the same seed is another result, and no other ensemble."""
    others = members(range(100, 103)).assign(seed=np.repeat(range(3), len(CELLS)))
    found = ensemble.compare_with_reference("fig5", others, reference)
    assert found.state == REGRESSED and found.note.startswith("no more than other seeds")


def test_what_lacks_is_not_measured(reference):
    assert ensemble.compare_with_reference("fig6", members(range(3)), reference).state == NOT_MEASURED
    assert (
        ensemble.compare_with_reference("fig5", members(range(ensemble.SEEDS - 1, ensemble.SEEDS + 2)), reference).state
        == NOT_MEASURED
    )
    fewer = members(range(3)).query("pressure > 400")
    assert ensemble.compare_with_reference("fig5", fewer, reference).state == NOT_MEASURED


def test_a_number_that_is_none_is_no_result(reference):
    found = members(range(3))
    found.loc[4, "broken_bonds"] = np.nan
    assert ensemble.compare_with_reference("fig5", found, reference).state == FAILED


def test_the_power_is_what_it_says(reference):
    """How often a shift of SHIFT in one cell is noticed among other roundings."""
    caught = [
        ensemble.compare_with_reference("fig5", members(range(3), rounding=n, shift=ensemble.SHIFT), reference).state
        == REGRESSED
        for n in range(20)
    ]
    told = ensemble.compare_with_reference("fig5", members(range(3)), reference).note
    assert f"power: {np.mean(caught):.0%}" in told


def test_what_a_new_reference_changes_is_told(reference):
    (new,) = ensemble.describe_changes(pd.DataFrame(), reference)
    assert new == f"fig5: {len(reference)} runs, new"
    after = reference.assign(lump_fraction=reference["lump_fraction"] + 0.25)
    (told,) = ensemble.describe_changes(reference, after)
    assert "largest change 0.25" in told
