"""Where a run stands, for everything that can be on the disk; and what a result is older than."""

import json
import os
from pathlib import Path

import pytest

from snowrepro.composition.compose import compose
from snowrepro.store import lease, leftovers, manifest, states
from snowrepro.store.files import write_json
from snowrepro.store.folders import discard
from snowrepro.store.run import Run
from tests.configs import changed
from tests.conftest import SMALL


@pytest.fixture
def run(tmp_path) -> Run:
    return Run(compose([*SMALL, "pressure=3000", f"store={tmp_path}/store"]))


@pytest.fixture
def done(run, small_run) -> Path:
    """The folder of a finished run."""
    return run.save(small_run, wall_seconds=2.0, seconds_per_frame=0.01).parent


def but(run: Run, **settings) -> Run:
    """The same run with other settings."""
    return Run(changed(run.config, **settings))


def state(run: Run, thorough: bool = False) -> tuple[str, str]:
    """What a sweep sees of a run; the same as what is seen of it alone."""
    (found,) = states.standings([run], thorough)
    assert found == states.standing(run, thorough)
    return found.state, found.reason


def test_a_run_from_nothing_to_done(run, small_run):
    """Never run; held; stopped with a checkpoint; held again; done."""
    assert state(run) == ("pending", "never run")
    work = run.work
    with lease.hold_lease(work):
        run.save_progress(30, 60, 17)
        assert state(run)[0] == "running"
        assert state(run)[1].endswith("frame 30 of 60")
        run.save_checkpoint({})
        run.save_outcome("interrupted", "stopped in frame 31")
    assert state(run) == ("interrupted", "stopped in frame 31, kept a checkpoint")
    with lease.hold_lease(work):
        run.save(small_run, wall_seconds=2.0)
        discard(work)
    assert state(run)[0] == "done"
    assert not work.exists()


def test_failures(run):
    """For good until the code changes, or not for good; in the words of whoever recorded it."""
    run.save_outcome("failed", "diverged in frame 3", final=True)
    (found,) = states.standings([run])
    assert (found.state, found.reason, found.final) == ("failed", "diverged in frame 3", True)
    said = json.loads((run.work / "outcome.json").read_text())
    write_json(run.work / "outcome.json", {**said, "made_by": "other code"})
    assert not states.standing(run).final
    run.save_outcome("timed out", "stopped after 60 s, its time limit")
    assert state(run) == ("timed out", "stopped after 60 s, its time limit")
    assert not states.standing(run).final


def test_whoever_died_after_the_last_word_counts(run):
    """A failure is old news once another attempt was killed."""
    run.save_outcome("failed", "no room")
    write_json(run.work / "lease.3", {**vars(lease.here()), "pid": 2**22 + 1})
    assert state(run) == ("interrupted", f"process {2**22 + 1} on {lease.here().host} died")


def _truncate(path: Path) -> None:
    os.truncate(path, path.stat().st_size - 1)


def _flip(path: Path) -> None:
    """Change a byte and keep the time."""
    times = path.stat().st_atime_ns, path.stat().st_mtime_ns
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    os.utime(path, ns=times)


def _rewrite(change):
    def rewrite(path: Path) -> None:
        content = json.loads(path.read_text())
        change(content)
        path.write_text(json.dumps(content))

    return rewrite


@pytest.mark.parametrize(
    ("name", "harm", "reason"),
    [
        ("run.nc", _truncate, "run.nc has "),
        ("run.nc", lambda path: path.unlink(), "run.nc is missing"),
        ("run.nc", lambda path: (_flip(path), os.utime(path)), "run.nc is not as it was written: its checksum differs"),
        ("manifest.json", lambda path: path.unlink(), "manifest.json is missing or cannot be read"),
        ("manifest.json", _truncate, "manifest.json is missing or cannot be read"),
        (
            "manifest.json",
            _rewrite(lambda content: content["files"]["run.nc"].update(sha256="0" * 64)),
            "manifest.json is not as it was written: its checksum differs",
        ),
    ],
)
def test_a_broken_result_is_none(run, done, small_run, name, harm, reason):
    """It is found, said, not counted as done; and replaced by the next one that is made."""
    assert run.is_done()
    harm(done / name)
    if name == "manifest.json" and (done / name).exists() and reason.endswith("read"):
        (done / name).write_text("{half")
    assert state(run)[0] == "broken" and state(run)[1].startswith(reason)
    assert not run.is_done()
    run.save(small_run)
    assert state(run)[0] == "done"
    assert not list(run.store.glob(".trash/*"))


def test_a_changed_byte_is_found_by_who_reads_it_all(run, done):
    """Size and time are those of the manifest: only a thorough look sees it."""
    _flip(done / "run.nc")
    assert state(run)[0] == "done"
    assert state(run, thorough=True) == ("broken", "run.nc is not as it was written: its checksum differs")


def test_a_copied_store_is_whole(run, done, tmp_path):
    """Other times of files, the same content."""
    for path in done.iterdir():
        os.utime(path, (1e9, 1e9))
    assert state(run)[0] == "done"


def test_another_runs_result_is_not_done(run, done):
    """A folder under the wrong name."""
    other = but(run, seed=5)
    os.rename(done, other.folder)
    assert state(other) == ("broken", f"manifest.json is that of {run.id}")


def test_a_result_that_was_about_to_be_published_is(run, done):
    """The process died between the last byte and the rename: nothing is computed again."""
    work = run.work
    work.mkdir(parents=True, exist_ok=True)
    os.rename(done, work / "result.abc")
    (work / "result.half").mkdir()
    assert not run.is_done()
    assert run.adopt()
    assert run.is_done()
    os.rename(done, work / "result.abc")
    _truncate(work / "result.abc" / "run.nc")
    assert not run.adopt()
    assert not list(work.glob("result.*"))


def test_by_what_a_result_is_stale(run, done):
    """Each kind with what differs; it is run again where the kind is selected, and not else."""
    assert states.standing(run).stale == {}

    def changed(content):
        content["config"]["threads"] = 2
        content["code"]["mpm/steps.py"] = "0"
        content["environment"]["taichi"] = "1.7.3"
        content["checksum"] = manifest._checksum({k: v for k, v in content.items() if k != "checksum"})

    _rewrite(changed)(done / "manifest.json")
    taichi = manifest.environment()["taichi"]
    assert states.standing(run).stale == {
        "config": "threads 2 -> 1",
        "code": "mpm/steps.py changed",
        "environment": f"taichi 1.7.3 -> {taichi}",
    }
    for chosen, current in (((), True), (("code",), False), (("config", "environment"), False)):
        assert but(run, rerun=chosen).is_current() == current
    assert run.is_done()


def test_the_code_that_counts_is_the_solvers():
    """Reports and documents make nothing stale; nor does what measures, but for what each frame is asked."""
    assert {"mpm/steps.py", "physics/sintering.py", "simulation.py", "settings/case.py"} <= set(manifest.CODE)
    others = {name for name in manifest.CODE if name.startswith(("report", "analysis", "sweep", "cli", "store"))}
    assert others == {"analysis/clusters.py", "analysis/hardness.py", "analysis/near.py", "analysis/rest.py"}


def test_leftovers_are_told_by_kind(run, done, small_run):
    """Each thing under its own kind, and what is alive under none."""
    store = run.store
    other = [but(run, seed=seed) for seed in range(1, 6)]
    other[0].save_outcome("failed", "diverged", final=True)
    other[1].save_outcome("interrupted", "stopped")
    other[1].save_checkpoint({})
    (other[1].work / "run.nc.77.part").touch()
    broken = other[2].save(small_run).parent
    _truncate(broken / "run.nc")
    run.work.mkdir(exist_ok=True)
    (store / ".trash" / "old").mkdir(parents=True)
    (store / "sweep.log").touch()
    (store / "sweeps" / "fig5").mkdir(parents=True)
    with lease.hold_lease(other[3].work):
        found = {kind: {left.path for left in leftovers.find(kind, store, {done.name})} for kind in leftovers.KINDS}
    part = other[1].work / "run.nc.77.part"
    assert found == {
        "scraps": {store / ".trash" / "old", run.work, part},
        "failed": {other[0].work},
        "unfinished": {other[1].work},
        "broken": {broken},
        "unused": {broken},
        "launchers": {store / "sweep.log"},
    }
    for left in leftovers.find("scraps", store, ()):
        left.remove()
    assert not leftovers.find("scraps", store, ())
    assert run.is_done() and other[1].checkpoint() is not None
