"""``snowrepro explain``: why a run is done, stale, failed or not run; its log."""

import argparse

from ...errors import ExitCode
from ...sweep import explain
from .. import candidates, screen
from ..arguments import add_store, complete_by

HELP = ""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which run."""
    run = parser.add_argument("run", help="id of a run, or its beginning or end")
    complete_by(run, candidates.list_runs)
    add_store(parser)


def execute(options: argparse.Namespace) -> ExitCode:
    """Say where a run stands and why, with its log."""
    screen.show(*explain.explain(options.run, options.store))
    return ExitCode.FINE
