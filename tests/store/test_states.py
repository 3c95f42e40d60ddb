"""Where a run stands, for everything that can be on the disk; and what a result is older than."""

import json
import os
from pathlib import Path

import pytest

from snowrepro.composition import compose
from snowrepro.config import Config
from snowrepro.store import lease, leftovers, manifest, runs, states
from snowrepro.store.files import write_json
from tests.conftest import SMALL


@pytest.fixture
def config(tmp_path) -> Config:
    return compose([*SMALL, "pressure=3000", f"store={tmp_path}/store"])


@pytest.fixture
def done(config, small_run) -> Path:
    """The folder of a finished run."""
    return runs.save(small_run, config, wall_seconds=2.0, seconds_per_frame=0.01).parent


def state(config: Config, thorough: bool = False) -> tuple[str, str]:
    """What a sweep sees of a run; the same as what is seen of it alone."""
    (found,) = states.standings([config], thorough)
    assert found == states.standing(config, thorough)
    return found.state, found.reason


def test_a_run_from_nothing_to_done(config, small_run):
    """Never run; held; stopped with a checkpoint; held again; done."""
    assert state(config) == ("pending", "never run")
    work = runs.work_dir(config)
    with lease.held(work):
        runs.save_progress(config, 30, 60, 17)
        assert state(config)[0] == "running"
        assert state(config)[1].endswith("frame 30 of 60")
        runs.save_checkpoint(config, {})
        runs.save_outcome(config, "interrupted", "stopped in frame 31")
    assert state(config) == ("interrupted", "stopped in frame 31, kept a checkpoint")
    with lease.held(work):
        runs.save(small_run, config, wall_seconds=2.0)
        runs.discard(work)
    assert state(config)[0] == "done"
    assert not work.exists()


def test_failures(config):
    """For good until the code changes, or not for good; in the words of whoever recorded it."""
    runs.save_outcome(config, "failed", "diverged in frame 3", final=True)
    (found,) = states.standings([config])
    assert (found.state, found.reason, found.final) == ("failed", "diverged in frame 3", True)
    said = json.loads((runs.work_dir(config) / "outcome.json").read_text())
    write_json(runs.work_dir(config) / "outcome.json", {**said, "made_by": "other code"})
    assert not states.standing(config).final
    runs.save_outcome(config, "timed out", "stopped after 60 s, its time limit")
    assert state(config) == ("timed out", "stopped after 60 s, its time limit")
    assert not states.standing(config).final


def test_whoever_died_after_the_last_word_counts(config):
    """A failure is old news once another attempt was killed."""
    runs.save_outcome(config, "failed", "no room")
    write_json(runs.work_dir(config) / "lease.3", {**vars(lease.here()), "pid": 2**22 + 1})
    assert state(config) == ("interrupted", f"process {2**22 + 1} on {lease.here().host} died")


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
def test_a_broken_result_is_none(config, done, small_run, name, harm, reason):
    """It is found, said, not counted as done; and replaced by the next one that is made."""
    assert runs.is_done(config)
    harm(done / name)
    if name == "manifest.json" and (done / name).exists() and reason.endswith("read"):
        (done / name).write_text("{half")
    assert state(config)[0] == "broken" and state(config)[1].startswith(reason)
    assert not runs.is_done(config)
    runs.save(small_run, config)
    assert state(config)[0] == "done"
    assert not list(Path(config.store).glob(".trash/*"))


def test_a_changed_byte_is_found_by_who_reads_it_all(config, done):
    """Size and time are those of the manifest: only a thorough look sees it."""
    _flip(done / "run.nc")
    assert state(config)[0] == "done"
    assert state(config, thorough=True) == ("broken", "run.nc is not as it was written: its checksum differs")


def test_a_copied_store_is_whole(config, done, tmp_path):
    """Other times of files, the same content."""
    for path in done.iterdir():
        os.utime(path, (1e9, 1e9))
    assert state(config)[0] == "done"


def test_another_runs_result_is_not_done(config, done):
    """A folder under the wrong name."""
    other = config.model_copy(update={"seed": 5})
    os.rename(done, runs.run_dir(other))
    assert state(other) == ("broken", f"manifest.json is that of {runs.identify(config)}")


def test_a_result_that_was_about_to_be_published_is(config, done):
    """The process died between the last byte and the rename: nothing is computed again."""
    work = runs.work_dir(config)
    work.mkdir(parents=True, exist_ok=True)
    os.rename(done, work / "result.abc")
    (work / "result.half").mkdir()
    assert not runs.is_done(config)
    assert runs.adopt(config)
    assert runs.is_done(config)
    os.rename(done, work / "result.abc")
    _truncate(work / "result.abc" / "run.nc")
    assert not runs.adopt(config)
    assert not list(work.glob("result.*"))


def test_by_what_a_result_is_stale(config, done):
    """Each kind with what differs; it is run again where the kind is selected, and not else."""
    assert states.standing(config).stale == {}

    def changed(content):
        content["config"]["threads"] = 2
        content["code"]["mpm/steps.py"] = "0"
        content["environment"]["taichi"] = "1.7.3"
        content["checksum"] = manifest._checksum({k: v for k, v in content.items() if k != "checksum"})

    _rewrite(changed)(done / "manifest.json")
    taichi = manifest.environment()["taichi"]
    assert states.standing(config).stale == {
        "config": "threads 2 -> 1",
        "code": "mpm/steps.py changed",
        "environment": f"taichi 1.7.3 -> {taichi}",
    }
    for chosen, current in (((), True), (("code",), False), (("config", "environment"), False)):
        assert runs.is_current(config.model_copy(update={"rerun": chosen})) == current
    assert runs.is_done(config)


def test_the_code_that_counts_is_the_solvers():
    """Reports and documents make nothing stale."""
    assert {"mpm/steps.py", "physics/sintering.py", "simulation.py", "config.py"} <= set(manifest.CODE)
    assert not any(name.startswith(("report", "analysis", "sweep", "cli", "store")) for name in manifest.CODE)


def test_leftovers_are_told_by_kind(config, done, small_run):
    """Each thing under its own kind, and what is alive under none."""
    store = Path(config.store)
    other = [config.model_copy(update={"seed": seed}) for seed in range(1, 6)]
    runs.save_outcome(other[0], "failed", "diverged", final=True)
    runs.save_outcome(other[1], "interrupted", "stopped")
    runs.save_checkpoint(other[1], {})
    (runs.work_dir(other[1]) / "run.nc.77.part").touch()
    broken = runs.save(small_run, other[2]).parent
    _truncate(broken / "run.nc")
    runs.work_dir(config).mkdir(exist_ok=True)
    (store / ".trash" / "old").mkdir(parents=True)
    (store / "sweep.log").touch()
    (store / "sweeps" / "fig5").mkdir(parents=True)
    with lease.held(runs.work_dir(other[3])):
        found = {kind: {left.path for left in leftovers.find(kind, store, {done.name})} for kind in leftovers.KINDS}
    part = runs.work_dir(other[1]) / "run.nc.77.part"
    assert found == {
        "scraps": {store / ".trash" / "old", runs.work_dir(config), part},
        "failed": {runs.work_dir(other[0])},
        "unfinished": {runs.work_dir(other[1])},
        "broken": {broken},
        "unused": {broken},
        "launchers": {store / "sweep.log"},
    }
    for left in leftovers.find("scraps", store, ()):
        left.remove()
    assert not leftovers.find("scraps", store, ())
    assert runs.is_done(config) and runs.checkpoint(other[1]) is not None
