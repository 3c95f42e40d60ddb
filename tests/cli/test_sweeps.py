"""Sweeps as a user meets them: killed, doubled, on a bad disk; and what plan, status, explain, retry, clean say."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import psutil
import pytest
import xarray as xr

from snowrepro.store import lease
from snowrepro.store.files import write_json
from tests.conftest import SMALL

FOUR = ["-m", "pressure=500,3000", "sintering=paper,none", *SMALL]
PATIENCE = 300


def results(folder: Path) -> dict[str, int]:
    """When each result was written."""
    return {path.parent.name: path.stat().st_mtime_ns for path in folder.glob("runs/[!.]*/run.nc")}


def start(folder: Path, *arguments: str, **options) -> subprocess.Popen:
    """Start the command line in a process group of its own."""
    command = [sys.executable, "-m", "snowrepro", *arguments]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, **options}
    return subprocess.Popen(command, cwd=folder, start_new_session=True, **pipes)


def wait_for(condition, process: subprocess.Popen | None = None) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition() and (process is None or process.poll() is None):
        assert time.monotonic() < deadline
        time.sleep(0.01)


def workers_of(process: subprocess.Popen) -> list[psutil.Process]:
    """The processes in which the runs of a sweep are: those that hold a lease."""
    children = psutil.Process(process.pid).children(recursive=True)
    return [child for child in children if any("/run.log" in file.path for file in _open_files(child))]


def count_begun(folder: Path) -> int:
    """How many unfinished runs have logged that they begin."""
    return sum("INFO run " in log.read_text() for log in folder.glob("runs/.work/*/run.log"))


def _open_files(process: psutil.Process) -> list:
    try:
        return process.open_files()
    except psutil.Error:
        return []


def worked_on(folder: Path) -> set[str]:
    """Ids of runs that are begun and have no result."""
    return {path.name for path in folder.glob("runs/.work/*")} - results(folder).keys()


def assert_same_results(one: Path, other: Path) -> None:
    assert results(one).keys() == results(other).keys()
    for name in results(one):
        with (
            xr.open_dataset(one / "runs" / name / "run.nc") as a,
            xr.open_dataset(other / "runs" / name / "run.nc") as b,
        ):
            assert set(a.variables) == set(b.variables)
            for variable in a.variables:
                np.testing.assert_array_equal(a[variable].values, b[variable].values, err_msg=f"{name} {variable}")


@pytest.mark.nightly
def test_a_sweep_whose_launcher_is_killed_twenty_times(tmp_path):
    """SIGKILL at random moments: 24 runs in the end, the content of an undisturbed sweep, none done twice."""
    sweep = ["run", "-m", "pressure=range(500,3500,500)", "sintering=paper,none", "seed=0,1", *SMALL]
    rng = np.random.default_rng()
    killed, calm = tmp_path / "killed", tmp_path / "calm"
    killed.mkdir(), calm.mkdir()
    seen: dict[str, int] = {}
    for _ in range(20):
        process = start(killed, *sweep, "checkpoint_seconds=0", stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        wait_for(lambda process=process: workers_of(process), process)
        time.sleep(rng.uniform(0, 2.0))
        assert process.poll() is None, "the sweep ended before it was killed twenty times"
        process.kill()
        process.wait()
        assert seen.items() <= results(killed).items()
        seen = results(killed)
    last = start(killed, *sweep)
    _, errors = last.communicate(timeout=PATIENCE)
    assert last.returncode == 0, errors
    assert seen.items() <= results(killed).items()
    assert len(results(killed)) == 24
    assert start(calm, *sweep, stdout=subprocess.DEVNULL).wait(PATIENCE) == 0
    assert_same_results(killed, calm)
    assert not list(killed.glob("runs/.work/*"))


@pytest.mark.nightly
def test_a_killed_worker_costs_one_retry(tmp_path):
    """The run goes on in another process, and the sweep ends well."""
    process = start(tmp_path, "run", *FOUR, "hydra.launcher.workers=2")
    wait_for(lambda: count_begun(tmp_path) == 2 and workers_of(process), process)
    workers_of(process)[0].kill()
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, errors
    assert len(results(tmp_path)) == 4
    starts = [log.read_text().count("INFO run ") for log in tmp_path.glob("runs/*/run.log")]
    assert sorted(starts) == [1, 1, 1, 2]


@pytest.mark.nightly
def test_everything_killed_at_once_loses_nothing(tmp_path, snowrepro):
    """Launcher, server and workers: what was published stays, the next call does the rest."""
    process = start(tmp_path, "run", *FOUR, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wait_for(lambda: results(tmp_path) and worked_on(tmp_path), process)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    before = results(tmp_path)
    assert 1 <= len(before) < 4
    again = snowrepro("run", *FOUR)
    assert again.returncode == 0, again.stderr
    assert f"4 runs, {len(before)} of them done" in again.stderr
    assert "interrupted" in again.stderr
    assert before.items() <= results(tmp_path).items()
    assert len(results(tmp_path)) == 4


@pytest.mark.nightly
def test_workers_end_with_their_launcher(tmp_path):
    """Nobody would wait for them; what they did so far is kept, and said."""
    process = start(tmp_path, "run", "-m", "pressure=500,3000", "fidelity=preview", "checkpoint_seconds=0.1")
    wait_for(lambda: len(list(tmp_path.glob("runs/.work/*/checkpoint.npz"))) == min(2, os.cpu_count()), process)
    workers = workers_of(process)
    assert workers
    process.kill()
    process.wait()
    _, alive = psutil.wait_procs(workers, timeout=30)
    assert not alive
    said = [json.loads(path.read_text()) for path in tmp_path.glob("runs/.work/*/outcome.json")]
    assert {one["state"] for one in said} == {"interrupted"}
    assert all(re.fullmatch(r"stopped (in|after) frame \d+", one["message"]) for one in said)


@pytest.mark.nightly
def test_two_sweeps_at_once_share_the_work(tmp_path):
    """Each run is done by one of them, once."""
    both = [start(tmp_path, "run", *FOUR) for _ in range(2)]
    ends = [process.communicate(timeout=PATIENCE) for process in both]
    assert [process.returncode for process in both] == [0, 0], ends
    assert len(results(tmp_path)) == 4
    assert [log.read_text().count("INFO run ") for log in tmp_path.glob("runs/*/run.log")] == [1] * 4
    assert ends[0][0] == ends[1][0]
    assert not list(tmp_path.glob("runs/.work/*"))


@pytest.mark.nightly
def test_a_lease_of_a_dead_host_is_taken_over(tmp_path, snowrepro):
    """While it beats the run is somebody's; when it was silent for long, it is nobody's."""
    one = ["pressure=500", *SMALL]
    planned = snowrepro("plan", *one, "--list")
    (run_id,) = re.findall(r"^run +(\S+):", planned.stdout, re.MULTILINE)
    work = tmp_path / "runs" / ".work" / run_id
    write_json(work / "lease.1", {"host": "farhost", "place": "farhost", "pid": 7})
    assert f"running      {run_id}: process 7 on farhost" in snowrepro("status", *one).stdout
    late = time.time() - lease.EXPIRY_SECONDS - 10
    os.utime(work / "lease.1", (late, late))
    assert f"interrupted  {run_id}: process 7 on farhost died" in snowrepro("status", *one).stdout
    done = snowrepro("run", *one)
    assert done.returncode == 0, done.stderr
    assert run_id in results(tmp_path)


@pytest.mark.parametrize("harm", ["truncated", pytest.param("wrong checksum", marks=pytest.mark.nightly)])
def test_a_broken_result_is_found_and_made_again(tmp_path, snowrepro, harm):
    """plan and explain say what is wrong; run mends it; nothing else is run."""
    two = ["-m", "pressure=500,3000", "sintering=none", *SMALL]
    assert snowrepro("run", *two).returncode == 0
    stamps = results(tmp_path)
    name = min(stamps)
    folder = tmp_path / "runs" / name
    if harm == "truncated":
        os.truncate(folder / "run.nc", 1000)
        reason = "run.nc has 1000 bytes instead of "
    else:
        written = json.loads((folder / "manifest.json").read_text())
        written["files"]["run.nc"]["sha256"] = "0" * 64
        (folder / "manifest.json").write_text(json.dumps(written))
        reason = "manifest.json is not as it was written: its checksum differs"
    planned = snowrepro("plan", *two)
    assert "2 runs, 1 of them done" in planned.stdout
    assert "to run: 1, its result is broken" in planned.stdout
    explained = snowrepro("explain", name)
    assert explained.stdout.startswith(f"{name}: broken\n  {reason}")
    done = snowrepro("run", *two)
    assert done.returncode == 0, done.stderr
    after = results(tmp_path)
    assert {key for key in after if after[key] != stamps[key]} == {name}
    assert snowrepro("explain", name).stdout.startswith(f"{name}: done\n")


@contextmanager
def small_disk(folder: Path, size: str) -> Iterator[None]:
    """A file system of a few megabytes at ``folder``."""
    folder.mkdir(exist_ok=True)
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)], capture_output=True, text=True
    )
    if mounted.returncode:
        pytest.skip(f"no file system can be mounted here: {mounted.stderr.strip()}")
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


@pytest.mark.nightly
def test_a_full_disk_fails_the_run_and_room_mends_it(tmp_path, snowrepro):
    """One message that says so and how much is free, no half result; with room again the run is made."""
    one = ["pressure=500", *SMALL]
    with small_disk(tmp_path / "runs", "400k"):
        full = snowrepro("run", *one)
        assert full.returncode == 2, full.stderr
        assert "error: cannot write" in full.stderr and "MB free on its disk" in full.stderr
        assert "Traceback" not in full.stderr
        assert results(tmp_path) == {}
        assert not list(tmp_path.glob("runs/.work/*/result.*"))
        asked = snowrepro("status", *one).stdout
        assert " 1 failed" in asked or " 1 interrupted" in asked  # as the last words fit or do not
        subprocess.run(["mount", "-o", "remount,size=50m", str(tmp_path / "runs")], check=True)
        mended = snowrepro("run", *one)
        assert mended.returncode == 0, mended.stderr
        assert len(results(tmp_path)) == 1


@pytest.mark.nightly
def test_a_full_disk_in_a_sweep(tmp_path, snowrepro):
    """What fits is kept and counts; the others are told; with room again only they are run."""
    with small_disk(tmp_path / "runs", "2500k"):
        full = snowrepro("run", *FOUR)
        assert full.returncode == 3, full.stderr
        kept = results(tmp_path)
        assert 1 <= len(kept) < 4
        assert f"{4 - len(kept)} of 4 runs have no result" in full.stderr
        assert "Traceback" not in full.stderr
        subprocess.run(["mount", "-o", "remount,size=50m", str(tmp_path / "runs")], check=True)
        mended = snowrepro("run", *FOUR)
        assert mended.returncode == 0, mended.stderr
        assert len(results(tmp_path)) == 4
        assert kept.items() <= results(tmp_path).items()


@pytest.mark.nightly
def test_a_store_that_can_only_be_read(tmp_path, snowrepro):
    """What is there can be planned, explained and opened; a new run is refused at once."""
    with small_disk(tmp_path / "runs", "50m"):
        assert snowrepro("run", "pressure=500", *SMALL).returncode == 0
        (name,) = results(tmp_path)
        subprocess.run(["mount", "-o", "remount,ro", str(tmp_path / "runs")], check=True)
        refused = snowrepro("run", "pressure=600", *SMALL)
        assert refused.returncode == 2
        assert "cannot write into the folder" in refused.stderr and refused.stderr.count("\n") == 1
        assert snowrepro("run", "-m", "pressure=600,700", *SMALL).returncode == 2
        assert snowrepro("plan", "pressure=500", *SMALL).stdout.startswith("1 run, 1 of them done")
        assert snowrepro("explain", name).stdout.startswith(f"{name}: done")
        assert snowrepro("classify", name).returncode == 0
        subprocess.run(["mount", "-o", "remount,rw", str(tmp_path / "runs")], check=True)
        assert snowrepro("run", "pressure=600", *SMALL).returncode == 0


@pytest.mark.nightly
def test_a_time_limit_is_a_state_and_the_run_goes_on(tmp_path, snowrepro):
    """The run is stopped, said to have been, keeps its checkpoint, and is taken up again."""
    sweep = ["-m", "pressure=500", "sintering=paper", "fidelity=preview", "checkpoint_seconds=0.1"]
    sweep += ["loading.frames=4000", "loading.rest=null"]
    late = snowrepro("run", *sweep, "hydra.launcher.time_limit_minutes=0.2")
    assert late.returncode == 3
    assert "timed out: stopped after 12 s, its time limit, kept a checkpoint" in late.stderr
    (name,) = [path.name for path in (tmp_path / "runs" / ".work").iterdir()]
    assert "to run: 1, timed out" in snowrepro("plan", *sweep).stdout
    assert snowrepro("explain", name).stdout.startswith(f"{name}: timed out\n  stopped after 12 s")
    done = snowrepro("run", *sweep)
    assert done.returncode == 0, done.stderr
    assert "goes on from frame" in (tmp_path / "runs" / name / "run.log").read_text()


@pytest.mark.nightly
def test_what_diverged_is_not_run_again_but_by_retry(tmp_path, snowrepro):
    """It is told, and left alone; retry runs it; other settings make other runs."""
    sweep = ["-m", "pressure=500,1e9", "sintering=none", *SMALL]
    first = snowrepro("run", *sweep)
    assert first.returncode == 3
    (name,) = [path.name for path in (tmp_path / "runs" / ".work").iterdir()]
    log = tmp_path / "runs" / ".work" / name / "run.log"
    assert log.read_text().count("INFO run ") == 1
    second = snowrepro("run", *sweep)
    assert second.returncode == 3
    assert "left alone: 1, failed, and would fail again" in second.stderr
    assert f"{name}: failed: diverged in frame" in second.stderr
    assert log.read_text().count("INFO run ") == 1
    explained = snowrepro("explain", name[-10:]).stdout
    assert explained.startswith(f"{name}: failed\n  diverged in frame")
    assert "not run again" in explained and "ERROR failed: diverged" in explained
    for words in (["retry", *sweep], ["retry", name]):
        runs = log.read_text().count("INFO run ")
        again = snowrepro(*words)
        assert again.returncode == 3
        assert "1 failed before" in again.stderr
        assert log.read_text().count("INFO run ") == runs + 1


@pytest.mark.nightly
def test_plan_tells_reasons_and_runs_nothing(tmp_path, snowrepro):
    """Counts and reasons before, in between and after; changes of configuration and code are told as such."""
    sweep = ["experiment=fig5", "pressure=500,3000", "sintering=none", "experiment.frames=[0,20,60]", *SMALL]
    empty = snowrepro("plan", *sweep)
    assert empty.returncode == 0, empty.stderr
    assert "2 runs, 0 of them done" in empty.stdout and "to run: 2, never run" in empty.stdout
    assert "a guess: no run is finished yet" in empty.stdout
    assert list(tmp_path.iterdir()) == []
    assert snowrepro("run", *sweep).returncode == 0
    assert "to run" not in snowrepro("plan", *sweep).stdout
    more = snowrepro("plan", *sweep, "seeds=3")
    assert "6 runs, 2 of them done" in more.stdout and "to run: 4, never run" in more.stdout
    assert re.search(r"about 0\.\d\d core-hours, 0:\d\d with \d+ at a time \(from 2 finished runs\)", more.stdout)
    for path in (tmp_path / "runs").glob("*/manifest.json"):
        content = json.loads(path.read_text())
        content["code"]["mpm/steps.py"] = "of old"
        body = {key: value for key, value in content.items() if key != "checksum"}
        from snowrepro.store.manifest import _checksum

        path.write_text(json.dumps({**body, "checksum": _checksum(body)}))
    old = snowrepro("plan", *sweep).stdout
    assert "2 of them done" in old and "done with other code: 2 (mpm/steps.py changed)" in old
    selected = snowrepro("plan", *sweep, "rerun=[code]").stdout
    assert "to run: 2, code changed" in selected
    stamps = results(tmp_path)
    assert snowrepro("run", *sweep, "rerun=[code]").returncode == 0
    after = results(tmp_path)
    assert after.keys() == stamps.keys() and all(after[name] != stamps[name] for name in after)
    assert "to run" not in snowrepro("plan", *sweep, "rerun=[code]").stdout


@pytest.mark.nightly
def test_a_changed_configuration_is_told(tmp_path, snowrepro):
    """The same sweep, whose option's file was edited since."""
    option = tmp_path / "conf" / "floor" / "low.yaml"
    option.parent.mkdir(parents=True)
    text = "name: low\noutline: {kind: polygon, points: [[0, 0], [160, 0], [160, 20.3], [0, 20.3]]}\n"
    option.write_text(text)
    sweep = ["-m", "floor=low", "pressure=500", *SMALL]
    assert snowrepro("run", *sweep).returncode == 0
    option.write_text(text.replace("20.3", "22.3"))
    planned = snowrepro("plan", *sweep, "--list").stdout
    assert "to run: 1, configuration changed since this sweep was last run" in planned
    assert "floor.outline.points" in planned


def test_status_and_results_of_a_sweep(tmp_path, snowrepro):
    """By its name or its overrides; one table of numbers beside."""
    sweep = ["experiment=fig5", "pressure=500,1e9", "sintering=none", "experiment.frames=[0,20,60]", *SMALL]
    assert snowrepro("run", *sweep).returncode == 3
    (folder,) = (tmp_path / "runs" / "sweeps").iterdir()
    every = snowrepro("status").stdout
    assert every.startswith(f"{folder.name}: 1 done, 1 failed; asked for ")
    named = snowrepro("status", folder.name).stdout
    assert named == snowrepro("status", *sweep).stdout
    assert ": 1 done, 1 failed\n" in named and "diverged in frame" in named
    assert {"sweep.json", "results.csv", "results.nc"} == {path.name for path in folder.iterdir()}
    record = json.loads((folder / "sweep.json").read_text())
    (folder / "sweep.json").write_text(json.dumps({**record, "overrides": ["shape=gone"]}))
    assert f"{folder.name}: cannot be planned any more: there is no shape 'gone'" in snowrepro("status").stdout
    wrong = snowrepro("status", "fig6")
    assert wrong.returncode == 2 and f"there are: {folder.name}" in wrong.stderr


@pytest.mark.nightly
def test_parts_of_a_sweep_are_the_whole(tmp_path, snowrepro):
    """Three tasks of a job array, each with its part; no report, no record."""
    for task in (1, 2, 3):
        done = snowrepro("run", *FOUR, "--part", f"{task}/3")
        assert done.returncode == 0, done.stderr
        assert len(results(tmp_path)) == (2, 3, 4)[task - 1]
    assert snowrepro("run", *FOUR, "--part", "6/6").returncode == 0
    assert not (tmp_path / "runs" / "sweeps").exists()
    for wrong in ("0/3", "4/3", "half"):
        refused = snowrepro("run", *FOUR, "--part", wrong)
        assert refused.returncode == 2 and f"part: should be I/N with 1 <= I <= N (got {wrong})" in refused.stderr


@pytest.mark.nightly
def test_clean_shows_asks_and_frees(tmp_path, snowrepro):
    """Nothing goes without being named and agreed to."""
    assert snowrepro("run", "-m", "pressure=500,1e9", "sintering=none", *SMALL).returncode == 3
    stamps = results(tmp_path)
    shown = snowrepro("clean", stdin=subprocess.DEVNULL)
    assert shown.returncode == 0
    assert re.search(r"^failed +1  +\d", shown.stdout, re.MULTILINE)
    assert re.search(r"^unused +0", shown.stdout, re.MULTILINE)
    asked = snowrepro("clean", "failed", stdin=subprocess.DEVNULL)
    assert "--yes does without asking" in asked.stderr
    assert len(list((tmp_path / "runs" / ".work").iterdir())) == 1
    assert "removed" in snowrepro("clean", "failed", "--yes").stderr
    assert list((tmp_path / "runs" / ".work").iterdir()) == []
    assert results(tmp_path) == stamps
    wrong = snowrepro("clean", "everything")
    assert wrong.returncode == 2 and "there are: scraps, failed, unfinished" in wrong.stderr


@pytest.mark.nightly
def test_the_array_script_does_the_sweep(tmp_path, snowrepro):
    """Run as Slurm runs it, a task after the other, without Slurm."""
    sweep = ["-m", "pressure=500,3000", "sintering=none", *SMALL]
    assert snowrepro("run", "pressure=500", "sintering=none", *SMALL).returncode == 0
    planned = snowrepro("plan", *sweep, "--sbatch", "sweep.sh")
    assert planned.returncode == 0, planned.stderr
    text = (tmp_path / "sweep.sh").read_text()
    assert "#SBATCH --array=2\n" in text and "#SBATCH --time=10\n" in text
    task = {**os.environ, "SLURM_ARRAY_TASK_ID": "2"}
    done = subprocess.run(
        ["bash", "sweep.sh"], cwd=tmp_path, env=task, capture_output=True, text=True, timeout=PATIENCE
    )
    assert done.returncode == 0, done.stderr
    assert len(results(tmp_path)) == 2
    nothing = snowrepro("plan", *sweep, "--sbatch", "none.sh")
    assert nothing.returncode == 2 and "nothing is to be run" in nothing.stderr
    assert not (tmp_path / "none.sh").exists()
