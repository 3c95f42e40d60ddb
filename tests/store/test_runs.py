"""Identity and files: the same run has one id, and a result is whole or absent."""

import functools
import gc
import json
import shutil

import numpy as np
import pytest
import xarray as xr

from snowrepro import open_run, summarise
from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError, StoreError
from snowrepro.settings.case import Case
from snowrepro.store import folders, identity
from snowrepro.store.find import find_id, find_result
from snowrepro.store.identity import canonical, run_id
from snowrepro.store.run import Run
from tests.configs import changed


def id_of(*overrides: str) -> str:
    """The id of the run that these ask for."""
    return Run(compose(overrides)).id


def test_any_spelling_gives_the_same_id():
    """Order, defaults said aloud, number formats, and what is not physics do not enter."""
    plain = id_of("pressure=500", "seed=1")
    for spelling in (
        ["seed=1", "shape=ball", "floor=L", "pressure=5e2", "reading=grid_units"],
        ["pressure=500.0", "seed=1", "store=elsewhere", "reports=there", "analysis.break_strain=0.2"],
        ["pressure=500", "seed=1", "reading.gravity=10", "sintering=paper"],
    ):
        assert id_of(*spelling) == plain


@pytest.mark.parametrize(
    "change", ["pressure=501", "seed=2", "sintering=none", "reading.gravity=9.9", "fidelity=preview", "solver.cfl=0.3"]
)
def test_any_physics_gives_another_id(change):
    assert id_of(change) != id_of()


@pytest.mark.parametrize(
    ("overrides", "name"),
    [
        ([], "ball-L-2900-paper-paper-0-8ad59a1c33"),
        (["pressure=2000"], "ball-L-2000-paper-paper-0-278efe3b0c"),
        (["pressure=740", "seed=3"], "ball-L-740-paper-paper-3-ec3cb67084"),
        (["shape=star", "floor=stair3", "sintering=none", "pressure=3300"], "star-stair3-3300-none-paper-0-baffc63a20"),
        (["pressure=2000", "reading=si"], "ball-L-2000-paper-paper-0-933b2318b6"),
        (["pressure=2000", "indenter=disc"], "ball-L-2000-paper-paper-0-disc-d499d30e4d"),
        (
            ["pressure=2000", "indenter=disc", "loading.frames=400", "indenter.speed=0.5"],
            "ball-L-2000-paper-paper-0-disc-64841a8ce1",
        ),
        (["pressure=2000", "solver=pic_flip", "fidelity=preview"], "ball-L-2000-paper-preview-0-a5f0f0a1cc"),
        (["pressure=2000", "solver=cuda", "threads=4"], "ball-L-2000-paper-paper-0-7dd5360f5c"),
        (["pressure=2000", "material.E=1e5", "sintering.C3=-0.0"], "ball-L-2000-paper-paper-0-07080b713a"),
        (["pressure=2000", "sintering.C3=0.0", "material.E=1e5"], "ball-L-2000-paper-paper-0-a2fdb7eeef"),
        (["experiment=hardness", "indenter=disc", "pressure=1e-7"], "ball-L-1e-07-paper-paper-0-disc-c45a140926"),
    ],
)
def test_ids_stay(overrides, name):
    """A store is searched by them for years.  Where MODEL_VERSION goes up, they are others."""
    case = compose(overrides).case
    assert run_id(case, 5) == name
    physics = case.model_dump(mode="json")
    if case.indenter:
        del physics["loading"]["frames"], physics["loading"]["rest"]
    else:
        del physics["indenter"]
    whole = json.dumps({"model_version": 5, **physics}, sort_keys=True, separators=(",", ":"))
    assert canonical(case, 5) == whole


def test_ids_remember_no_section_that_is_gone():
    """Their texts are kept by address, which another section may have later."""
    names = set()
    for value in range(200):
        case = case_of(gravity=float(value))
        names.add(run_id(case))
        del case
    assert len(names) == 200
    default = compose([]).case
    run_id(default)  # so that the last one asked for is another
    gc.collect()
    kept = len(identity._texts)
    case = case_of(gravity=1000.0)
    run_id(case)
    assert len(identity._texts) > kept
    del case
    run_id(default)
    gc.collect()
    assert len(identity._texts) == kept


def case_of(gravity: float) -> Case:
    """A case in which no section but the reading is new, composed once."""
    base = _base().case
    return base.model_copy(update={"reading": base.reading.model_copy(update={"gravity": gravity})})


_base = functools.cache(compose)


def test_experiments_share_runs():
    """A run of an experiment is the same run when asked for by hand."""
    assert id_of("experiment=fig5", "pressure=510", "sintering=none") == id_of("pressure=510", "sintering=none")


def test_what_is_saved_is_what_is_opened(small_run, small_config, tmp_path):
    """Every variable with its unit, by id, an end of it, folder and file; the row of numbers is the same."""
    run = Run(changed(small_config, store=str(tmp_path)))
    path = run.save(small_run, wall_seconds=1.5)
    assert {p.name for p in path.parent.iterdir()} == {"run.nc", "manifest.json"}
    assert run.is_done()
    for name in (run.id, run.id[-6:], run.id[:6], path.parent, path):
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
    run = Run(changed(small_config, store=str(tmp_path)))
    path = run.save(small_run, wall_seconds=1.0)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert not run.is_done()
    with pytest.raises(StoreError, match="cannot be read"):
        open_run(path)


def test_another_runs_file_is_not_done(small_run, small_config, tmp_path):
    """A result in the wrong folder does not count."""
    here = Run(changed(small_config, store=str(tmp_path)))
    path = here.save(small_run, wall_seconds=1.0)
    other = Run(changed(here.config, seed=5))
    other.folder.mkdir()
    path.rename(other.result)
    assert not other.is_done()


def test_a_failing_write_leaves_nothing(small_run, small_config, tmp_path, monkeypatch):
    """When the disk fills in the middle of a write, neither a result nor scraps remain."""

    def half_a_file(self, path, **_):
        path.write_bytes(b"CDF")
        raise RuntimeError("NetCDF: HDF error")

    monkeypatch.setattr(xr.Dataset, "to_netcdf", half_a_file)
    run = Run(changed(small_config, store=str(tmp_path)))
    with pytest.raises(StoreError, match="cannot write"):
        run.save(small_run, wall_seconds=1.0)
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]
    assert not run.folder.exists()
    assert not run.is_done()


def test_opening_what_is_not_there(tmp_path):
    for name in ("nothing", ""):
        with pytest.raises(StoreError, match=f"there is no run '{name}'"):
            open_run(name, tmp_path)


def test_an_end_of_several_ids_opens_none(tmp_path):
    """They are named, the first of them; a folder without a result is no run."""
    for name in ("ball-1", "ball-2", "ball-3", "star-1"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "run.nc").touch()
    (tmp_path / "star-2").mkdir()
    with pytest.raises(ConfigError, match=r"'ball' should name one run of the store '.*'; 3 runs are: ball-1, ball"):
        open_run("ball", tmp_path)
    assert find_result("star", tmp_path) == tmp_path / "star-1" / "run.nc"
    many = [f"run-{number:02}" for number in range(12)]
    with pytest.raises(ConfigError, match=r"12 runs are: run-00, .*, run-09 and 2 more$"):
        find_id("run", many, tmp_path)


def test_diagnostics_of_the_small_run(small_run, small_config):
    """Mass never changes; gravity acts from release on; while pressed, momentum stays near zero."""
    assert np.ptp(small_run.total_mass.values) == 0
    press = slice(0, small_config.case.loading.press_frames)
    scale = float(small_run.total_mass[0] * small_run.top_speed[press].max())
    assert np.abs(small_run.momentum_y[press]).max() < 1e-9 * scale
    weight = float(small_run.total_mass[0]) * small_config.case.reading.gravity * small_config.case.loading.frame_time
    fall = np.diff(small_run.momentum_y.values[20:27])
    np.testing.assert_allclose(fall, -weight, rtol=1e-9)
    assert (small_run.gravitational_energy[: small_config.case.loading.press_frames + 1] == 0).all()


def test_the_package_gives_functions():
    """The names of the Python interface are functions, whatever was imported before; beside them is the version."""
    import snowrepro

    names = set(snowrepro.__all__) - {"__version__"}
    assert all(callable(getattr(snowrepro, name)) for name in names)
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = snowrepro.simulat


def test_who_was_taken_for_dead_publishes_nothing(small_run, small_config, tmp_path):
    """Stopped just before publishing, and awake when another process has taken over, or is done."""
    run = Run(changed(small_config, store=str(tmp_path)))
    folder = run.prepare_result()
    assert not run.adopt(), "it is empty"
    with pytest.raises(StoreError, match="cannot write"):
        run.save(small_run, folder=folder)
    assert not run.folder.exists()
    stopped = run.prepare_result()
    run.save(small_run, wall_seconds=1.0)
    other = Run(changed(small_config, store=str(tmp_path)))
    other.adopt()
    before = {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in run.folder.iterdir()}
    with pytest.raises(StoreError, match="cannot write"):
        run.save(small_run, folder=stopped, wall_seconds=2.0)
    assert {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in run.folder.iterdir()} == before


def test_a_result_whose_replacement_is_gone_stays(small_run, small_config, tmp_path, monkeypatch):
    """Between putting the old one aside and moving the new one there."""
    run = Run(changed(small_config, store=str(tmp_path)))
    run.save(small_run, wall_seconds=1.0)
    before = run.result.read_bytes()
    real = folders._put_aside

    def put_aside(folder):
        aside = real(folder)
        shutil.rmtree(next(run.work.glob("result.*")))
        return aside

    monkeypatch.setattr(folders, "_put_aside", put_aside)
    with pytest.raises(StoreError, match="cannot write"):
        run.save(small_run, wall_seconds=2.0)
    assert run.is_done() and run.result.read_bytes() == before


@pytest.mark.parametrize("damage", ["a number", "cut"])
def test_a_result_beside_a_damaged_manifest_is_not_opened(small_run, small_config, tmp_path, damage):
    """Nobody knows any more what the result should be."""
    run = Run(changed(small_config, store=str(tmp_path)))
    run.save(small_run, wall_seconds=1.0)
    path = run.folder / "manifest.json"
    text = path.read_text()
    path.write_text(text.replace('"wall_seconds": 1.0', '"wall_seconds": 2.0') if damage == "a number" else text[:200])
    assert path.read_text() != text
    with pytest.raises(StoreError, match=r"manifest\.json is not as it was written"):
        open_run(run.id, tmp_path)
