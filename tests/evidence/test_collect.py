"""The numbers of a sweep together: its grid, its table, and the files with both."""

import logging
import time

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import snowrepro
from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.evidence import collect
from snowrepro.store import manifest
from snowrepro.store.run import Run
from snowrepro.summary.row import summarise
from snowrepro.sweep import record
from snowrepro.sweep.plan import Plan, make_plan
from tests.conftest import QUICK, SMALL

FIVE = ("pressure", "shape", "floor", "sintering", "seed")
ASKED = [*SMALL, "pressure=4000,3000", "sintering=paper,none"]


def plan_of(store, *overrides: str) -> Plan:
    """A recorded sweep."""
    plan = make_plan([*overrides, f'store="{store}"'], multirun=True)
    record.write_record(plan)
    return plan


def run_at(plan: Plan, pressure: float, sintering: str) -> Run:
    """The run of a plan with this pressure and option of sintering."""
    (run,) = [run for run in plan.runs if (run.case.pressure, run.case.sintering.name) == (pressure, sintering)]
    return run


@pytest.fixture(scope="module")
def swept(small_run, tmp_path_factory):
    """Four runs: sintered at 3000 finished, unsintered at 3000 failed, the others never run; store and plan."""
    store = tmp_path_factory.mktemp("a store's")
    plan = plan_of(store, *ASKED)
    run_at(plan, pressure=3000, sintering="paper").save(small_run, wall_seconds=2.0)
    run_at(plan, pressure=3000, sintering="none").save_outcome("failed", "it blew up")
    return store, plan


def test_a_sweep_is_a_grid(swept, small_run):
    """Results in their cells; elsewhere NaN, no words, and what became of the run."""
    store, plan = swept
    grid = snowrepro.open_sweep(record.name_sweep(plan.overrides), store)
    assert grid["lump_fraction"].dims == FIVE
    assert grid.pressure.values.tolist() == [3000, 4000], "numbers rise"
    assert grid.sintering.values.tolist() == ["paper", "none"], "names come as asked for"
    done, failed = (grid.sel(pressure=3000, sintering=arm).squeeze() for arm in ("paper", "none"))
    for name, value in summarise(small_run).items():
        if name not in ("run_id", "seconds", *FIVE):
            np.testing.assert_equal(done[name].item(), value)
    assert done["seconds"] == 2.0
    assert done["state"] == "done" and failed["state"] == "failed"
    assert failed["run_id"] == run_at(plan, pressure=3000, sintering="none").id
    assert (grid["state"].sel(pressure=4000) == "pending").all()
    assert int(grid["lump_fraction"].notnull().sum()) == int(grid["settled"].notnull().sum()) == 1
    assert failed["definition"] == "" and done["definition"] == "strain"
    assert grid.attrs["missing"].startswith("3 of 4 runs: ")
    assert f"{failed['run_id'].item()} (failed: it blew up)" in grid.attrs["missing"]
    assert grid.attrs["sweep"] == record.name_sweep(plan.overrides) and "fidelity=preview" in grid.attrs["overrides"]
    written = run_at(plan, pressure=3000, sintering="paper").manifest()
    assert all(grid.attrs[name] == written[name] for name in ("created", "git_state", "versions", "machine"))


def test_the_table_has_a_row_a_run(swept, small_run):
    """In the order of the plan, with the same coordinates."""
    store, plan = swept
    table = snowrepro.sweep_table(record.name_sweep(plan.overrides), store)
    assert list(table.columns[:8]) == [*FIVE, "run_id", "state", "reason"]
    assert table["run_id"].tolist() == [run.id for run in plan.runs]
    assert table["pressure"].tolist() == [run.case.pressure for run in plan.runs]
    done = table["state"] == "done"
    assert table["lump_fraction"].notna().equals(done) and table["definition"].notna().equals(done)
    assert table.loc[done, "lump_fraction"].item() == summarise(small_run)["lump_fraction"]
    assert table.set_index("state").loc["failed", "reason"] == "it blew up"


def test_results_are_files(swept):
    """The CSV is the table, the NetCDF the grid, and the same store gives the same bytes."""
    store, plan = swept
    folder = collect.write_results(plan)
    assert folder == record.locate_sweep(record.name_sweep(plan.overrides), store)
    table = snowrepro.sweep_table(folder.name, store)
    pd.testing.assert_frame_equal(pd.read_csv(folder / "results.csv"), table, check_dtype=False, rtol=0, atol=0)
    grid = snowrepro.open_sweep(folder.name, store)
    xr.testing.assert_identical(snowrepro.open_sweep(folder / "results.nc"), grid)
    first = {name: (folder / name).read_bytes() for name in ("results.csv", "results.nc")}
    time.sleep(1.1)  # HDF5 could stamp its objects with the second
    collect.write_results(plan)
    assert {name: (folder / name).read_bytes() for name in first} == first
    assert {path.name for path in folder.iterdir()} == {"sweep.json", *first}


def test_further_keys_are_dimensions(tmp_path):
    """What overrides vary beyond the five, by its text; what they only set is none."""
    plan = plan_of(tmp_path, *SMALL, "reading.gravity=100,40", "fidelity=preview,paper", "solver.cfl=0.2")
    grid = snowrepro.open_sweep(record.name_sweep(plan.overrides), tmp_path)
    assert set(grid["state"].dims) == {*FIVE, "fidelity", "reading_gravity"}
    assert grid["reading_gravity"].values.tolist() == ["40", "100"], "numbers rise, also as text"
    assert grid["reading_gravity"].attrs["key"] == "reading.gravity"
    assert grid["fidelity"].values.tolist() == ["preview", "paper"]
    cell = grid.sel(reading_gravity="100", fidelity="paper")
    asked = compose([*SMALL, "reading.gravity=100", "fidelity=paper", "solver.cfl=0.2"])
    assert cell["run_id"].item() == Run(asked).id


def test_cells_that_are_not_asked_for_say_so(tmp_path):
    """Two scenes are two of the four pairs of a shape and a floor."""
    plan = plan_of(tmp_path, "scene=ball_on_L,star_on_square")
    grid = snowrepro.open_sweep(record.name_sweep(plan.overrides), tmp_path)
    assert grid["state"].dims == FIVE, "a scene is no dimension of its own"
    states = grid["state"].squeeze().to_pandas()
    assert states.loc["ball", "L"] == states.loc["star", "square"] == "pending"
    assert states.loc["ball", "square"] == states.loc["star", "L"] == "not asked for"
    assert grid["run_id"].sel(shape="star", floor="L").item() == ""
    assert grid.attrs["missing"].startswith("2 of 2 runs")


def test_falls_and_hardness_tests_have_their_columns(small_run, indented_run, tmp_path):
    """Both kinds in one sweep: each column NaN where it does not apply."""
    plan = plan_of(tmp_path, *[o for o in QUICK if not o.startswith("indenter")], "indenter=none,disc")
    fall, test = plan.runs
    fall.save(small_run)
    test.save(indented_run)
    grid = snowrepro.open_sweep(record.name_sweep(plan.overrides), tmp_path)
    lumps, hardness = (grid[name].squeeze().to_pandas() for name in ("lump_fraction", "hardness"))
    assert lumps.notna().to_dict() == {"none": True, "disc": False}
    assert hardness.to_dict() == pytest.approx(
        {"none": np.nan, "disc": summarise(indented_run)["hardness"]}, nan_ok=True
    )
    assert grid["hardness"].attrs["units"] == "kg cell-1 s-2" and grid["hardness_depth"].attrs["units"] == "cell"


def test_a_sweep_without_results_has_its_columns(tmp_path):
    """Whoever reads it finds the variables that it will have, in their units."""
    plan = plan_of(tmp_path, *ASKED)
    grid = snowrepro.open_sweep(record.name_sweep(plan.overrides), tmp_path)
    assert grid["lump_fraction"].isnull().all() and "hardness" not in grid
    assert grid["impact_speed"].attrs["units"] == "cell s-1" and grid["pressure"].attrs["units"] == "kg cell-1 s-2"
    assert "created" not in grid.attrs
    grid.to_netcdf(tmp_path / "empty.nc")


def test_units_are_those_of_the_reading(tmp_path):
    """Metres or cells; mixed, the unit of length stays open."""

    def opened(*overrides):
        plan = plan_of(tmp_path, *overrides)
        return snowrepro.open_sweep(record.name_sweep(plan.overrides), tmp_path)

    metres, cells, mixed = opened("reading=si"), opened("reading=grid_units"), opened("reading=si,grid_units")
    assert metres["impact_speed"].attrs["units"] == "m s-1" and cells["impact_speed"].attrs["units"] == "cell s-1"
    assert mixed["impact_speed"].attrs["units"] == "length s-1" and "unit of length" in mixed.attrs["comment"]


def test_a_result_that_cannot_be_read_is_broken(tmp_path):
    """It looks whole by size and time, and is none."""
    plan = plan_of(tmp_path, *SMALL)
    folder = plan.runs[0].folder
    folder.mkdir(parents=True)
    (folder / "run.nc").write_bytes(b"no run")
    manifest.write(folder, ["run.nc"], {"run_id": folder.name})
    table = snowrepro.sweep_table(record.name_sweep(plan.overrides), tmp_path)
    assert table["state"].tolist() == ["broken"] and "cannot be read" in table["reason"][0]


def test_a_run_asked_for_twice_is_one_row(tmp_path):
    plan = plan_of(tmp_path, "pressure=3000,3e3,4000")
    assert len(plan.runs) == 3
    assert snowrepro.sweep_table(record.name_sweep(plan.overrides), tmp_path)["pressure"].tolist() == [3000, 4000]


def test_runs_that_no_coordinate_tells_apart_make_no_grid(tmp_path):
    """Two shapes of one name: the table holds both."""
    plan = plan_of(tmp_path, "shape=ball,star", "shape.name=mine")
    name = record.name_sweep(plan.overrides)
    with pytest.raises(ConfigError, match=r"two runs at pressure 2900.0, shape mine, floor L"):
        snowrepro.open_sweep(name, tmp_path)
    assert len(snowrepro.sweep_table(name, tmp_path)) == 2


def test_a_grid_that_is_too_large_is_refused(tmp_path, monkeypatch, caplog):
    """The table is written all the same, and no grid of before stays beside it."""
    plan = plan_of(tmp_path, *ASKED)
    folder = collect.write_results(plan)
    assert (folder / "results.nc").exists()
    monkeypatch.setattr(collect, "MOST_CELLS", 3)
    with pytest.raises(ConfigError, match=r"4 cells \(2 pressure x 2 sintering\), and may have 3"):
        snowrepro.open_sweep(folder.name, tmp_path)
    (folder / "results.csv").unlink()
    with caplog.at_level(logging.WARNING, "snowrepro"):
        collect.write_results(plan)
    assert "no results.nc: the grid" in caplog.text
    assert (folder / "results.csv").exists() and not (folder / "results.nc").exists()


def test_only_some_of_many_missing_runs_are_named():
    table = pd.DataFrame(
        {"run_id": list("abcd"), "state": ["done", *["failed"] * 3], "reason": ["", "x" * 999, "", "y"]}
    )
    assert collect.describe_missing(table, most=2) == f"3 of 4 runs: b (failed: {'x' * 80}); c (failed); and 1 more"
    assert collect.describe_missing(table[:1]) == ""


def test_a_sweep_that_is_not_there(swept):
    store, _ = swept
    with pytest.raises(
        ConfigError, match=r"nowhere/results.nc cannot be read as the results of a sweep: .*No such file"
    ):
        snowrepro.open_sweep("nowhere/results.nc")
    with pytest.raises(ConfigError, match=r"there is no sweep 'mine' .*; there are: .*fidelity=preview"):
        snowrepro.open_sweep("mine", store)
    with pytest.raises(ConfigError, match="there are: none yet"):
        snowrepro.sweep_table("mine", store / "nowhere")


SAMPLED = [
    *SMALL, "design=sobol", "design.points=4", "pressure=log(500,4000)", "reading.friction=interval(0,1)",
    "floor=choice(L,square)", "sintering=paper,none",
]  # fmt: skip


def test_a_sample_is_a_grid_over_its_points(tmp_path, small_run):
    """What was sampled are coordinates along the points; what was listed spans the grid; the file holds the same."""
    plan = plan_of(tmp_path, *SAMPLED)
    plan.runs[3].save(small_run)
    name = record.name_sweep(plan.overrides)
    grid = snowrepro.open_sweep(name, tmp_path)
    assert grid["lump_fraction"].dims == ("point", "shape", "sintering", "seed")
    for key in ("pressure", "reading_friction", "floor"):
        assert grid[key].dims == ("point",)
    assert grid["pressure"].values.tolist() == [run.case.pressure for run in plan.runs[::2]]
    assert grid["reading_friction"].values.tolist() == [run.case.reading.friction for run in plan.runs[::2]]
    assert grid["floor"].values.tolist() == [run.case.floor.name for run in plan.runs[::2]]
    done = grid.isel(point=1).sel(sintering="none")
    assert done["run_id"].item() == plan.runs[3].id and done["lump_fraction"].notnull().all()
    assert int(grid["lump_fraction"].notnull().sum()) == 1
    folder = collect.write_results(plan)
    xr.testing.assert_identical(snowrepro.open_sweep(folder / "results.nc"), grid)
    assert "point" in str(snowrepro.show(grid)) and "reading_friction" in str(snowrepro.show(grid))


@pytest.mark.parametrize("words", [["reading.contact=choice(legacy)"], ["reading.friction=interval(0.5,0.5000001)"]])
def test_what_a_design_gives_one_value_is_no_coordinate(tmp_path, words):
    plan = make_plan(
        ["design=sobol", "pressure=log(200,6000)", *words, "design.points=2", f"store={tmp_path}"], multirun=True
    )
    assert collect.collect_sweep(plan).factors == ["pressure"]
    assert collect.make_grid(collect.collect_sweep(plan)).sizes["point"] == 2


def test_a_run_that_two_points_share_has_two_rows(tmp_path):
    """Of whole numbers and names there are few; each point stays where it is in the design."""
    plan = plan_of(tmp_path, "design=sobol", "design.points=8", "reading.press_ramp=whole(0,1)")
    table = snowrepro.sweep_table(record.name_sweep(plan.overrides), tmp_path)
    assert table["point"].tolist() == list(range(8)) and table["run_id"].nunique() == 2
    assert snowrepro.open_sweep(record.name_sweep(plan.overrides), tmp_path).sizes["point"] == 8
