"""``snowrepro.run_sweep``: a sweep from Python, as ``snowrepro run -m`` does it."""

import signal
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Sequence
from typing import IO

import xarray as xr

from ..errors import ConfigError, ExitCode, RunsFailed
from ..evidence.collect import collect_sweep, describe_missing, make_grid
from ..progress import show_progress
from ..store.run import Run, read_progress
from ..sweep.plan import Plan, make_plan, split_seeds, with_seeds

LOOK_SECONDS = 0.5  # between two looks at the store
ORDERLY_SECONDS = 15.0  # that a sweep may take to end its runs


def run_sweep(overrides: Sequence[str], progress: bool = True) -> xr.Dataset:
    """Run what is not done of a sweep, one process per core, and return its numbers as ``open_sweep`` does.

    ``overrides``: as behind ``snowrepro run -m``, for example ``["pressure=500,2000", "seeds=3"]``; an experiment also
    gets its report.  ``progress``: whether to show how far it is, on a terminal or in a notebook.  A run without a
    result is a warning, and ``state`` of the sweep says which it is.  An interrupted sweep goes on with the same call.
    Raises ConfigError, before anything is run, and RunsFailed where the sweep as a whole fails.
    """
    seeds, words = split_seeds(overrides)
    if seeds is not None:
        words = with_seeds(words, seeds)
    plan = make_plan(words, multirun=True)
    with tempfile.TemporaryFile() as said:
        code = _run_command(words, plan, said, progress)
        said.seek(0)
        message = said.read().decode(errors="replace").strip().rpartition("\n")[2].removeprefix("error: ")
    if code == ExitCode.USAGE:
        raise ConfigError(message)
    sweep = collect_sweep(plan)
    if missing := describe_missing(sweep.table):
        warnings.warn(f"no result of {missing}", stacklevel=2)
    elif code != ExitCode.FINE:
        raise RunsFailed(message or f"the sweep ended with code {code}")
    return make_grid(sweep)


def _run_command(words: Sequence[str], plan: Plan, said: IO[bytes], progress: bool) -> int:
    """Run the command line in a process of its own, and show how far it is; returns its exit code.

    A process of its own: a script that calls this needs no ``if __name__ == "__main__"``, and Ctrl-C ends it in order.
    ``said``: where what it says goes.
    """
    command = [sys.executable, "-m", "snowrepro", "run", "-m", *words]
    runs, done = list({run.id: run for run in plan.runs}.values()), set[str]()
    total = sum(run.case.frames for run in runs)
    with (
        show_progress("frame", total, is_hidden=not progress) as update,
        subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=said) as process,
    ):
        try:
            while _is_running(process):
                update(sum(_count_frames(run, done) for run in runs), total)
        except BaseException:
            _end(process)
            raise
        update(sum(_count_frames(run, done) for run in runs), total)
        return process.returncode


def _end(process: subprocess.Popen) -> None:
    """Have the process of a sweep end in order; Ctrl-C reaches it too, so it is told only if it goes on."""
    try:
        process.wait(ORDERLY_SECONDS)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGINT)


def _is_running(process: subprocess.Popen) -> bool:
    """Whether a process still runs after a moment."""
    try:
        process.wait(LOOK_SECONDS)
    except subprocess.TimeoutExpired:
        return True
    return False


def _count_frames(run: Run, done: set[str]) -> int:
    """Count the frames that the store has of a run; ``done``: the ids of those that were found to have all."""
    if run.id in done or run.is_done():
        done.add(run.id)
        return run.case.frames
    progress = read_progress(run.work)
    return progress.frame if progress else 0
