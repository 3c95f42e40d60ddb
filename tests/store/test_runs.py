"""Identity and files: the same run has one id, and a result is whole or absent."""

import numpy as np
import pytest
import xarray as xr

from snowrepro import open_run, summarise
from snowrepro.composition import compose
from snowrepro.errors import StoreError
from snowrepro.store import runs


def test_any_spelling_gives_the_same_id():
    """Order, defaults said aloud, number formats, and what is not physics do not enter."""
    plain = runs.identify(compose(["pressure=500", "seed=1"]))
    for spelling in (
        ["seed=1", "shape=ball", "floor=L", "pressure=5e2", "reading=grid_units"],
        ["pressure=500.0", "seed=1", "store=elsewhere", "reports=there", "analysis.break_strain=0.2"],
        ["pressure=500", "seed=1", "reading.gravity=10", "sintering=paper"],
    ):
        assert runs.identify(compose(spelling)) == plain


@pytest.mark.parametrize(
    "change", ["pressure=501", "seed=2", "sintering=none", "reading.gravity=9.9", "fidelity=preview", "solver.cfl=0.3"]
)
def test_any_physics_gives_another_id(change):
    assert runs.identify(compose([change])) != runs.identify(compose([]))


def test_experiments_share_runs():
    """A run of an experiment is the same run when asked for by hand."""
    named = compose(["experiment=fig5", "pressure=510", "sintering=none"])
    assert runs.identify(named) == runs.identify(compose(["pressure=510", "sintering=none"]))


def test_what_is_saved_is_what_is_opened(small_run, small_config, tmp_path):
    """Every variable with its unit, by id, folder and file; the row of numbers is the same."""
    config = small_config.model_copy(update={"store": str(tmp_path)})
    path = runs.save(small_run, config, wall_seconds=1.5)
    assert [p.name for p in path.parent.iterdir()] == ["run.nc"]
    assert runs.is_done(config)
    for name in (runs.identify(config), path.parent, path):
        with open_run(name, tmp_path) as opened:
            xr.testing.assert_equal(opened.load(), small_run)
            assert all(opened[v].attrs["units"] and opened[v].attrs["long_name"] for v in opened.variables)
            assert opened.attrs["git_state"] and opened.attrs["versions"] and opened.attrs["machine"]
            row = summarise(opened)
    assert row["lump_fraction"] == summarise(small_run)["lump_fraction"]
    assert row["seconds"] == 1.5


def test_units_follow_the_reading(small_run):
    """Grid units say cells."""
    assert small_run.velocity.attrs["units"] == "cell s-1"
    assert small_run.young.attrs["units"] == "kg cell-1 s-2"
    assert small_run.kinetic_energy.attrs["units"] == "kg cell2 s-2"
    assert small_run.density.attrs["units"] == "kg cell-3"


def test_a_broken_file_is_not_done(small_run, small_config, tmp_path):
    """A truncated result is no result, and opening it says so."""
    config = small_config.model_copy(update={"store": str(tmp_path)})
    path = runs.save(small_run, config, wall_seconds=1.0)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert not runs.is_done(config)
    with pytest.raises(StoreError, match="cannot be read"):
        open_run(path)


def test_another_runs_file_is_not_done(small_run, small_config, tmp_path):
    """A result in the wrong folder does not count."""
    here = small_config.model_copy(update={"store": str(tmp_path)})
    path = runs.save(small_run, here, wall_seconds=1.0)
    other = here.model_copy(update={"seed": 5})
    runs.run_dir(other).mkdir()
    path.rename(runs.result_path(other))
    assert not runs.is_done(other)


def test_a_failing_write_leaves_nothing(small_run, small_config, tmp_path, monkeypatch):
    """When the disk fills in the middle of a write, neither a result nor scraps remain."""

    def half_a_file(self, path, **_):
        path.write_bytes(b"CDF")
        raise RuntimeError("NetCDF: HDF error")

    monkeypatch.setattr(xr.Dataset, "to_netcdf", half_a_file)
    config = small_config.model_copy(update={"store": str(tmp_path)})
    with pytest.raises(StoreError, match="cannot write"):
        runs.save(small_run, config, wall_seconds=1.0)
    assert list(runs.run_dir(config).iterdir()) == []
    assert not runs.is_done(config)


def test_opening_what_is_not_there(tmp_path):
    with pytest.raises(StoreError, match="there is no run 'nothing'"):
        open_run("nothing", tmp_path)


def test_diagnostics_of_the_small_run(small_run, small_config):
    """Mass never changes; gravity acts from release on; while pressed, momentum stays near zero."""
    assert np.ptp(small_run.total_mass.values) == 0
    press = slice(0, small_config.loading.press_frames)
    scale = float(small_run.total_mass[0] * small_run.top_speed[press].max())
    assert np.abs(small_run.momentum_y[press]).max() < 1e-9 * scale
    weight = float(small_run.total_mass[0]) * small_config.reading.gravity * small_config.loading.frame_time
    fall = np.diff(small_run.momentum_y.values[20:27])
    np.testing.assert_allclose(fall, -weight, rtol=1e-9)
    assert (small_run.gravitational_energy[: small_config.loading.press_frames + 1] == 0).all()


def test_the_package_gives_functions():
    """The names of the Python interface are functions, whatever was imported before."""
    import snowrepro

    assert all(callable(getattr(snowrepro, name)) for name in snowrepro.__all__)
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = snowrepro.simulat
