"""One run in this process, with a progress bar."""

import logging
from pathlib import Path

from ..run import do_run
from ..store.run import Run
from ..summary.row import read_row
from ..text import make_printable
from .progress import build_bar
from .screen import print_rows, say, show


def run_and_print(run: Run) -> None:
    """Do a run as far as it is not done, and print its numbers and where its result is."""
    path = run_here(run)
    print_rows(read_row(run))
    show(path)


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
