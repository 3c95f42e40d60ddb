"""Ranges by number: linspace and logspace in overrides, rounded so that names stay plain, and bounded."""

import itertools
import math

import pytest

from snowrepro.composition import spacing
from snowrepro.errors import ConfigError
from snowrepro.sweep import enumeration, record
from snowrepro.sweep.plan import make_plan


def pressures(*overrides: str) -> list[float]:
    """The pressures of a sweep, in its order."""
    return [run.case.pressure for run in make_plan(overrides, multirun=True).runs]


def test_ratios_and_steps_are_equal_but_for_rounding():
    """The ends are as they are given; falling ranges too."""
    numbers = spacing.space_by_ratio(200, 4000, 8)
    assert numbers == [200, 306.825, 470.709, 722.128, 1107.84, 1699.56, 2607.35, 4000]
    ratios = [after / before for before, after in itertools.pairwise(numbers)]
    assert max(ratios) / min(ratios) == pytest.approx(1, abs=1e-5)
    assert spacing.space_by_ratio(1000, 1, 4) == [1000, 100, 10, 1]
    assert spacing.space_evenly(0, 1, 4) == [0, 0.333333, 0.666667, 1]
    assert spacing.space_evenly(1234567.5, -1, 2) == [1234567.5, -1]


def test_whole_numbers_are_written_as_such():
    """So they do for settings that are counts, and a run is the same as with 10 written out."""
    plan = make_plan(["pressure=logspace(1,1000,4)"], multirun=True)
    assert [planned.overrides for planned in plan.planned] == [(f"pressure={p}",) for p in (1, 10, 100, 1000)]
    assert plan.runs[1].id == make_plan(["pressure=10"], multirun=False).runs[0].id
    seeds = make_plan(["seed=linspace(0,6,3)"], multirun=True)
    assert [run.case.seed for run in seeds.runs] == [0, 3, 6]


def test_a_range_is_a_sweep_like_any(tmp_path):
    """Beside others, sorted, remembered by a plain name, and found again."""
    words = ["pressure=logspace(200,800,3)", "sintering=paper,none", f"store={tmp_path}"]
    assert pressures(*words) == [200, 200, 400, 400, 800, 800]
    assert pressures("pressure=sort(logspace(200,800,3),reverse=true)") == [800, 400, 200]
    record.write_record(make_plan(words, multirun=True))
    (name,) = record.list_sweeps(tmp_path)
    assert name == "pressure=logspace_200,800,3_,sintering=paper,none"
    assert len(record.plan_remembered(name, tmp_path).runs) == 6
    with pytest.raises(ConfigError, match="add -m"):
        make_plan(words, multirun=False)


@pytest.mark.parametrize(
    ("override", "told"),
    [
        ("pressure=logspace(0,4000,8)", "start and stop should be above 0 (got 0 and 4000)"),
        ("pressure=logspace(200,inf,8)", "start and stop should be finite (got 200 and inf)"),
        ("pressure=linspace(200,4000,1)", "the count should be 2 to 100,000 (got 1)"),
        ("pressure=linspace(200,4000,1000000000000)", "the count should be 2 to 100,000 (got 1,000,000,000,000)"),
        ("pressure=linspace(1,1.000001,9)", "some of the 9 numbers are the same in 6 digits: take fewer"),
        ("pressure=logspace(200,4000,8.5)", "mismatch type argument count: float is incompatible with int"),
        ("pressure=logspace(200,4000)", "missing a required argument: 'count'"),
        ("pressure=logspace(a,b,3)", "mismatch type argument start: str is incompatible with "),
    ],
)
def test_what_makes_no_range_is_one_message(override, told):
    """It names the override."""
    with pytest.raises(ConfigError) as refused:
        make_plan([override], multirun=True)
    assert str(refused.value).startswith(f"cannot read '{override}': {told}")
    assert "\n" not in str(refused.value) and "hydra.cc" not in str(refused.value)


def test_a_range_names_as_many_numbers_as_a_sweep_has_runs():
    """More could not be run."""
    assert spacing.MOST_NUMBERS == enumeration.MOST_RUNS
    with pytest.raises(ConfigError, match="this names 200,000 runs, at most 100,000 are allowed"):
        make_plan(["pressure=linspace(1,100000,100000)", "sintering=paper,none"], multirun=True)


def test_numbers_of_any_size_are_finite():
    """Also where the ratio of the ends has no number; large ones are not written out."""
    numbers = spacing.space_by_ratio(1e-300, 1e300, 5)
    assert all(map(math.isfinite, numbers)) and [*map(str, numbers)] == ["1e-300", "1e-150", "1", "1e+150", "1e+300"]
