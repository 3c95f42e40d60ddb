"""Sweeps on real clusters of this machine: all runs arrive, and a worker killed by force costs one run's time."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cluster.conftest import ROOT, Cluster
from tests.conftest import SMALL

EXPERIMENT = ["run", "experiment=fig5", *SMALL, "experiment.frames=[0,20,60]"]
LONGER = ["reading.gravity=5", "loading.frames=300", "checkpoint_seconds=1"]  # some ten seconds a run
PATIENCE = 240.0


def start(cluster: Cluster, folder: Path, *more: str) -> subprocess.Popen:
    """The experiment's six runs on the cluster; its own session, so that a test can end it alone."""
    command = [sys.executable, "-m", "snowrepro", *EXPERIMENT, f"store={folder}/store", *cluster.overrides, *more]
    env = {**cluster.env, "PYTHONPATH": str(ROOT)}
    with open(folder / "out.txt", "a") as out:
        return subprocess.Popen(command, cwd=folder, env=env, stdout=out, stderr=out, start_new_session=True)


def finished(folder: Path) -> dict[Path, int]:
    """Results and when they were written."""
    return {path: path.stat().st_mtime_ns for path in sorted((folder / "store").glob("*/run.nc"))}


def workers(cluster: Cluster, store: Path) -> list[int]:
    """Processes that compute a run of this store: one that has a file of a run open."""
    found = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit() or not _is_worker(cluster.kind, entry):
            continue
        try:
            files = [os.readlink(file) for file in (entry / "fd").iterdir()]
        except OSError:
            continue
        if any(file.startswith(f"{store}/") and "/.sweep/" not in file for file in files):
            found.append(int(entry.name))
    return found


def _is_worker(kind: str, entry: Path) -> bool:
    try:
        line = (entry / "cmdline").read_bytes().replace(b"\0", b" ")
    except OSError:
        return False
    return (b"submitit.core._submit" if kind == "slurm" else b"ray::_run_job") in line


def wait_for(seen: Callable[[], object], what: str, folder: Path) -> None:
    """Poll.  Fails with what the command has said."""
    end = time.monotonic() + PATIENCE
    while not seen():
        assert time.monotonic() < end, f"no {what}: {(folder / 'out.txt').read_text()[-3000:]}"
        time.sleep(0.1)


def said(folder: Path) -> str:
    return (folder / "out.txt").read_text()


def end(command: subprocess.Popen) -> None:
    """End a command, in order if it lets itself be."""
    if command.poll() is None:
        command.send_signal(signal.SIGINT)
        try:
            command.wait(30)
        except subprocess.TimeoutExpired:
            command.kill()
    command.wait()


def queue(cluster: Cluster) -> str:
    """What Slurm has still to do; nothing for Ray, whose tasks end with the command."""
    if cluster.kind != "slurm":
        return ""
    return subprocess.run(["squeue", "-h"], env=cluster.env, capture_output=True, text=True, check=True).stdout


@pytest.mark.nightly
def test_six_runs_arrive(cluster, tmp_path):
    """Six results and the report; the second call computes nothing."""
    assert start(cluster, tmp_path).wait(PATIENCE) == 0, said(tmp_path)
    stamps = finished(tmp_path)
    assert len(stamps) == 6
    assert len(list(tmp_path.glob("my_reports/fig5,*/index.html"))) == 1
    assert start(cluster, tmp_path).wait(PATIENCE) == 0, said(tmp_path)
    assert finished(tmp_path) == stamps


@pytest.mark.nightly
def test_a_killed_worker_costs_no_finished_run(cluster, tmp_path):
    """kill -9 of a worker in mid-run: at the latest the second call has all six, and none is computed again."""
    store = tmp_path / "store"
    command = start(cluster, tmp_path, *LONGER)
    try:
        wait_for(lambda: finished(tmp_path), "first result", tmp_path)
        before = workers(cluster, store)  # near their ends; a later one has most of its run before it
        wait_for(lambda: set(workers(cluster, store)) - set(before), "run that begins", tmp_path)
        os.kill((set(workers(cluster, store)) - set(before)).pop(), signal.SIGKILL)
        # Slurm without accounting never tells submitit that a job died: the command then waits, and is ended here.
        wait_for(lambda: command.poll() is not None or len(finished(tmp_path)) >= 5, "five results", tmp_path)
        if len(finished(tmp_path)) < 6 and cluster.kind == "ray":
            wait_for(lambda: command.poll() is not None, "end of the command", tmp_path)
        wait_for(lambda: not queue(cluster), "empty queue", tmp_path)
    finally:
        end(command)
    early = finished(tmp_path)
    assert len(early) == (5 if cluster.kind == "slurm" else 6)  # Ray starts a lost run again by itself
    assert start(cluster, tmp_path, *LONGER).wait(PATIENCE) == 0, said(tmp_path)
    assert len(finished(tmp_path)) == 6
    assert {path: finished(tmp_path)[path] for path in early} == early


@pytest.mark.nightly
def test_an_own_cluster_file_is_found(cluster, tmp_path):
    """conf/hydra/launcher/mycluster.yaml of the working folder stands on ours, and its runs arrive."""
    own = tmp_path / "conf" / "hydra" / "launcher"
    own.mkdir(parents=True)
    settings = {"slurm": "partition: main\n", "ray": "ray:\n  remote:\n    max_retries: 1\n"}
    (own / "mycluster.yaml").write_text(f"defaults:\n  - {cluster.kind}\n{settings[cluster.kind]}")
    overrides = ("hydra/launcher=mycluster", *cluster.overrides[1:])
    assert start(Cluster(cluster.kind, overrides, cluster.env), tmp_path, "pressure=500").wait(PATIENCE) == 0
    assert len(finished(tmp_path)) == 2


@pytest.mark.nightly
def test_a_job_array_needs_no_process_that_waits(slurm, tmp_path):
    """plan --sbatch, sbatch, nothing else: all runs are there when the queue is empty; then nothing is to be run."""
    env = {**slurm.env, "PYTHONPATH": str(ROOT)}
    plan = [
        sys.executable,
        "-m",
        "snowrepro",
        "plan",
        *EXPERIMENT[1:],
        f"store={tmp_path}/store",
        "--sbatch",
        "fig5.sh",
    ]
    planned = subprocess.run(plan, cwd=tmp_path, env=env, capture_output=True, text=True)
    assert planned.returncode == 0, planned.stderr
    assert "#SBATCH --array=1-6\n" in (tmp_path / "fig5.sh").read_text()
    subprocess.run(["sbatch", "fig5.sh"], cwd=tmp_path, env=env, check=True, capture_output=True)
    (tmp_path / "out.txt").touch()
    wait_for(lambda: len(finished(tmp_path)) == 6 and not queue(slurm), "six results", tmp_path)
    assert len(list((tmp_path / "store" / "sweeps").glob("*/slurm-*.log"))) == 6
    assert not (tmp_path / "my_reports").exists()
    again = subprocess.run(plan, cwd=tmp_path, env=env, capture_output=True, text=True)
    assert again.returncode == 2 and "nothing is to be run" in again.stderr
