"""A run that was stopped and goes on gives the same bits as one that never stopped."""

import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from snowrepro.composition.compose import compose
from snowrepro.errors import Diverged
from snowrepro.mpm.state import PARTICLE_STATE
from snowrepro.run import do_run, simulate
from snowrepro.store import manifest, states
from snowrepro.store.find import open_run
from snowrepro.store.run import CHECKPOINT, Run
from tests.conftest import SMALL

LONG = ["fidelity=preview", "pressure=3000", "loading.frames=320", "reading.drop_height=20", "checkpoint_seconds=0"]
SPRINGS = ("reading.contact=penalty", "reading.friction=0.3", "solver.transfer=pic_flip")
WITH_STATE = ("reading.density_changes=moduli_and_volume", "reading.cadence=substep", "reading.release=rest")
EVERY_STAGE = (0, 7, 20, 21, 48, 59)  # frames


def assert_same_bits(one: xr.Dataset, other: xr.Dataset) -> None:
    assert set(one.variables) == set(other.variables)
    for name in one.variables:
        assert one[name].dtype == other[name].dtype, name
        np.testing.assert_array_equal(one[name].values, other[name].values, err_msg=name)


@pytest.mark.parametrize(
    ("reading", "frames"),
    [
        (WITH_STATE, (7, 20, 48)),
        (SPRINGS, (50,)),
        pytest.param(WITH_STATE, EVERY_STAGE, marks=pytest.mark.nightly),
        pytest.param((), EVERY_STAGE, marks=pytest.mark.nightly),
    ],
)
def test_going_on_from_any_frame(reading, frames):
    """From the start, in mid-press, on both sides of the release, in the impact: in every reading that keeps state."""
    config = compose([*SMALL, "pressure=3000", *reading])
    saved = {}
    whole = simulate(config, lambda progress: saved.update({progress.frame: progress.checkpoint()}))
    for frame in frames:
        assert_same_bits(simulate(config, resume=saved[frame]), whole)


@pytest.fixture
def terminate():
    """A function that sends this process the signal of a batch system's end, as orderly as Ctrl-C."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    yield lambda: signal.raise_signal(signal.SIGTERM)
    signal.signal(signal.SIGTERM, before)


def test_an_interrupt_keeps_the_frame_that_it_comes_in(tmp_path, terminate, small_run):
    """The next attempt goes on from it, to the same bits; a second interrupt does not wait for the frame's end."""
    run = Run(compose([*SMALL, "pressure=3000", "checkpoint_seconds=1000", f"store={tmp_path}"]))

    def stop(frame: int, times: int) -> str:
        """Interrupt an attempt in a frame; returns what the store says of it."""
        with pytest.raises(KeyboardInterrupt):
            do_run(run, lambda now: [terminate() for _ in range(times)] if now.frame == frame else None)
        return states.standing(run).reason

    assert stop(9, times=2) == "stopped in frame 10"
    assert stop(30, times=1) == "stopped after frame 30, kept a checkpoint"
    assert int(run.checkpoint()["frame"]) == 30
    assert signal.getsignal(signal.SIGTERM) is signal.default_int_handler
    frames: list[int] = []
    do_run(run, lambda now: frames.append(now.frame))
    assert frames[0] == 31
    with open_run(run.result) as again:
        assert_same_bits(again, small_run)


@pytest.mark.nightly
def test_twenty_kills(tmp_path):
    """SIGKILL at twenty random moments, most of them in mid-press: the file of a run that was never stopped."""
    rng = np.random.default_rng()
    command = [sys.executable, "-m", "snowrepro", "run", *LONG]
    killed = 0
    while killed < 20:
        process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        before = newest(tmp_path)
        while process.poll() is None and newest(tmp_path) == before:
            time.sleep(0.005)
        time.sleep(rng.uniform(0, 0.15))
        if process.poll() is not None:
            break
        process.kill()
        process.wait()
        killed += 1
        assert not list(tmp_path.glob("runs/*/run.nc"))
    assert killed == 20, "the run ended before it was killed twenty times"
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    (result,) = tmp_path.glob("runs/*/run.nc")
    log = (result.parent / "run.log").read_text()
    assert log.count("goes on from frame") >= 15
    assert sorted(p.name for p in result.parent.iterdir()) == [
        "analysis.nc", "manifest.json", "run.log", "run.nc", "summary.json",
    ]  # fmt: skip
    with open_run(result) as resumed:
        assert_same_bits(resumed.load(), simulate(compose(LONG)))


def newest(folder: Path) -> int:
    """When the checkpoint was written last; 0 if there is none."""
    return max((path.stat().st_mtime_ns for path in folder.glob("runs/.work/*/checkpoint.npz")), default=0)


def test_a_broken_or_foreign_checkpoint_is_not_used(tmp_path, monkeypatch):
    """Half a file, or one of other versions: the run starts from the beginning, and is right."""
    run = Run(compose([*SMALL, f"store={tmp_path}"]))
    saved = {}
    whole = simulate(run.config, lambda progress: saved.update({progress.frame: progress.checkpoint()}))
    run.save_checkpoint({**saved[30], "seconds": np.array(1.0)})
    assert int(run.checkpoint()["frame"]) == 30
    path = run.work / CHECKPOINT
    content = path.read_bytes()
    for cut in (0, 10, len(content) // 2, len(content) - 10):
        path.write_bytes(content[:cut])
        assert run.checkpoint() is None
    path.write_bytes(content)
    monkeypatch.setattr(manifest, "code_digest", lambda: "of other code")
    assert run.checkpoint() is None
    monkeypatch.undo()
    path.write_bytes(content[:1000])
    with open_run(do_run(run)) as done:
        assert_same_bits(done.load(), whole)
    assert not path.exists()


def test_a_run_that_went_on_says_when_it_first_began(tmp_path):
    """Its manifest is of the whole run: began and took as long as all attempts together."""
    run = Run(compose([*SMALL, f"store={tmp_path}"]))
    saved = {}
    simulate(run.config, lambda progress: saved.update({progress.frame: progress.checkpoint()}))
    before = {"seconds": np.array(1000.0), "began": np.array("2020-01-01T00:00:00+00:00")}
    run.save_checkpoint({**saved[55], **before})
    do_run(run)
    said = run.manifest()
    assert said["began"] == "2020-01-01T00:00:00+00:00"
    assert said["wall_seconds"] > 1000


@pytest.mark.parametrize("checkpoint_seconds", [0, pytest.param(1000, marks=pytest.mark.nightly)])
def test_a_diverged_run_leaves_its_last_good_state(tmp_path, checkpoint_seconds):
    """The state before the frame that failed, whether or not a checkpoint was kept just then."""
    run = Run(compose([*SMALL, "pressure=1e6", f"store={tmp_path}", f"checkpoint_seconds={checkpoint_seconds}"]))
    with pytest.raises(
        Diverged, match=r"diverged in frame (\d+) .*; last good state: frame \d+, in .*checkpoint.npz"
    ) as e:
        do_run(run)
    good = int(re.search(r"good state: frame (\d+)", str(e.value))[1])
    assert 0 < good == int(re.search(r"in frame (\d+)", str(e.value))[1]) - 1
    with np.load(run.work / CHECKPOINT) as kept:
        assert int(kept["frame"]) == good
        state = dict(kept)
    assert all(np.isfinite(state[quantity.name]).all() for quantity in PARTICLE_STATE)
    seen = {}
    with pytest.raises(Diverged):
        simulate(run.config, lambda progress: seen.update({progress.frame: progress.checkpoint()}))
    for quantity in PARTICLE_STATE:
        np.testing.assert_array_equal(state[quantity.name], seen[good][quantity.name])
    assert not run.result.exists()
