"""Run pickled jobs, each in a fresh process, as many at a time as there are cores.

A job that crashes is one failed job.  Ctrl-C ends the running jobs and is passed on.
"""

import multiprocessing
import os
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import cloudpickle

POLL_SECONDS = 0.1
GRACE_SECONDS = 10.0


@dataclass
class Job:
    """One call: ``payload`` is a pickled function without arguments; ``folder`` is where it reports progress."""

    label: str
    payload: bytes
    folder: Path | None = None
    state: str = "waiting"  # waiting, running, done, failed
    started: float = 0.0
    seconds: float = 0.0
    result: Any = field(default=None, repr=False)


def usable_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_jobs(jobs: Sequence[Job], workers: int, watch: Callable[[Sequence[Job]], None]) -> None:
    """Run all jobs that wait; ``watch`` is called several times a second.

    A job's ``result`` is then what its call returned, or the exception that ended it.
    """
    context = multiprocessing.get_context("spawn")
    waiting = [job for job in jobs if job.state == "waiting"]
    running: list[tuple[Job, BaseProcess, Path]] = []
    with tempfile.TemporaryDirectory() as scratch:
        try:
            while waiting or running:
                while waiting and len(running) < workers:
                    running.append(_start(context, waiting.pop(0), Path(scratch)))
                time.sleep(POLL_SECONDS)
                for entry in [e for e in running if not e[1].is_alive()]:
                    _finish(*entry)
                    running.remove(entry)
                watch(jobs)
        finally:
            for _, process, _ in running:
                process.terminate()
            for _, process, _ in running:
                process.join(GRACE_SECONDS)
                process.kill()


def _start(context: Any, job: Job, scratch: Path) -> tuple[Job, BaseProcess, Path]:
    answer = scratch / f"{id(job)}.pickle"
    process = context.Process(target=_child, args=(job.payload, str(answer)))
    with _interrupts_ignored():
        process.start()
    job.state, job.started = "running", time.monotonic()
    return job, process, answer


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """What is started inside never sees Ctrl-C: the parent does, and ends its jobs in order."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)


def _finish(job: Job, process: BaseProcess, answer: Path) -> None:
    """Take over what a process that has ended left behind."""
    process.join()
    job.seconds = time.monotonic() - job.started
    if answer.exists():
        job.result = cloudpickle.loads(answer.read_bytes())
    else:
        job.result = RuntimeError(f"{job.label}: the process ended with code {process.exitcode} and no result")
    job.state = "failed" if isinstance(job.result, BaseException) else "done"


def _child(payload: bytes, answer: str) -> None:
    """Entry of the fresh process; being terminated lets the job tidy up."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        result = cloudpickle.loads(payload)()
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception as error:  # the parent reports it
        result = error
    partial = Path(answer + ".part")
    partial.write_bytes(cloudpickle.dumps(result))
    os.replace(partial, answer)
