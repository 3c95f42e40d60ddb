"""Particles of other codes: dimensions by names, ids, clocks, level axes; built so that lumps and speeds are known."""

import datetime as dt

import cftime
import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from snowrepro.errors import DataError
from snowrepro.summary.classify import classify, compose_analysis

STATES, SPEED, STEP = 4, 20.0, 0.1  # s between states
LATTICE = np.stack(np.meshgrid(np.arange(6.0), np.arange(5.0)), -1).reshape(-1, 2)
LATTICE = LATTICE + np.random.default_rng(0).uniform(-0.1, 0.1, LATTICE.shape)
LEFT = [LATTICE - [SPEED * STEP * state, 0.0] for state in range(STATES)]
SCATTER = np.random.default_rng(1).normal(0, 3.0, LATTICE.shape)
RIGHT = [LATTICE + [30.0, 0.0] + state * SCATTER for state in range(STATES)]
PLACES = np.stack([np.concatenate(pair) for pair in zip(LEFT, RIGHT, strict=True)])  # half of it is a lump, half powder
COUNT = PLACES.shape[1]
TIME = STEP * np.arange(STATES)
ANALYSIS = compose_analysis().model_copy(update={"definition": "bonds", "lump_cells": 0.0, "lump_mass": 0.2})
TIMES = ["time", "t", "frame", "Frames", "snapshot", "obs", "nTimeSteps", "number_of_states", "TIME", "step", "record"]
PARTICLES = [
    "particle",
    "p",
    "atom",
    "nParticles",
    "trajectory",
    "points",
    "drifter",
    "n_atoms",
    "ID",
    "NumberOfParticles",
]
AXES = ["axis", "xyz", "spatial", "dim", "components", "whatever", "space"]
UNITS = {  # of times, and what a second is in them
    "": 1.0, "s": 1.0, "ms": 1e3, "seconds since 2000-01-01 00:00:00": 1.0, "Minutes": 1 / 60, "microseconds": 1e6,
    "hours since 1900-01-01": 1 / 3600, "days since 2000-02-29": 1 / 86400, "0.01 s": 100.0,
    "milliseconds since the start": 1e3,
}  # fmt: skip


def foreign(places=PLACES, dims=("time", "particle"), **variables) -> xr.Dataset:
    """Places (time, particle, axis) with a variable an axis."""
    parts = {name: (dims, places[:, :, axis]) for axis, name in enumerate("xyz"[: places.shape[2]])}
    return xr.Dataset({**parts, **variables}, attrs={"release_frame": 0})


def judge(dataset: xr.Dataset, **options):
    """Its classification in all states."""
    return classify(dataset, ANALYSIS, frames="all", **options)


TRUTH = judge(foreign())


def speed_of(found) -> float:
    """Of the lump in the last state, along x."""
    table = found.table()
    return float(table[(table["frame"] == STATES - 1) & table["is_lump"]]["velocity_x"].iloc[0])


def test_the_truth():
    """Half of the mass is one lump."""
    assert TRUTH.lump_fraction == pytest.approx(0.5)
    assert TRUTH.last.lumps == 1
    assert speed_of(judge(foreign(time=("time", TIME)))) == pytest.approx(-SPEED)


@given(st.data())
@settings(max_examples=150, deadline=None, derandomize=True)
def test_order_and_names_of_dimensions_do_not_matter(data):
    """One variable or one an axis, each in any order, under the names that codes use, with a time in any unit."""
    time, particle = data.draw(st.sampled_from(TIMES)), data.draw(st.sampled_from(PARTICLES))
    axis, unit = data.draw(st.sampled_from(AXES)), data.draw(st.sampled_from(list(UNITS)))
    places, kind = PLACES, data.draw(st.sampled_from([np.float64, np.float32]))
    if data.draw(st.booleans()):  # level
        places = np.insert(PLACES, data.draw(st.sampled_from([0, 1, 2])), data.draw(st.floats(-5, 5)), axis=2)
    whole = xr.DataArray(places.astype(kind), dims=(time, particle, axis))
    if data.draw(st.booleans()):
        variables = {"position": whole.transpose(*data.draw(st.permutations(whole.dims)))}
    else:
        parts = {name: whole[:, :, number] for number, name in enumerate("xyz"[: places.shape[2]])}
        variables = {name: part.transpose(*data.draw(st.permutations(part.dims))) for name, part in parts.items()}
    clock = xr.DataArray(TIME * UNITS[unit], dims=time, attrs={"units": unit})
    if data.draw(st.booleans()):
        clock = clock.expand_dims({particle: COUNT}, axis=data.draw(st.sampled_from([0, 1])))
    name = "time" if clock.ndim == 1 or time != "time" else "clock"
    dataset = xr.Dataset({**variables, name: clock}, attrs={"release_frame": 0})
    found = judge(dataset, **({"time": "clock"} if name == "clock" else {}))
    assert found.motion.dimensions == 2
    np.testing.assert_array_equal(found.last.label, TRUTH.last.label)
    assert found.lump_fraction == TRUTH.lump_fraction
    names = found.motion.axes
    speeds = found.table().query("frame == 3 and is_lump")[[f"velocity_{axis}" for axis in names]].to_numpy()[0]
    np.testing.assert_allclose(speeds, [-SPEED, 0.0], rtol=1e-3, atol=1e-3)


@given(st.permutations(range(COUNT)), st.integers(0, 2**31))
@settings(max_examples=30, deadline=None, derandomize=True)
def test_ids_put_particles_in_one_order(first, seed):
    """Whatever the order of each state: places, velocities and masses belong to the same particles."""
    rng = np.random.default_rng(seed)
    ids = np.stack([first, *(rng.permutation(COUNT) for _ in range(STATES - 1))])
    velocity = np.broadcast_to(np.arange(COUNT)[None, :, None], PLACES.shape)
    mass = np.broadcast_to(1.0 + np.arange(COUNT), ids.shape)
    variables = {name: (("time", "particle"), np.take_along_axis(mass, ids, 1)) for name in ["mass"]}
    variables |= {f"v{axis}": (("time", "particle"), np.take_along_axis(velocity[:, :, 0], ids, 1)) for axis in "xy"}
    mixed = foreign(np.take_along_axis(PLACES, ids[:, :, None], 1), id=(("time", "particle"), 10 * ids), **variables)
    found = judge(mixed)
    plain = judge(foreign(mass=("particle", 1.0 + np.arange(COUNT))))
    np.testing.assert_array_equal(found.last.label, plain.last.label)
    assert found.lump_fraction == plain.lump_fraction
    np.testing.assert_array_equal(found.motion.velocities(2)[:, 1], np.arange(COUNT))
    np.testing.assert_array_equal(found.to_dataset()["particle_id"], 10 * np.arange(COUNT))


PLACED = ("time", "particle")
IDS = np.tile(np.arange(COUNT), (STATES, 1))


def changed(values, index, value):
    values = np.array(values, dtype=float)
    values[index] = value
    return values


@pytest.mark.parametrize(
    ("variables", "options", "message"),
    [
        ({"id": (PLACED, changed(IDS, (2, 5), 6))}, {}, r"'id' in state 2 repeat: '6.0' is there 2 times"),
        ({"id": (PLACED, changed(IDS, (1, 5), 900))}, {}, "of state 1 are not those of state 0: 1 of 60"),
        ({"id": (PLACED, changed(IDS, (3, 5), np.nan))}, {}, "1 ids 'id' are missing, the first in state 3"),
        ({"id": ("particle", np.zeros(COUNT))}, {}, "'id' repeat"),
        ({"time": ("time", [0.0, 0.1, 0.05, 0.2])}, {}, "time goes back: 'time' is 0.1 in state 1 and 0.05 in state 2"),
        ({"time": ("time", [0.0, 0.1, 0.1, 0.2])}, {}, "time stands still: 'time' is 0.1 in state 1 and 0.1"),
        ({"time": ("time", [0.0, np.nan, 0.1, np.nan])}, {}, "2 states have no time in 'time', the first is state 1"),
        ({"time": ("time", TIME, {"units": "months since 2000-01-01"})}, {}, "a month is no fixed time"),
        ({"time": ("time", list("abcd"))}, {}, "'time' are no numbers and no dates.*--time"),
        ({"time": (("time", "particle"), TIME[:, None] + np.arange(COUNT))}, {}, "particles have times of their own"),
        ({"mass": (("time", "particle"), 1.0 + IDS * np.arange(STATES)[:, None])}, {}, "masses 'mass' change in time"),
        ({}, {"position": "q"}, r"there is no variable 'q' that can be read \(--position\); there are: 'x', 'y'"),
        ({}, {"time_dimension": "q"}, "no dimension 'q'"),
        ({"w": ("time", TIME)}, {"velocity": "w,w"}, "same two dimensions"),
        ({}, {"velocity": "none", "time": "none", "particle_id": "none", "mass": "none"}, None),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_refused(variables, options, message):
    """Each with the states, and the option that helps."""
    if message is None:
        assert judge(foreign(**variables), **options).lump_fraction == TRUTH.lump_fraction
    else:
        with pytest.raises(DataError, match=message):
            judge(foreign(**variables), **options)


def test_masses_that_belong_to_no_particle_are_refused():
    """By slot, while ids move from slot to slot."""
    ids = np.stack([np.roll(np.arange(COUNT), state) for state in range(STATES)])
    mixed = foreign(id=(("time", "particle"), ids), mass=("particle", 1.0 + np.arange(COUNT)))
    with pytest.raises(DataError, match="do not say of which particle they are"):
        judge(mixed)
    judge(mixed, mass=2.0)


@pytest.mark.parametrize("dims", [("n", "m"), ("time", "frame"), ("particle", "atom"), ("a", "time_and_particle")])
def test_dimensions_that_are_not_clear_are_refused(dims):
    """No guess by order or size; the option decides."""
    with pytest.raises(DataError, match=r"it is not clear which dimension is time.*--time-dimension"):
        judge(foreign(dims=dims))
    assert judge(foreign(dims=dims), time_dimension=dims[0]).lump_fraction == TRUTH.lump_fraction
    assert judge(foreign(dims=dims), particle_dimension=dims[1]).lump_fraction == TRUTH.lump_fraction


def test_cf_says_which_dimension_is_which():
    """A trajectory's id, or a coordinate that is a time, where the names say nothing."""
    by_id = foreign(dims=("a", "b"), name=("b", IDS[0], {"cf_role": "trajectory_id"}))
    by_time = foreign(dims=("a", "b"), clock=("a", TIME, {"standard_name": "time"}))
    by_unit = foreign(dims=("a", "b"), clock=("a", TIME, {"units": "seconds since 2000-01-01"}))
    for dataset in (by_id, by_time, by_unit):
        assert judge(dataset).lump_fraction == TRUTH.lump_fraction
    assert speed_of(judge(by_time)) == pytest.approx(-SPEED)


@pytest.mark.parametrize("calendar", ["datetime64", "datetime", "standard", "noleap", "360_day", "timedelta64"])
def test_dates_of_any_calendar_are_seconds(calendar):
    """Also over the end of a February."""
    steps = [dt.timedelta(days=int(state)) for state in range(STATES)]
    if calendar == "timedelta64":
        values = np.array(steps, "timedelta64[ns]")
    elif calendar.startswith("datetime"):
        values = [dt.datetime(2000, 2, 27) + step for step in steps]  # noqa: DTZ001
        values = np.array(values, "datetime64[ns]" if calendar == "datetime64" else object)
    else:
        values = np.array([cftime.datetime(2000, 2, 27, calendar=calendar) + step for step in steps])
    found = judge(foreign(time=("time", values)))
    assert speed_of(found) == pytest.approx(-SPEED * STEP / 86400)
    assert found.motion.time_unit == "s"


def test_level_particles_are_judged_in_their_plane_and_others_in_space():
    """Whichever axis is level, in each state; a third axis in which they differ counts."""
    for axis in range(3):
        found = judge(foreign(np.insert(PLACES, axis, 3.5, axis=2)))
        assert found.motion.axes == tuple(name for name in "xyz" if name != "xyz"[axis])
        assert found.assumed[0] == f"dimensions: 2, as {'xyz'[axis]} is 3.5 everywhere"
        assert found.motion.grid_spacing == TRUTH.motion.grid_spacing
    rising = np.concatenate([PLACES, np.broadcast_to(TIME[:, None, None], (STATES, COUNT, 1))], axis=2)
    assert "z is the same for all particles" in judge(foreign(rising)).assumed[0]
    rising[2, 7, 2] += 0.01
    assert judge(foreign(rising)).motion.dimensions == 3


def test_particles_behind_the_last_are_no_particles_that_vanish():
    """Nothing tells padding from snow that vanished, but ids or who asks."""
    places = PLACES.copy()
    places[2:, 50:] = np.nan
    with pytest.raises(DataError, match=r"the last 10 of 60 particles have no place \(NaN\) in frame 2.*--id none"):
        judge(foreign(places))
    assert judge(foreign(places), particle_id="none").last.vanished == pytest.approx(1 / 6)
    assert judge(foreign(places, id=("particle", IDS[0]))).last.vanished == pytest.approx(1 / 6)


def test_values_that_were_never_written_are_missing():
    """NetCDF's own value for them, which no attribute names."""
    places = PLACES.copy()
    places[2, 5] = 9.969209968386869e36
    with pytest.raises(DataError, match=r"particle 5 has no place .NaN. in frame 2.*1 do so"):
        judge(foreign(places))
    places[2, 5] = 1e36
    with pytest.raises(DataError, match="too far to count in grid cells"):
        judge(foreign(places))


@pytest.mark.parametrize(
    ("attribute", "value", "message"),
    [
        ("grid_spacing", "1.0 mm", "grid_spacing is '1.0 mm', which is no number: give it with --grid-spacing"),
        ("release_frame", "start", "release_frame is 'start', which is no number.*--release"),
        ("release_frame", 1.5, "the release in frame 1.5 is not stored"),
        ("cell_mass", [1.0, 2.0], "cell_mass is .* which is no number: give it with --cell-mass"),
        ("cell_mass", -1.0, "cell_mass must not be negative"),
        ("grid_spacing", "\x1b[31m", r"grid_spacing is '\\x1b\[31m'"),
        ("grid_spacing", float("inf"), "grid_spacing must be positive"),
    ],
)
def test_attributes_of_other_codes(attribute, value, message):
    """One line that names the attribute and the option; the option wins."""
    dataset = foreign().assign_attrs({attribute: value})
    with pytest.raises(DataError, match=message):
        judge(dataset)
    judge(dataset, **{attribute.removesuffix("_frame"): 0 if attribute == "release_frame" else 1.0})


def test_numbers_in_attributes_of_any_form():
    """As a text, or alone in an array."""
    found = judge(foreign().assign_attrs(grid_spacing=" 2.0", release_frame=np.array(["1"]), cell_mass=np.array([[3]])))
    assert (found.motion.grid_spacing, found.motion.release, found.motion.cell_mass) == (2.0, 1, 3.0)


def test_axes_in_another_order_are_sorted():
    """By their labels; velocities too."""
    turned = xr.DataArray(PLACES[:, :, ::-1], dims=("time", "particle", "axis"), coords={"axis": ["y", "x"]})
    found = judge(xr.Dataset({"position": turned, "velocity": turned * 0 + [2.0, 1.0]}, attrs={"release_frame": 0}))
    np.testing.assert_array_equal(found.motion.position, PLACES)
    assert found.motion.velocities(0)[0].tolist() == [1.0, 2.0]
