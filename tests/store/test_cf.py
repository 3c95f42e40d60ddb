"""Result files by the CF conventions: what an outside checker says of them, and that they are read as they were."""

import shutil

import netCDF4
import numpy as np
import pytest
import xarray as xr

from snowrepro import classify, open_run, open_sweep, summarise
from snowrepro.composition.compose import compose
from snowrepro.evidence import collect
from snowrepro.run import simulate
from snowrepro.store import cf
from snowrepro.store.run import Run
from snowrepro.sweep import record
from snowrepro.sweep.plan import make_plan
from tests.configs import changed
from tests.conformance import complaints
from tests.conftest import QUICK, SMALL


@pytest.fixture(scope="module")
def stored(small_run, small_config, tmp_path_factory):
    """The file of the small run."""
    run = Run(changed(small_config, store=str(tmp_path_factory.mktemp("store"))))
    return run.save(small_run, wall_seconds=1.0)


def results_of(store, *overrides):
    """The results.nc of a recorded sweep."""
    plan = make_plan([*overrides, f'store="{store}"'], multirun=True)
    record.write_record(plan)
    return collect.write_results(plan) / "results.nc"


@pytest.fixture(scope="module")
def swept(stored):
    """The results.nc of the small run with three others that were not run."""
    return results_of(stored.parents[1], *SMALL, "pressure=4000,3000", "sintering=paper,none")


@pytest.mark.nightly
def test_files_conform(stored, swept, tmp_path):
    """A fresh run and a fresh sweep have no flaw that an outside checker knows; a file broken on purpose has."""
    broken = shutil.copy(stored, tmp_path / "broken.nc")
    with netCDF4.Dataset(broken, "a") as file:
        file["density"].units = "furlongs per cell"
        file.delncattr("Conventions")
        file["y"].delncattr("positive")
        file["y"].axis = "up"
    run, sweep, flaws = complaints(stored, swept, broken)
    assert run == sweep == []
    assert any('density, "furlongs per cell" are not recognized' in flaw for flaw in flaws)
    assert any("Conventions field is not present" in flaw for flaw in flaws)
    assert any("axis attribute must be T, X, Y, or Z" in flaw for flaw in flaws)


@pytest.mark.nightly
def test_files_of_every_kind_conform(snowrepro, tmp_path):
    """In metres, indented, without results, along further keys; and what classify writes."""
    metres = Run(compose([*SMALL, f'store="{tmp_path}"'])).save(simulate(compose([*SMALL, "reading=si"])))
    indented = Run(compose([*QUICK, f'store="{tmp_path}"'])).save(simulate(compose(QUICK)))
    both = results_of(tmp_path, *SMALL, "indenter=none,disc", "reading.gravity=10,40", "seed=0,1")
    in_metres = results_of(tmp_path, "reading=si", "pressure=1,2")
    assert snowrepro("classify", str(metres), "--out", "found").returncode == 0
    files = [metres, indented, both, in_metres, tmp_path / "found" / "fragments.nc"]
    for path in files:
        with xr.open_dataset(path) as opened:
            assert opened.attrs["Conventions"] == cf.CONVENTIONS
    assert complaints(*files) == [[]] * len(files)


def test_particles_are_trajectories(stored, small_run):
    """Each quantity of a particle says where the particle is; nothing is said of features, as not all data are such."""
    with xr.open_dataset(stored) as file:
        assert file["particle_id"].attrs["cf_role"] == "trajectory_id"
        assert np.array_equal(file["particle_id"], np.arange(small_run.sizes["particle"]))
        for name in ("density", "velocity_x", "velocity_y"):
            assert {"x", "y", "snapshot_time", "particle_id"} <= set(file[name].coords)
        assert np.array_equal(file["y"], small_run["position"].sel(axis="y"))
        assert np.array_equal(file["velocity_x"], small_run["velocity"].sel(axis="x"))
        assert "featureType" not in file.attrs


def test_cells_are_a_count(stored):
    """Units that the checker's library knows, and beside them the reading's."""
    with xr.open_dataset(stored) as file:
        told = {name: (file[name].attrs["units"], file[name].attrs.get("reading_units")) for name in file.variables}
    assert told["x"] == ("1", "cell") and told["velocity_y"] == ("s-1", "cell s-1")
    assert told["young"] == ("kg s-2", "kg cell-1 s-2") and told["kinetic_energy"] == ("kg s-2", "kg cell2 s-2")
    assert told["mass"] == ("kg", None) and told["poisson"] == ("1", None)


def test_a_run_is_read_as_it_was_simulated(stored, small_run):
    """Names, values, units and words; the file's own are gone; parts are read alone."""
    with open_run(stored) as opened:
        assert opened.encoding["source"] == str(stored)
        position, wanted = opened["position"], small_run["position"]
        pieces = [np.s_[3], np.s_[:, 7, 1], np.s_[-1, [5, 2]], np.s_[2:4, ::9, [1]], np.s_[[0, 2], :, ::-1]]
        for piece in pieces:
            assert np.array_equal(position[piece], wanted[piece])
        loaded = opened.load()
    xr.testing.assert_identical(loaded.drop_attrs(deep=False), small_run.drop_attrs(deep=False))
    assert small_run.attrs.items() <= loaded.attrs.items() and not {*cf.OF_FILES} & {*loaded.attrs}


def test_a_run_that_was_opened_can_be_written_and_read_again(stored, tmp_path):
    with open_run(stored) as opened:
        opened.to_netcdf(tmp_path / "copy.nc")
        with open_run(tmp_path / "copy.nc") as copied:
            xr.testing.assert_identical(copied.load(), opened.load())
            assert "Conventions" not in copied.attrs


def test_a_file_of_before_is_still_read(stored, small_run, tmp_path):
    """Position and velocity with an axis of words: as runs were written until now."""
    before = small_run.assign_attrs(run_id="of before")
    before.to_netcdf(tmp_path / "before.nc")
    with open_run(tmp_path / "before.nc") as opened, open_run(stored) as now:
        xr.testing.assert_identical(opened.load(), before)
        assert {**summarise(opened), "run_id": 0, "seconds": 0} == {**summarise(now), "run_id": 0, "seconds": 0}


def test_a_file_that_xarray_opened_is_classified_alike(stored):
    """Without open_run; velocities are those of the file."""
    with xr.open_dataset(stored) as file, open_run(stored) as run:
        assert "position" not in file
        assert classify(file).table().equals(classify(run).table())
        assert summarise(file) == summarise(run)


def test_a_sweep_is_read_by_path_and_by_name(swept):
    """By its path as the store gives it; by xarray alone with its labels as indexes."""
    grid = open_sweep(swept.parent.name, swept.parents[2])
    xr.testing.assert_identical(open_sweep(swept), grid)
    index = {"nominal_pressure": "pressure", **{name: f"{name}_label" for name in ("shape", "floor", "sintering")}}
    with xr.open_dataset(swept) as file:
        cell = file.set_index(index).sel(nominal_pressure=3000, sintering="paper")
        assert cell["lump_fraction"].item() == grid["lump_fraction"].sel(pressure=3000, sintering="paper").item() > 0
        assert file["pressure"].attrs["reading_units"] == "kg cell-1 s-2"


def test_nothing_is_claimed_that_does_not_hold(tmp_path):
    """Where runs differ in their unit of length, and where it is not known, UDUNITS could not read it."""
    with xr.open_dataset(results_of(tmp_path, "reading=si,grid_units")) as mixed:
        assert "Conventions" not in mixed.attrs and mixed["impact_speed"].attrs["units"] == "length s-1"
    dataset = xr.Dataset({"length": ("bond", [1.0], {"units": "unknown"})})
    assert "Conventions" not in cf.as_file(dataset, "made").attrs
    known = xr.Dataset({"length": ("bond", [1.0], {"units": "kg m-1 s-2"})})
    assert cf.as_file(known, "made").attrs["Conventions"] == cf.CONVENTIONS
    assert known.attrs == {}, "the Dataset itself stays as it is"
