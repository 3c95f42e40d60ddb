"""Run pickled calls, each in a fresh process, as many at a time as cores and memory allow.

Processes are forked from a server that has imported what a run needs and done nothing with it: as fresh as
new ones, and there at once.  A job that crashes is tried again and then is one failed job.  Ctrl-C ends the
running jobs and is passed on; where this process is killed, its jobs end too.
"""

import multiprocessing
import os
import signal
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing import connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import cloudpickle
import psutil

from ..compiler import keep_kernels
from .scratch import make_scratch_folder, start_server

POLL_SECONDS = 0.05
ELSEWHERE_SECONDS = 1.0  # between two looks at what another process works on
GRACE_SECONDS = 10.0  # between asking a process to end and killing it
PRELOADED = ["snowrepro.run", "snowrepro.simulation", "snowrepro.sweep.processes", "hydra.core.utils"]
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

WAITING, RUNNING, DONE, FAILED, TIMED_OUT = "waiting", "running", "done", "failed", "timed out"


@dataclass(frozen=True)
class Limits:
    """What a job may take.

    ``workers``: jobs at a time; ``seconds``: of a job, 0 for no limit; ``retries``: after crashes.
    """

    workers: int
    seconds: float = 0.0
    retries: int = 1


@dataclass
class Job:
    """One call.  ``make`` gives the pickled function without arguments, when the job is about to start.

    ``folder`` is where the job reports progress; ``is_elsewhere`` says that another process does the same
    work, and may find that it has been done; ``on_loss`` is told the state and the message of a job that
    ended without an answer.
    """

    label: str
    make: Callable[["Job"], bytes]
    folder: Path | None = None
    is_elsewhere: Callable[["Job"], bool] = lambda job: False
    on_loss: Callable[[str, str], None] = lambda state, message: None
    state: str = WAITING
    tries: int = 0
    started: float = 0.0
    seconds: float = 0.0
    payload: bytes = field(default=b"", repr=False)
    result: Any = field(default=None, repr=False)


@dataclass
class _Running:
    """A job's process, the file of its answer, and when it was told to end."""

    job: Job
    process: BaseProcess
    answer: Path
    terminated_at: float | None = None


class Lost(RuntimeError):
    """A process that ended without an answer."""


def usable_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def free_memory() -> int:
    """Bytes that may still be used, by this machine's memory and by the limit of this process' control group."""
    free = psutil.virtual_memory().available
    with suppress(OSError, ValueError, IndexError):
        group = Path("/proc/self/cgroup").read_text().split("::", 1)[1].splitlines()[0]
        folder = Path("/sys/fs/cgroup") / group.lstrip("/")
        free = min(free, int((folder / "memory.max").read_text()) - int((folder / "memory.current").read_text()))
    return max(free, 0)


def run_jobs(jobs: Sequence[Job], limits: Limits, watch: Callable[[Sequence[Job], Sequence[Job]], None]) -> None:
    """Run all jobs; ``watch`` is called several times a second with those that run and those that just ended.

    A job's ``result`` is then what its call returned, or the exception that ended it.
    """
    waiting, elsewhere, running = deque(jobs), deque[Job](), list[_Running]()
    looked = time.monotonic()
    with tempfile.TemporaryDirectory(dir=make_scratch_folder()) as scratch:
        try:
            while waiting or elsewhere or running:
                if elsewhere and time.monotonic() - looked > ELSEWHERE_SECONDS:
                    waiting, elsewhere, looked = waiting + elsewhere, deque(), time.monotonic()
                ended = []
                while waiting and len(running) < limits.workers:
                    job = waiting.popleft()
                    job.payload = job.payload or job.make(job)
                    if job.is_elsewhere(job):
                        elsewhere.append(job)
                    elif job.state == WAITING:
                        running.append(_start(job, Path(scratch)))
                    else:
                        ended.append(job)
                _pause(running)
                for entry in [e for e in running if _has_ended(e, limits)]:
                    running.remove(entry)
                    (waiting if entry.job.state == WAITING else ended).append(entry.job)
                watch([entry.job for entry in running], ended)
        finally:
            end_processes([entry.process for entry in running])


def _pause(running: Sequence[_Running]) -> None:
    """Wait a moment, or until a process ends."""
    if not running:
        time.sleep(POLL_SECONDS)
    connection.wait([entry.process.sentinel for entry in running], POLL_SECONDS)


def _start(job: Job, scratch: Path) -> _Running:
    """Start the process of a job.

    Its call is in a file: in the pipe to the new process it would wait for that to have imported what it needs, and the
    next process with it.
    """
    job.tries += 1
    answer = scratch / f"{id(job)}.{job.tries}"
    call = answer.with_suffix(".call")
    call.write_bytes(job.payload)
    process = _context().Process(target=_child, args=(str(call), str(answer), dict(os.environ)), daemon=False)
    with _one_thread():
        process.start()
    job.state, job.started = RUNNING, time.monotonic()
    return _Running(job, process, answer)


def _has_ended(entry: _Running, limits: Limits) -> bool:
    """Whether a process is gone; takes over its answer, and ends it where its time is up."""
    job, now = entry.job, time.monotonic()
    if entry.process.is_alive():
        if entry.terminated_at is None and limits.seconds and now - job.started > limits.seconds:
            entry.terminated_at = now
            entry.process.terminate()
        elif entry.terminated_at is not None and now - entry.terminated_at > GRACE_SECONDS:
            entry.process.kill()
        return False
    entry.process.join()
    job.seconds = now - job.started
    try:
        job.result = cloudpickle.loads(entry.answer.read_bytes())
        job.state = FAILED if isinstance(job.result, BaseException) else DONE
        job.payload = b""
    except Exception:  # whatever it was that the answer could not be read for
        if entry.terminated_at is None and job.tries <= limits.retries:
            job.state = WAITING
            return True
        job.state = FAILED if entry.terminated_at is None else TIMED_OUT
        ended = f"the process ended with {_code(entry.process.exitcode)} and no result"
        message = ended if entry.terminated_at is None else f"stopped after {limits.seconds:g} s, its time limit"
        job.result = Lost(message)
        job.on_loss(job.state, message)
    return True


def _code(exit_code: int | None) -> str:
    """An exit code for a reader."""
    if exit_code is not None and exit_code < 0:
        with suppress(ValueError):
            return signal.Signals(-exit_code).name
    return f"code {exit_code}"


def end_processes(processes: Sequence[BaseProcess]) -> None:
    """Ask processes to end, and see to it that they do."""
    for process in processes:
        process.terminate()
    deadline = time.monotonic() + GRACE_SECONDS
    for process in processes:
        process.join(max(0.0, deadline - time.monotonic()))
        process.kill()
        process.join()


def start_process(function: Callable[..., None], *arguments: Any) -> BaseProcess:
    """Start a process that does nothing but call a function; where this process is killed, it ends too."""
    process = _context().Process(target=_serve, args=(function, arguments, dict(os.environ)), daemon=False)
    with _one_thread():
        process.start()
    return process


def _serve(function: Callable[..., None], arguments: Sequence[Any], environment: dict[str, str]) -> None:
    """Entry of a process that goes on until it is ended."""
    _prepare_child(environment)
    with suppress(KeyboardInterrupt):
        function(*arguments)


def _prepare_child(environment: dict[str, str]) -> None:
    """Take the parent's environment, leave Ctrl-C to it, and end with it; being terminated lets a job tidy up."""
    os.environ.clear()
    os.environ.update(environment)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the parent, which ends its jobs in order
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _context() -> Any:
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(PRELOADED)
    return context


@contextmanager
def _one_thread() -> Iterator[None]:
    """The server's libraries start no threads of their own."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update({name: value for name, value in ONE_THREAD.items() if name not in os.environ})
    try:
        start_server()
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]


def _child(call: str, answer: str, environment: dict[str, str]) -> None:
    """Entry of the fresh process."""
    _prepare_child(environment)
    try:
        payload = Path(call).read_bytes()
        Path(call).unlink()
        result = cloudpickle.loads(payload)()
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception as error:  # the parent reports it
        result = error
    partial = Path(answer + ".part")
    partial.write_bytes(cloudpickle.dumps(result))
    partial.replace(answer)
    if not isinstance(result, Exception):
        keep_kernels()


def _end_with_parent() -> None:
    """Nobody waits for the answer any more."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    connection.wait([parent.sentinel])
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(GRACE_SECONDS)
    os._exit(1)
