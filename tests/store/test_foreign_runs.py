"""Runs, checkpoints and leases that somebody else made, or that were damaged: what is used, and what is said."""

import json
import os
import shutil
import zipfile

import numpy as np
import pytest

from snowrepro.composition.compose import compose
from snowrepro.errors import StoreError
from snowrepro.foreign import Unreadable
from snowrepro.store import lease, leftovers, manifest, states
from snowrepro.store.files import write_json
from snowrepro.store.run import CHECKPOINT, BrokenResult, Run
from tests.configs import changed
from tests.conftest import SMALL

ARRAYS = {
    "frame": np.array(3),
    "seconds": np.array(1.0),
    "position": np.arange(10.0).reshape(5, 2),
    "row x": np.zeros(0),
}


@pytest.fixture
def run(tmp_path) -> Run:
    return Run(compose([*SMALL, "pressure=3000", f"store={tmp_path}/store"]))


def other(run: Run, **settings) -> Run:
    return Run(changed(run.config, **settings))


def test_a_checkpoint_is_read_as_it_was_written(run):
    """Types, shapes and bits."""
    run.save_checkpoint(ARRAYS)
    read = run.load_checkpoint()
    assert read.keys() == ARRAYS.keys()
    assert all((read[k] == v).all() and (read[k].dtype, read[k].shape) == (v.dtype, v.shape) for k, v in ARRAYS.items())


def test_a_checkpoint_of_another_run_is_not_used(run):
    """Wherever it lies."""
    run.save_checkpoint(ARRAYS)
    foreign = other(run, seed=9)
    foreign.work.mkdir(parents=True)
    shutil.copy(run.work / CHECKPOINT, foreign.work / CHECKPOINT)
    with pytest.raises(Unreadable, match=f"is of another run, {run.id}"):
        foreign.load_checkpoint()
    assert foreign.checkpoint() is None


def _change_an_array(path):
    with np.load(path) as saved:
        arrays = {name: saved[name] for name in saved.files}
    arrays["position"][0, 0] += 1
    with path.open("wb") as file:
        np.savez(file, **arrays)


def _pack(path):
    """As a bomb would be: a packed archive may be a thousand times larger than its file."""
    with np.load(path) as saved:
        arrays = {name: saved[name] for name in saved.files}
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays)


def _claim_more(path):
    """An array that says that it has more numbers than there are."""
    content = path.read_bytes().replace(b"'shape': (5, 2)", b"'shape': (5,99)")
    path.write_bytes(content)


def _leave_out_the_id(path):
    """As older versions wrote it."""
    with path.open("wb") as file:
        np.savez(file, **ARRAYS, made_by=np.array(manifest.code_digest()))


def _pickle(path):
    with path.open("wb") as file:
        np.savez(file, evil=np.array([{}], dtype=object))


@pytest.mark.parametrize(
    ("harm", "reason"),
    [
        (_change_an_array, "its checksum differs"),
        (_pack, "is packed"),
        (_claim_more, "is not as it was written"),
        (_leave_out_the_id, "an older version made it"),
        (_pickle, "is not as it was written"),
        (lambda path: path.write_bytes(b"PK\x03\x04"), "is not as it was written"),
        (lambda path: os.truncate(path, path.stat().st_size // 2), "is not as it was written"),
        (lambda path: os.truncate(path, 5 << 30), "may have"),
        (lambda path: (path.unlink(), os.mkfifo(path)), "is no regular file"),
        (lambda path: (path.rename(path.with_name("x")), path.symlink_to(path.with_name("x"))), "is a link"),
    ],
)
def test_a_damaged_checkpoint_is_not_used(run, harm, reason):
    """And its reason is said."""
    run.save_checkpoint(ARRAYS)
    harm(run.work / CHECKPOINT)
    with pytest.raises(Unreadable, match=reason):
        run.load_checkpoint()


def test_a_run_begins_anew_without_its_checkpoint_and_says_so_once(run, small_run, monkeypatch, caplog):
    """Also with one that says whose it is, and holds nothing of the scene: what is published is this run's own."""
    from snowrepro import run as running

    seen = []
    monkeypatch.setattr(
        running, "simulate", lambda config, watch, resume: seen.append(resume) or _begin(small_run, resume)
    )
    run.save_checkpoint({"frame": np.array(3), "seconds": np.array(1.0)})
    running.do_run(run)
    assert [resume is None for resume in seen] == [False, True] and run.is_done()
    assert caplog.text.count("begins anew") == 1
    caplog.clear()
    foreign = other(run, seed=9)
    run.save_checkpoint(ARRAYS)
    foreign.work.mkdir(parents=True)
    shutil.copy(run.work / CHECKPOINT, foreign.work / CHECKPOINT)
    running.do_run(foreign)
    assert seen[-1] is None and caplog.text.count("begins anew: checkpoint.npz is of another run") == 1


def _begin(dataset, resume):
    """As the simulation does with a checkpoint that lacks what it needs."""
    return dataset if resume is None else resume["position"]


def test_a_result_that_says_to_be_another_runs_is_broken(run, small_run):
    """A manifest whose id is right and whose configuration is another's, with a checksum that holds."""
    folder = run.save(small_run).parent
    foreign = other(run, seed=9)
    shutil.copytree(folder, foreign.folder)
    content = json.loads((folder / "manifest.json").read_text())
    forged = {**{key: value for key, value in content.items() if key != "checksum"}, "run_id": foreign.id}
    write_json(foreign.folder / "manifest.json", {**forged, "checksum": manifest._checksum(forged)})
    found = states.standing(foreign)
    assert (found.state, found.reason) == (
        "broken",
        "manifest.json is of another run: its configuration has another id",
    )
    forged["config"] = foreign.config.record()
    write_json(foreign.folder / "manifest.json", {**forged, "checksum": manifest._checksum(forged)})
    assert states.standing(foreign).state == "done"  # a lie that only 'snowrepro redo' finds out


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("outcome.json", {"message": "x", "final": False}, "outcome.json cannot be read: state: field required"),
        ("outcome.json", {"state": "done", "message": "x"}, "outcome.json cannot be read: state:"),
        ("outcome.json", [1], "outcome.json cannot be read: it holds no dictionary but a list"),
    ],
)
def test_an_odd_outcome_is_a_broken_run(run, name, content, reason):
    """Named with the reason; it is run again, and can be cleaned away."""
    write_json(run.work / name, content)
    found = states.standing(run)
    assert found.state == "broken" and found.reason.startswith(reason)
    assert [left.path for left in leftovers.find("broken", run.store, ())] == [run.work]


def test_keys_that_are_not_ours_are_left_out(run):
    """Of a lease, an outcome and a progress; as another version may write them."""
    run.save_outcome("failed", "x", final=True)
    write_json(run.work / "outcome.json", {**json.loads((run.work / "outcome.json").read_text()), "more": 1})
    assert states.standing(run).final
    write_json(run.work / "lease.1", {**vars(lease.here()), "more": 1})
    write_json(run.work / "progress.json", {"frame": 3, "frames": 60, "substeps": 1, "more": {}})
    assert states.standing(run).reason.endswith("frame 3 of 60")


@pytest.mark.parametrize("content", [{"host": 1}, {"pid": -1, "host": "h", "place": "p"}, {"pid": 2**80}, {"x": 1}])
def test_a_lease_of_nobody_is_not_waited_for(run, content):
    write_json(run.work / "lease.4", content)
    assert states.standing(run).state == "interrupted"
    taken = lease.take(run.work)
    assert taken is not None and taken.generation == 5
    taken.release()


def test_a_result_is_read_as_a_whole_before_it_is_used(run, small_run):
    """A byte that changed behind size and time: it is done until somebody opens it, and broken from then on."""
    path = run.save(small_run)
    times, content = path.stat(), bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    assert run.is_done()
    with pytest.raises(BrokenResult, match=r"run\.nc is not as it was written"):
        run.open()
    assert states.standing(run).state == "broken"
    run.save(small_run)
    assert states.standing(run).state == "done" and run.open().sizes == small_run.sizes


def test_a_result_larger_than_its_scene_is_not_read(run, small_run):
    """However little room it takes on the disk."""
    run.save(small_run.isel(particle=np.zeros(10 * small_run.sizes["particle"], dtype=int)))
    with pytest.raises(BrokenResult, match=r"particles, and its scene at most"):
        run.open()


def test_nothing_is_removed_through_a_link(run, small_run, tmp_path):
    """A linked trash, run folder and half-written file, and a link inside a run's folder."""
    outside = tmp_path / "outside"
    for name in ("trash", "run", "inner"):
        (outside / name).mkdir(parents=True)
        (outside / name / "kept.part").write_text("kept")
    folder = run.save(small_run).parent
    (folder / "inner").symlink_to(outside / "inner")
    os.truncate(folder / "run.nc", 5)
    (run.store / "linked").symlink_to(outside / "run")
    (run.store / ".trash").symlink_to(outside / "trash")
    found = {kind: leftovers.find(kind, run.store, ()) for kind in leftovers.KINDS}
    assert {left.path for several in found.values() for left in several} == {folder}
    assert leftovers.links(run.store) == [run.store / ".trash", run.store / "linked"]
    with pytest.raises(StoreError, match="trash is a link"):
        found["broken"][0].remove()
    (run.store / ".trash").unlink()
    found["broken"][0].remove()
    assert not folder.exists()
    assert sorted(path.name for path in outside.rglob("*.part")) == ["kept.part"] * 3


def test_what_is_derived_is_of_its_own_result(run, small_run, tmp_path):
    """A row that another run's folder had, or that somebody changed, is computed anew; so are bonds."""
    from snowrepro.summary.columns import SCALE_COLUMNS
    from snowrepro.summary.row import make_key, read_bonds, read_row

    run.save(small_run, wall_seconds=2.0, seconds_per_frame=0.1)
    row, bonds, key = read_row(run), read_bonds(run), make_key(run.config.question.analysis)
    stored = {name: value for name, value in row.items() if name not in SCALE_COLUMNS}  # these are not stored
    assert run.row(key) == stored and run.analysis(key).equals(bonds)
    foreign = other(run, seed=9)
    foreign.save(small_run)
    for name in ("summary.json", "analysis.nc"):
        shutil.copy(run.folder / name, foreign.folder / name)
    assert foreign.row(key) is None and foreign.analysis(key) is None
    content = json.loads((run.folder / "summary.json").read_text())
    write_json(run.folder / "summary.json", {**content, "row": {**row, "lump_fraction": 0.9}})
    assert run.row(key) is None
    assert read_row(run) == row and run.row(key) == stored
    zipped = run.folder / "analysis.nc"
    with zipfile.ZipFile(zipped, "w") as file:
        file.writestr("x", "x")
    assert run.analysis(key) is None and read_bonds(run).equals(bonds)
