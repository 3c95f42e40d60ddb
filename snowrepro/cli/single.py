"""One run in this process, with a progress bar."""

import logging
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..run import do_run
from ..store.run import Run
from ..summary.outcome import describe_outcome, list_units
from ..summary.row import read_row
from ..text import make_printable
from .progress import build_bar
from .screen import print_rows, say, show

USUAL_STORE = "runs"  # of all commands, where none is given


def run_and_print(run: Run) -> None:
    """Do a run as far as it is not done; print what came of it, where its result is, and what can be done next."""
    path = run_here(run)
    print_outcome(read_row(run), run.case.reading.length_unit)
    show(path)
    say("\n".join(_list_next_steps(run)))


def print_outcome(row: Mapping[str, Any], length_unit: str) -> None:
    """Print what came of a run: a sentence, then all numbers with their units."""
    show(describe_outcome(row, length_unit), "")
    print_rows(row, list_units(row, length_unit))


def _list_next_steps(run: Run) -> list[str]:
    """List the commands with which one goes on from a single run."""
    name, folder = shlex.quote(run.id), str(run.store)
    store = f" --store {shlex.quote(folder)}" if folder != USUAL_STORE else ""
    steps = {
        f"snowrepro animate {name}{store} --out run.gif": "watch it",
        f"snowrepro explain {name}{store}": "what made it, and its log",
    }
    if run.case.indenter is None:
        steps[f"snowrepro classify {name}{store} definition=bonds"] = "lumps by another definition"
    width = max(map(len, steps))
    lines = [f"  {command:{width}}  # {why}" for command, why in steps.items()]
    return ["next:", *lines, "What a number means: snowrepro explain lump_fraction"]


def run_here(run: Run) -> Path:
    """Do a run in this process as far as it is not done; returns its result's path."""
    is_done = run.is_current()
    if is_done:
        say("this run is done")
    else:
        logging.getLogger("snowrepro").addHandler(_build_log_handler())
    with build_bar("frame", is_hidden=is_done) as bar:
        task = bar.add_task("run", total=run.case.frames)
        return do_run(run, lambda progress: bar.update(task, completed=progress.frame))


def _build_log_handler() -> logging.Handler:
    """A handler that shows the run's log on the error stream, without errors: those are told once, at the end."""
    handler = logging.StreamHandler()
    handler.setFormatter(_OneLine("%(message)s"))
    handler.addFilter(lambda record: record.levelno < logging.ERROR)
    return handler


class _OneLine(logging.Formatter):
    """Writes a message on one line, whatever letters it has."""

    def format(self, record: logging.LogRecord) -> str:
        """The message."""
        return make_printable(super().format(record))
