"""What matters in a sweep: indices of functions whose indices are known, through the table that a sweep has."""

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest

from snowrepro.errors import ConfigError
from snowrepro.evidence.collect import CollectedSweep, collect_sweep
from snowrepro.evidence.indices import estimate, make_bins, measure_first_order
from snowrepro.evidence.influence import (
    EFFECT,
    FAILED,
    FIRST,
    SPREAD,
    TOTAL,
    measure_influence,
    tabulate_failures,
)
from snowrepro.sweep.plan import make_plan

# Three settings, and where they lie in their ranges.
RANGES = {"pressure": (200.0, 6000.0), "reading.friction": (0.0, 1.0), "reading.drop_height": (20.0, 90.0)}
ISHIGAMI = dict(zip(RANGES, ((0.3139, 0.5576), (0.4424, 0.4424), (0.0, 0.2437)), strict=True))  # first, total order
WORDS = [f"{key}=interval({low:g},{high:g})" for key, (low, high) in RANGES.items()]


def place(table: pd.DataFrame, key: str) -> np.ndarray:
    """Where a setting lies in its range, from 0 to 1."""
    low, high = RANGES[key]
    return (table[key.replace(".", "_")].astype(float).to_numpy() - low) / (high - low)


def ishigami(table: pd.DataFrame) -> np.ndarray:
    """Ishigami and Homma 1990, a = 7, b = 0.1, over -pi to pi."""
    return evaluate(*(np.pi * (2 * place(table, key) - 1) for key in RANGES))


def evaluate(x1: np.ndarray, x2: np.ndarray, x3: np.ndarray) -> np.ndarray:
    """The function of three numbers."""
    return np.sin(x1) + 7 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1)


def sample(design: str, points: int, *more: str, function=ishigami, column: str = "lump_fraction") -> CollectedSweep:
    """The table of a sample, as if every run had given the value of a function for the mass in lumps."""
    sweep = collect_sweep(make_plan([f"design={design}", f"design.points={points}", *WORDS, *more], multirun=True))
    table = sweep.table.assign(state="done", **{column: function})
    return replace(sweep, table=table)


def values_of(sweep: CollectedSweep, index: str, measure: str = "lump_fraction") -> dict[str, float]:
    """An index of each setting."""
    table = measure_influence(sweep, measure).table
    return table[table["index"] == index].set_index("setting")["value"].to_dict()


@pytest.fixture(scope="module")
def sobol() -> CollectedSweep:
    return sample("sobol", 512)


@pytest.fixture(scope="module")
def saltelli() -> CollectedSweep:
    return sample("saltelli", 256)


def test_the_first_order_of_ishigami(sobol):
    """From the runs of any design, without one that is made for it; the intervals hold what is known."""
    found = measure_influence(sobol, "lump_fraction").table.set_index("setting")
    for key, (first, _) in ISHIGAMI.items():
        assert found["value"][key] == pytest.approx(first, abs=0.05), key
        assert found["low"][key] - 0.01 < first < found["high"][key] + 0.01, key
    assert measure_influence(sobol, "lump_fraction").rank(FIRST) == [
        "reading.friction",
        "pressure",
        "reading.drop_height",
    ]


def test_both_orders_of_ishigami(saltelli):
    """The third setting acts through the first alone, which only the total order sees.

    Over 20 seeds such designs have standard deviations of at most 0.044 and 0.065; three of them are allowed.
    """
    for number, (index, deviation) in enumerate({FIRST: 0.044, TOTAL: 0.065}.items()):
        found = values_of(saltelli, index)
        known = {key: orders[number] for key, orders in ISHIGAMI.items()}
        assert found == pytest.approx(known, abs=3 * deviation), index


def test_fewer_points_have_wider_intervals(saltelli):
    few = measure_influence(sample("saltelli", 16), "lump_fraction").table
    many = measure_influence(saltelli, "lump_fraction").table
    assert ((few["high"] - few["low"]) > 2 * (many["high"] - many["low"])).all()


def test_intervals_hold_the_truth_as_often_as_they_say():
    """In some 95 of 100 designs: the index of the first setting, by bins."""
    held = 0
    for seed in range(40):
        u = np.random.default_rng(seed).random((128, 3))
        y = evaluate(*(np.pi * (2 * u.T - 1)))
        value, half = estimate(partial(measure_first_order, make_bins(u[:, 0]), y), 128)
        held += abs(value - ISHIGAMI["pressure"][0]) <= half
    assert 34 <= held <= 40


def test_the_effects_of_a_plane():
    """The same everywhere, over the whole range, whatever the sign; no spread."""
    sweep = sample("morris", 10, function=lambda t: 3 * place(t, "pressure") - 0.5 * place(t, "reading.friction"))
    known = {"pressure": 3.0, "reading.friction": 0.5, "reading.drop_height": 0.0}
    assert values_of(sweep, EFFECT) == pytest.approx(known, abs=1e-5)
    assert values_of(sweep, SPREAD) == pytest.approx(dict.fromkeys(known, 0.0), abs=1e-5)


def test_what_varies_by_chance_decides_nothing():
    """Noise has indices near zero, also where each point was run three times: seeds are not taken for new points."""
    noise = np.random.default_rng(1).normal(size=100)
    bins = make_bins(np.arange(200.0))
    chance = [measure_first_order(bins, np.random.default_rng(i).normal(size=200), np.ones(200)) for i in range(100)]
    assert abs(np.mean(chance)) < 0.01
    sweep = sample("sobol", 100, "seed=0,1,2", function=lambda t: noise[t["point"]] + 0.01 * t["seed"])
    assert all(abs(value) < 0.3 for value in values_of(sweep, FIRST).values())


MANY = [
    *("reading.gravity=log(5,20)", "floor.drop_x=interval(60,150)", "reading.press_damping=interval(0,5)"),
    *("solver.cfl=log(0.2,0.8)", "fidelity.dx=log(1.4,2.8)", "reading.cadence=choice(frame,substep)"),
    *("reading.release=choice(keep_velocity,rest)", "reading.density_changes=choice(moduli,moduli_and_volume)"),
    *("reading.unsintered=choice(pressed,not_pressed)", "reading.external_force=choice(per_unit_mass,per_particle)"),
]


@pytest.mark.parametrize("key", ["reading_cadence", "reading_release", "reading_external_force"])
def test_what_one_setting_does_is_not_given_to_another(key):
    """Points of a Sobol sequence are even in two settings only coarsely: fine bins of one may tell the other."""
    sweep = sample("sobol", 64, *MANY, function=lambda t: (t[key] == t[key].iloc[0]).astype(float))
    found = measure_influence(sweep, "lump_fraction")
    values, mixed = found.table.set_index("setting")["value"], dict(found.mixed)
    one = sweep.key_of(key)
    assert values[one] == pytest.approx(1.0)
    assert [name for name in values.index if name != one and values[name] > 0.4 and mixed.get(name) != one] == []
    assert sum(values > 0.4) <= 2


def is_central(values: pd.Series) -> np.ndarray:
    """Whether numbers are in the middle half of them all."""
    return (abs(values.astype(float).rank(pct=True) - 0.5) < 0.25).to_numpy(float)


def differ(table: pd.DataFrame, one: str, other: str) -> np.ndarray:
    """Whether one of two settings has the name of the first point, and the other has not."""
    return ((table[one] == table[one].iloc[0]) != (table[other] == table[other].iloc[0])).to_numpy(float)


@pytest.fixture(scope="module")
def all_at_once() -> CollectedSweep:
    """The points of experiment=unprinted: 17 settings."""
    words = ["experiment=unprinted", "design.points=64", "pressure=300", "sintering=paper"]
    return collect_sweep(make_plan(words, multirun=True))


@pytest.mark.parametrize(
    "function",
    [
        lambda t: is_central(t["reading_friction"]),
        lambda t: is_central(t["floor_drop_x"]),
        lambda t: is_central(t["solver_cfl"]),
        lambda t: t["reading_press"].isin(["radial_constant", "radial_linear"]).to_numpy(float),
        lambda t: differ(t, "reading_release", "reading_unsintered"),
        lambda t: differ(t, "reading_external_force", "reading_density_changes"),
    ],
)
def test_parts_and_pairs_of_settings_are_told_from_others_too(all_at_once, function):
    """Or it is said that they are not."""
    value = function(all_at_once.table)
    found = measure_influence(
        replace(all_at_once, table=all_at_once.table.assign(state="done", lump_fraction=value)), "lump_fraction"
    )
    shown = found.table[(found.table["value"] > 0.3) & (found.table["low"] > 0)]["setting"]
    mixed = {one for one, _ in found.mixed}
    assert [key for key in shown if key not in mixed and key != "reading.press"] == []


def test_a_measure_that_rarely_differs_has_indices():
    """A draw of the bootstrap may hold none of the runs that differ."""
    sweep = sample("sobol", 16, function=lambda t: (t["point"] == 3).astype(float))
    assert np.isfinite(measure_influence(sweep, "lump_fraction").table["value"]).all()


def test_settings_that_are_not_told_apart_are_named():
    """Two that always change together."""
    sweep = sample("sobol", 64, function=lambda t: place(t, "pressure"))
    sweep = replace(sweep, table=sweep.table.assign(reading_friction=place(sweep.table, "pressure")))
    mixed = measure_influence(sweep, "lump_fraction").mixed
    assert set(mixed) == {("pressure", "reading.friction"), ("reading.friction", "pressure")}
    assert measure_influence(sample("sobol", 64), "lump_fraction").mixed == ()


def test_a_list_beside_a_sample_is_a_setting_too():
    """And what it decides is counted once for every run."""
    sweep = sample("sobol", 64, "sintering=paper,none", function=lambda t: (t["sintering"] == "paper") + 0.0)
    found = values_of(sweep, FIRST)
    assert found["sintering"] == pytest.approx(1.0) and found["pressure"] == pytest.approx(0.0, abs=1e-9)


def test_a_plain_grid_has_indices(tmp_path):
    """Without any design: of what it varies."""
    sweep = collect_sweep(make_plan(["pressure=1,2,3,4", "seed=range(5)"], multirun=True))
    sweep = replace(sweep, table=sweep.table.assign(state="done", lump_fraction=lambda t: t["pressure"] / 4))
    assert values_of(sweep, FIRST) == pytest.approx({"pressure": 1.0, "seed": 0.0}, abs=0.3)


def fail_where(sweep: CollectedSweep, where: np.ndarray) -> CollectedSweep:
    """A sweep some of whose runs failed."""
    table = sweep.table.copy()
    table.loc[where, ["state", "lump_fraction"]] = ["failed", np.nan]
    return replace(sweep, table=table)


def test_failures_are_an_outcome_with_a_region(sobol):
    """Their share is told part by part, they have indices, and those of other measures go on without them."""
    sweep = fail_where(sobol, place(sobol.table, "reading.friction") > 0.75)
    table = tabulate_failures(sweep).set_index(["setting", "part"])
    assert table.loc["reading.friction", "share"].round(2).tolist() == [0.0, 0.0, 0.0, 1.0]
    assert table.loc["pressure", "share"].to_numpy() == pytest.approx(0.25, abs=0.05)
    assert int(table.loc["pressure", "runs"].sum()) == 512
    found = values_of(sweep, FIRST, FAILED)
    assert found["reading.friction"] > 0.9 and abs(found["pressure"]) < 0.05
    influence = measure_influence(sweep, "lump_fraction")
    assert influence.used == int((sweep.table["state"] == "done").sum()) < influence.runs == 512


def test_blocks_with_a_failed_run_are_left_out(saltelli):
    """The indices of the others are still those of the function, roughly."""
    sweep = fail_where(saltelli, np.random.default_rng(0).random(len(saltelli.table)) < 0.05)
    found = values_of(sweep, TOTAL)
    assert found == pytest.approx({key: total for key, (_, total) in ISHIGAMI.items()}, abs=0.12)


def test_too_little_says_so(sobol):
    few = measure_influence(sample("sobol", 4), "lump_fraction")
    assert few.table.empty and few.note == "4 points have a value, and 8 are needed"
    same = measure_influence(sample("sobol", 16, function=lambda t: 1.0), "lump_fraction")
    assert same.table.empty and same.note == "it is the same in all runs"
    message = r"'lumps_fraction' is no column of numbers that runs give; did you mean 'lump_fraction'\?"
    with pytest.raises(ConfigError, match=message):
        measure_influence(sobol, "lumps_fraction")


def test_an_estimate_repeats(sobol):
    """The draws of the bootstrap have a seed."""
    first, second = (measure_influence(sobol, "lump_fraction").table for _ in range(2))
    pd.testing.assert_frame_equal(first, second)
