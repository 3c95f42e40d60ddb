"""Jobs in processes of their own: limits, losses, and what is shown of them."""

import functools
import io
import os
import signal
import sys
import threading
import time
from pathlib import Path

import cloudpickle
import psutil
import pytest
from rich.console import Console

from snowrepro.store.files import write_json
from snowrepro.sweep.processes import Job, Limits, Lost, free_memory, run_jobs
from snowrepro.sweep.table import SweepTable, clock


def jobs_of(*calls) -> list[Job]:
    return [Job(str(i), functools.partial(_pickled, call)) for i, call in enumerate(calls)]


def _pickled(call, job: Job) -> bytes:
    return cloudpickle.dumps(call)


def run(jobs: list[Job], workers: int = 2, **limits) -> list[Job]:
    run_jobs(jobs, Limits(workers, **limits), lambda running, ended: None)
    return jobs


def _about_this_process() -> tuple[int, bool, int, str]:
    """Its number, whether Taichi has begun anything in it, its threads of computing, and where it is."""
    begun = "taichi" in sys.modules and sys.modules["taichi"].lang.impl.get_runtime().prog is not None
    return os.getpid(), begun, threading.active_count(), os.getcwd()


def test_every_job_has_a_fresh_process(tmp_path, monkeypatch):
    """Of its own, in the folder and with the variables of its parent, and with nothing in it from before."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TOLD", "now")
    jobs = run(jobs_of(*[_about_this_process] * 3, functools.partial(os.environ.get, "TOLD")))
    assert [job.state for job in jobs] == ["done"] * 4
    numbers, begun, _, folders = zip(*(job.result for job in jobs[:3]), strict=True)
    assert len({*numbers, os.getpid()}) == 4
    assert not any(begun)
    assert set(folders) == {str(tmp_path)}
    assert jobs[3].result == "now"


def test_jobs_that_use_taichi_do_not_disturb_each_other():
    """Each starts its own, in a process forked after Taichi was imported."""
    jobs = run(jobs_of(*[_sum_in_taichi] * 3))
    assert [job.result for job in jobs] == [499500] * 3


def _sum_in_taichi() -> int:
    import taichi as ti

    ti.init(ti.cpu, offline_cache=False, log_level=ti.ERROR)
    field = ti.field(ti.i64, 1000)
    field.from_numpy(__import__("numpy").arange(1000))
    return int(field.to_numpy().sum())


def test_a_crash_is_tried_again_and_then_one_failed_job():
    """A killed process is lost, an exception is an answer; neither touches the others."""
    losses = []
    jobs = jobs_of(os.getpid, functools.partial(signal.raise_signal, signal.SIGKILL), functools.partial(int, "x"))
    jobs[1].on_loss = lambda state, message: losses.append((state, message))
    run(jobs, retries=2)
    assert [job.state for job in jobs] == ["done", "failed", "failed"]
    assert [job.tries for job in jobs] == [1, 3, 1]
    assert isinstance(jobs[1].result, Lost) and isinstance(jobs[2].result, ValueError)
    assert losses == [("failed", "the process ended with SIGKILL and no result")]


def _die_once(flag: Path) -> str:
    if not flag.exists():
        flag.touch()
        os._exit(7)
    return "done"


def test_one_retry_is_enough_for_one_crash(tmp_path):
    (job,) = run(jobs_of(functools.partial(_die_once, tmp_path / "flag")))
    assert (job.state, job.result, job.tries) == ("done", "done", 2)


def _ignore_the_end() -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    time.sleep(60)


def test_a_time_limit_ends_a_job_and_only_it(monkeypatch):
    """Also one that does not listen; it is not tried again."""
    monkeypatch.setattr("snowrepro.sweep.processes.GRACE_SECONDS", 0.5)
    started = time.monotonic()
    jobs = run(jobs_of(functools.partial(time.sleep, 60), _ignore_the_end, os.getpid), seconds=3.0)
    assert [job.state for job in jobs] == ["timed out", "timed out", "done"]
    assert [job.tries for job in jobs] == [1, 1, 1]
    assert str(jobs[0].result) == "stopped after 3 s, its time limit"
    assert time.monotonic() - started < 30


def test_an_interrupt_ends_the_running_jobs():
    """Ctrl-C in the parent leaves no child behind."""

    def interrupt(running, ended):
        children.extend(c for c in psutil.Process().children(recursive=True) if c not in before)
        raise KeyboardInterrupt

    before, children = psutil.Process().children(recursive=True), []
    with pytest.raises(KeyboardInterrupt):
        run_jobs(jobs_of(*[functools.partial(time.sleep, 60)] * 2), Limits(2), interrupt)
    alive = [c for c in children if c.is_running() and c.status() != psutil.STATUS_ZOMBIE and _sleeps(c)]
    assert not alive


def _sleeps(process: psutil.Process) -> bool:
    """Not the server, which stays for the next jobs."""
    return not process.children()


def test_what_is_done_elsewhere_is_waited_for_and_not_done():
    """It does not hold up the others; when it is done, its result is taken over; when it is given up, it is run."""
    order = []

    def is_elsewhere(job: Job) -> bool:
        """Until the third job has ended, however long that takes."""
        if job.label == "0" and order:
            job.state, job.result = "done", "theirs"
        return not order

    jobs = jobs_of(os.getpid, os.getpid, os.getpid)
    jobs[0].is_elsewhere = jobs[1].is_elsewhere = is_elsewhere
    run_jobs(jobs, Limits(2), lambda running, ended: order.extend(job.label for job in ended))
    assert order[0] == "2" and sorted(order) == ["0", "1", "2"]
    assert (jobs[0].result, jobs[0].tries) == ("theirs", 0)
    assert (jobs[1].state, jobs[1].tries) == ("done", 1)


def test_free_memory_is_what_the_machine_has():
    assert 0 < free_memory() <= psutil.virtual_memory().total


def table_of(total: int, folder: Path | None = None, **console) -> tuple[SweepTable, io.StringIO]:
    screen = io.StringIO()
    return SweepTable(total, 2, Console(file=screen, width=100, **console)), screen


def ended(label: str, state: str = "done", seconds: float = 2.0, result: object = None) -> Job:
    return Job(label, lambda job: b"", state=state, tries=1, seconds=seconds, result=result)


def test_the_table_shows_what_runs_and_what_failed(tmp_path):
    """Frame, rate and time of each; counts, runs a minute and the time left below."""
    write_json(tmp_path / "progress.json", {"frame": 30, "frames": 60, "substeps": 5})
    table, _ = table_of(100, force_terminal=True)
    table([], [*(ended(f"job {i}") for i in range(9)), ended("bad", "failed", result=Lost("gone"))])
    running = [Job("job 50", lambda job: b"", folder=tmp_path, state="running", tries=2, started=7.0)]
    table.began = 0.0
    drawn = table.render(running, now=10.0)
    cells = [list(column.cells) for column in drawn.columns]
    assert cells[0] == ["bad", "job 50"] and cells[1] == ["failed", "running, try 2"]
    assert cells[2][1] == "30/60" and cells[3][1] == "10.0" and cells[4][1] == "0:03"
    # 89 wait for 2.4 s each, as nine took 2 s and the one that runs will take 6 s, 3 s more; two at a time
    assert drawn.caption == "10 of 100 ended, 1 failed, 54.0 a minute, about 1:48 left"
    table.lengths.clear()
    assert table.time_left(running, now=10.0) == pytest.approx((89 * 6 + 3) / 2)  # half is done in 3 s


def test_the_time_left_does_not_jump_when_a_job_ends(tmp_path):
    """A job counts alike just before and just after its end, however long others took."""
    table, _ = table_of(10)
    write_json(tmp_path / "progress.json", {"frame": 60, "frames": 60, "substeps": 5})
    slow = Job("slow", lambda job: b"", folder=tmp_path, state="running", tries=1, started=0.0)
    table([], [ended("fast", seconds=2.0)])
    before = table.time_left([slow], now=20.0)
    table([], [ended("slow", seconds=20.0)])
    assert table.time_left([], now=20.0) == pytest.approx(before) == 8 * 11 / 2


def test_lines_in_a_log_file(tmp_path):
    """One for each that ended, with the reason of a failure; those found done need none."""
    table, screen = table_of(4)
    found = Job("old", lambda job: b"", state="done")
    table([], [found, ended("a"), ended("b", "failed", result=Lost("the process ended with code 7"))])
    table([], [ended("c", "timed out", result=Lost("stopped after 9 s, its time limit"))])
    assert screen.getvalue().splitlines() == [
        "[2/4] a: done in 0:02, about 0:02 left",
        "[3/4] b: failed in 0:02: the process ended with code 7, about 0:02 left",
        "[4/4] c: timed out in 0:02: stopped after 9 s, its time limit",
    ]


def test_the_clock():
    assert [clock(s) for s in (0, 59.9, 61, 3600, 36061)] == ["0:00", "0:59", "1:01", "1:00:00", "10:01:01"]
