"""A run redone from its manifest: same bits, or what differs; the command line, and the disk afterwards."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from snowrepro.cli import main
from snowrepro.composition.compose import compose, config_from
from snowrepro.store import manifest
from snowrepro.store.bits import digests
from snowrepro.store.find import open_run
from snowrepro.store.run import Run
from tests import command_line
from tests.configs import carrying, changed
from tests.conftest import SMALL


@pytest.fixture
def made(small_run, tmp_path):
    """Store the small run, or a changed one, as another machine would have; returns its folder, not that of a test."""

    def stored(dataset: xr.Dataset = small_run) -> Path:
        run = Run(compose([*SMALL, "pressure=3000", f"store={tmp_path}/elsewhere/runs"]))
        return run.save(carrying(dataset, run.config), wall_seconds=1.0).parent

    return stored


@pytest.fixture(scope="module")
def redone(small_run, small_config, tmp_path_factory) -> tuple[subprocess.CompletedProcess, Path]:
    """The small run redone once, from the manifest alone, in a folder without anything else; what was said."""
    place = tmp_path_factory.mktemp("redo")
    run = Run(changed(small_config, store=str(tmp_path_factory.mktemp("elsewhere"))))
    path = alone(run.save(small_run, wall_seconds=1.0).parent, place)
    return command_line.run("redo", path.name, cwd=place), place


@pytest.fixture
def redo(redone, tmp_path, monkeypatch, capsys):
    """Compare with what was redone once; returns a function from arguments to exit code, output and errors."""

    def call(*arguments: str) -> tuple[int, list[str], str]:
        into = () if "--into" in arguments else ("--into", str(redone[1] / "redone"))
        monkeypatch.chdir(tmp_path)
        with pytest.raises(SystemExit) as ended:
            main(["redo", *arguments, *into])
        said = capsys.readouterr()
        return ended.value.code, said.out.splitlines(), said.err

    return call


def alone(folder: Path, place: Path, **changes) -> Path:
    """A manifest without anything beside it, with ``changes`` and the checksum of what it says now."""
    said = {**json.loads((folder / "manifest.json").read_text()), **changes}
    said = {key: value for key, value in said.items() if value is not None}
    said["checksum"] = manifest._checksum({key: value for key, value in said.items() if key != "checksum"})
    place.mkdir(exist_ok=True)
    (place / "manifest.json").write_text(json.dumps(said))
    return place / "manifest.json"


def test_checksums_of_arrays_are_of_bits_alone(made, small_run):
    """The same from memory, from the file, in any byte order; one bit, one type or one dimension makes another."""
    folder = made()
    expected = manifest.read(folder)["arrays"]
    with open_run(folder) as opened:
        assert digests(opened) == expected == digests(small_run)
    assert set(expected) == set(map(str, small_run.variables))
    swapped = small_run.assign(density=small_run["density"].astype(">f4"))
    assert digests(swapped) == expected
    zero = small_run.copy(deep=True)
    zero["damping_work"].values[0] = -zero["damping_work"].values[0]
    others = {
        "damping_work": zero,
        "mass": small_run.assign(mass=small_run["mass"].astype(np.float32)),
        "volume": small_run.assign(volume=small_run["volume"].expand_dims("one")),
        "axis": small_run.assign_coords(axis=["x", "z"]),
    }
    for name, other in others.items():
        assert {key for key, value in digests(other).items() if value != expected[key]} == {name}


def test_the_same_bits_from_the_manifest_alone(redone, small_run, small_config):
    """In an empty folder, into a store of its own that says what it is."""
    done, place = redone
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == f"the same bits: {len(small_run.variables)} arrays"
    assert sorted(path.name for path in place.iterdir()) == ["manifest.json", "redone"]
    result = place / "redone" / Run(small_config).id
    assert {"run.nc", "run.log", "manifest.json"} <= {path.name for path in result.iterdir()}
    assert manifest.read(result)["command"] == "snowrepro redo manifest.json"


def test_the_same_bits_by_the_result(redone, redo, made):
    """By an end of the id, in a store; what was redone is not simulated again."""
    folder = made()
    written = [path.stat().st_mtime_ns for path in redone[1].glob("redone/*/run.nc")]
    code, lines, errors = redo(folder.name[-6:], "--store", "elsewhere/runs")
    assert code == 0 and "the same bits" in lines[-1]
    assert "this run is done" in errors
    assert [path.stat().st_mtime_ns for path in redone[1].glob("redone/*/run.nc")] == written


def test_other_bits_are_named(redo, made, small_run, tmp_path):
    """By the checksums alone, and by how much where the result is beside; so is what made them."""
    other = small_run.copy(deep=True)
    other["density"].values[5:] *= 1.5
    folder = made(other)
    arrays = len(small_run.variables)
    path = alone(folder, tmp_path / "alone", environment={"python": "2.7"}, git_state="deadbeef")
    code, lines, _ = redo(str(path))
    assert code == 1
    assert lines[-1] == f"not the same bits: 1 of {arrays} arrays"
    assert "  density: other bits than the manifest says" in lines
    assert "by how much cannot be told: run.nc as the manifest describes it is not beside it" in lines
    assert any(line.startswith("  environment.python: 2.7 -> ") for line in lines)
    assert any(line.startswith("  git_state: deadbeef -> ") for line in lines)
    code, lines, _ = redo(str(folder))
    assert code == 1
    frame = int(small_run["snapshot"][5])
    assert any(re.match(rf"  density: by at most \d+.*, first in frame {frame}$", line) for line in lines)
    assert not any("by how much" in line for line in lines)


def test_a_tampered_checksum_of_an_array_is_named(redo, made, tmp_path):
    """Also where the result is beside and agrees; and an array that is lost or new."""
    folder = made()
    arrays = manifest.read(folder)["arrays"]
    other = {**arrays, "position": "0" * 64, "temperature": "0" * 64}
    del other["volume"]
    path = alone(folder, tmp_path / "alone", arrays=other)
    for _ in range(2):
        code, lines, _ = redo("alone")
        assert code == 1
        assert "  position: other bits than the manifest says" in lines
        assert "  temperature: lost" in lines and "  volume: new" in lines
        assert lines[-1] == f"not the same bits: 3 of {len(arrays) + 1} arrays"
        shutil.copy(folder / "run.nc", path.parent)


def test_an_older_manifest(redone, redo, made, tmp_path):
    """Without checksums of arrays: compared with the result if that is there; else 4 says that it is redone alone."""
    folder = made()
    path = alone(folder, tmp_path / "alone", arrays=None, packages=None, began=None, command=None)
    code, lines, _ = redo("alone/manifest.json")
    assert code == 4
    assert lines[-1].startswith("nothing to compare with: no run.nc")
    assert f"redone: {redone[1]}/redone/{folder.name}/run.nc" in lines
    shutil.copy(folder / "run.nc", path.parent)
    assert redo("alone")[0] == 0
    (path.parent / "run.nc").write_bytes(b"another file")
    assert redo("alone")[0] == 4


def test_what_cannot_be_redone_is_refused(redo, made, tmp_path):
    """One line, exit code 2, nothing on the disk."""
    folder = made()
    path = alone(folder, tmp_path / "alone")
    (tmp_path / "cut.json").write_text(path.read_text()[:500])
    (tmp_path / "edited.json").write_text(path.read_text().replace('"pressure": 3000.0', '"pressure": 3001.0'))
    config = manifest.read(folder)["config"]
    newer = alone(folder, tmp_path / "newer", config={**config, "wind": 3.0})
    bare = alone(folder, tmp_path / "bare", config=None)
    other = alone(folder, tmp_path / "other", config={**config, "pressure": 3001.0})
    before = sorted(tmp_path.rglob("*"))
    for arguments, message in (
        (["nothing"], "'nothing' should name one run of the store 'runs'; no run is"),
        (["cut.json"], "cut.json is missing or cannot be read"),
        (["edited.json"], "edited.json is not as it was written: its checksum differs"),
        ([str(newer)], "not of this version: there is no setting 'wind'"),
        ([str(bare)], "is no manifest of a run"),
        ([str(other)], "is of another run: its configuration has the id "),
        ([str(path), "--into", "runs"], "is the store, in which nothing is to be replaced"),
        ([str(path), "--into", "elsewhere/runs"], "the run itself is in 'elsewhere/runs'"),
        ([str(path), "--into", "/proc/nowhere"], "cannot write into the folder '/proc/nowhere"),
    ):
        code, lines, errors = redo(*arguments)
        assert code == 2, arguments
        assert message in errors
        assert errors.count("\n") == 1 and lines == []
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.nightly
def test_a_run_that_now_diverges(snowrepro, made, tmp_path):
    """Exit code 3 with the reason, and no verdict."""
    folder = made()
    config = {**manifest.read(folder)["config"], "pressure": 1e9}
    alone(folder, tmp_path / "alone", config=config, run_id=Run(config_from(config)).id)
    found = snowrepro("redo", "alone")
    assert found.returncode == 3
    assert "error: diverged in frame" in found.stderr and "Traceback" not in found.stderr
    assert found.stdout == ""
    assert not list(tmp_path.glob("redone/*/run.nc"))


@pytest.mark.nightly
def test_a_drawn_shape_without_its_drawing(snowrepro, tmp_path):
    """What was simulated is the polygon, and the manifest has it; also what asked for it, and with which packages."""
    (tmp_path / "drop.svg").write_text('<svg><path d="M0,0 L8,0 8,6 3,9 0,6 Z"/></svg>')
    options = tmp_path / "conf" / "shape"
    options.mkdir(parents=True)
    (options / "drop.yaml").write_text("name: drop\noutline: {kind: svg, file: drop.svg, width: 30}\n")
    made = snowrepro("run", "-m", "shape=drop", "pressure=700", *SMALL)
    assert made.returncode == 0, made.stderr
    (folder,) = tmp_path.glob("runs/drop-*")
    said = json.loads(alone(folder, tmp_path / "alone").read_text())
    assert said["command"].startswith(f"snowrepro run shape=drop pressure=700 {SMALL[0]} ")
    assert str(tmp_path) not in said["command"]
    assert said["began"] <= said["created"]
    assert {"numpy", "taichi", "netcdf4", "pydantic", "hydra-core"} <= said["packages"].keys()
    assert "unknown" not in said["packages"].values()
    for path in (tmp_path / "conf", tmp_path / "runs"):
        shutil.rmtree(path)
    (tmp_path / "drop.svg").unlink()
    found = snowrepro("redo", "alone")
    assert found.returncode == 0, found.stderr
    assert "the same bits" in found.stdout
