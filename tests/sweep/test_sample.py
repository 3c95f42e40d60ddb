"""Samples: the places of designs, the values there, and the runs that come of them."""

import numpy as np
import pytest
from scipy.stats import kstest

from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.settings.design import Design
from snowrepro.store.run import Run
from snowrepro.sweep import record
from snowrepro.sweep.design import count_places, get_block, make_places
from snowrepro.sweep.plan import Plan, make_plan
from tests.sweep.test_enumeration import configs_of

DESIGNS = ("sobol", "latin", "morris", "saltelli")
GROWING = ("sobol", "morris", "saltelli")
MIXED = [
    "reading.gravity=log(1,100)", "pressure=interval(200,6000)", "reading.contact=choice(legacy,coulomb)",
    "reading.press_ramp=whole(0,3)", "shape=choice(ball,star)",
]  # fmt: skip


def plan_of(*overrides: str, points: int = 8, design: str = "sobol") -> Plan:
    return make_plan([f"design={design}", f"design.points={points}", *overrides], multirun=False)


def values_of(plan: Plan, key: str) -> list[str]:
    """The values of a key in the runs of a plan, as they stand in overrides."""
    return [dict(text.split("=", 1) for text in planned.overrides)[key] for planned in plan.planned]


@pytest.mark.parametrize("name", DESIGNS)
def test_a_design_is_in_the_cube_and_repeats(name):
    design = Design(name=name, points=16, seed=3)
    places = make_places(design, 3)
    assert places.shape == (count_places(design, 3), 3) and places.min() >= 0 and places.max() <= 1
    np.testing.assert_array_equal(places, make_places(design, 3))
    assert not np.array_equal(places, make_places(Design(name=name, points=16, seed=4), 3))


@pytest.mark.parametrize("name", GROWING)
def test_a_larger_design_begins_with_the_smaller(name):
    small, large = (make_places(Design(name=name, points=points), 4) for points in (16, 64))
    np.testing.assert_array_equal(large[: len(small)], small)


def test_a_latin_hypercube_has_a_point_in_each_part():
    places = make_places(Design(name="latin", points=10), 3)
    assert (np.sort(np.floor(places * 10), axis=0) == np.arange(10)[:, None]).all()


def test_a_choice_of_lists_is_sampled_as_any_other():
    plan = plan_of("reading.hardening_exponent=choice([-16.118,5],[-2.3026,1.6094])", "pressure=300,740", points=4)
    assert {run.case.reading.hardening_exponent for run in plan.runs} == {(-16.118, 5.0), (-2.3026, 1.6094)}


def test_a_path_of_morris_moves_each_setting_once():
    """By two thirds, to one of the four levels."""
    design = Design(name="morris", points=20)
    paths = make_places(design, 5).reshape(20, get_block(design, 5), 5)
    steps = np.diff(paths, axis=1)
    assert np.allclose(np.abs(steps).sum(axis=2), 2 / 3) and np.allclose(np.abs(steps).sum(axis=1), 2 / 3)
    assert np.allclose(paths * 3, np.round(paths * 3))


def test_a_block_of_saltelli_mixes_two_points():
    """Between A and B stand A with one setting of B each."""
    blocks = make_places(Design(name="saltelli", points=4), 3).reshape(4, 5, 3)
    for a, *mixed, b in blocks:
        for i, place in enumerate(mixed):
            assert place[i] == b[i] and (np.delete(place, i) == np.delete(a, i)).all()


def test_values_are_spread_as_their_scale_says():
    """Equal ratios or equal steps are equally likely, and each whole number and each name as often as another."""
    plan = plan_of(*MIXED, points=256)
    numbers = {key: np.array(values_of(plan, key), dtype=float) for key in ("reading.gravity", "pressure")}
    for share in (np.log(numbers["reading.gravity"]) / np.log(100), (numbers["pressure"] - 200) / 5800):
        assert kstest(share, "uniform").statistic < 0.02
    for key, count in (("reading.press_ramp", 4), ("reading.contact", 2), ("shape", 2)):
        _, often = np.unique(values_of(plan, key), return_counts=True)
        assert len(often) == count and np.ptp(often) <= 8, key
    assert {run.case.shape.name for run in plan.runs} == {"ball", "star"}


def test_a_sampled_run_is_what_its_overrides_compose():
    plan = plan_of(*MIXED, "sintering=paper,none", points=2)
    for config, overrides in configs_of(plan):
        assert config == compose(overrides)


def test_runs_have_the_ids_that_they_have_alone():
    """A design says which runs there are, and is no part of any."""
    planned = plan_of("pressure=log(200,6000)", "fidelity=preview").planned[3]
    (pressure,) = (text for text in planned.overrides if text.startswith("pressure="))
    assert planned.run.id == Run(compose([pressure, "fidelity=preview"])).id
    assert "design" not in planned.run.config.record()


def test_more_points_keep_the_runs():
    small, large = (plan_of(*MIXED, "sintering=paper,none", points=points) for points in (4, 16))
    assert [run.id for run in large.runs[:8]] == [run.id for run in small.runs]
    assert [planned.point for planned in small.planned] == [0, 0, 1, 1, 2, 2, 3, 3]


def test_the_order_of_words_changes_nothing():
    """As it does not change the name of the sweep."""
    words = ["pressure=log(200,6000)", "reading.gravity=log(1,100)"]
    first, second = plan_of(*words), plan_of(*reversed(words))
    assert [run.id for run in first.runs] == [run.id for run in second.runs]
    assert record.name_sweep(first.overrides) == record.name_sweep(second.overrides)


def test_lists_and_seeds_are_crossed():
    """Only what is written as a range is sampled; a part is every so many of all."""
    words = ["pressure=log(200,6000)", "seed=0,1,2", "sintering=none,paper"]
    plan = plan_of(*words, points=2)
    assert len(plan.runs) == 12 and [factor.key for factor in plan.sample.factors] == ["pressure"]
    part = make_plan(["design=sobol", "design.points=2", *words], multirun=True, part=(2, 5))
    assert [run.id for run in part.runs] == [run.id for run in plan.runs[1::5]]


def test_a_sample_is_remembered(tmp_path):
    """By its words, which a record may have."""
    plan = plan_of(*MIXED, f"store={tmp_path}")
    record.write_record(plan)
    again = record.plan_remembered(record.name_sweep(plan.overrides), tmp_path)
    assert [run.id for run in again.runs] == [run.id for run in plan.runs]


def test_an_experiment_can_have_a_design(tmp_path, monkeypatch):
    """In its file, as its own words."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "experiments").mkdir()
    (tmp_path / "experiments" / "mine.yaml").write_text(
        "# @package _global_\ndefaults:\n  - override /design: sobol\n\ndesign: {points: 4}\n"
        "experiment: {name: mine, title: Mine, picture: sweep}\n"
        "hydra: {mode: MULTIRUN, sweeper: {params: {pressure: 'log(200,6000)', sintering: 'paper,none'}}}\n"
    )
    plan = make_plan(["experiment=mine"], multirun=False)
    assert len(plan.runs) == 8 and [factor.describe() for factor in plan.sample.factors] == ["log(200,6000)"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["pressure=log(1,2)"], r"'pressure=log\(1,2\)' is a range, .* add one, as in design=sobol"),
        (["design=sobol", "pressure=1,2"], r"design=sobol has nothing to sample: write a range, as in '"),
        (["design=sobol", "pressure=log(1,2),3"], r"'pressure=log\(1,2\),3': a range or a choice cannot stand beside"),
        (["pressure=300,range(1,5,2)"], r"'pressure=300,range\(1,5,2\)': a range or a choice cannot stand beside"),
        (["pressure=logspace(200,4000,8),300"], r"a range or a choice cannot stand beside other values"),
        (["reading.contact=choice(legacy,coulomb),legacy"], r"a range or a choice cannot stand beside other values"),
        (["pressure=3,log(1,2)"], r"a range or a choice cannot stand beside other values"),
        (["design=sobol", "shape=interval(0,1)"], r"'shape=0\.\d+': should be one of the names: ball, rectangle, "),
        (["design=sobol,latin", "pressure=log(1,2)"], r"'design=sobol,latin': a sweep has one design"),
        (["design=sobol", "design.points=2,4", "pressure=log(1,2)"], r"a sweep has one design"),
        (["design=sobol", "design.points=0", "pressure=log(1,2)"], r"design\.points: should be greater than 0"),
        (["design=sobol", "design.point=3", "pressure=log(1,2)"], r"there is no setting 'design\.point'; did you mean"),
        (["design=sobol", "pressure=log(0,2)"], r"start and stop should be above 0 \(got 0 and 2\)"),
        (["design=sobol", "pressure=interval(3,2)"], r"the first number of a range should be the lower one"),
        (["design=sobol", "pressure=whole(1,9999999999)"], r"more than 2,147,483,648 whole numbers"),
        (["design=sobol", "seed=whole(0,5)"], r"seed: the seeds of runs are listed and not sampled, as in seeds=3"),
        (["design=sobol", "reading.press_ramp=log(1,3)"], r"reading\.press_ramp: should be a valid integer"),
        (["design=saltelli", "design.points=99999", "pressure=log(1,2)"], r"this names 299,997 runs, at most"),
        (["design=bogus", "pressure=log(1,2)"], r"there is no design 'bogus'; there are: latin, morris"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said(words, message):
    with pytest.raises(ConfigError, match=message):
        make_plan(words, multirun=True)
