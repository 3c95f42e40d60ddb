"""``snowrepro explain``: why a run is done, stale, failed or not run, with its log; what a name means."""

import argparse

from ...errors import ConfigError, ExitCode
from ...sweep import explain
from .. import candidates, meanings, screen
from ..arguments import add_store, complete_by

HELP = """\
examples:
  snowrepro explain ball-L-2900-paper-paper-0-0123456789
  snowrepro explain lump_fraction
  snowrepro explain reading.contact
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which run, or which name."""
    run = parser.add_argument(
        "run", metavar="NAME", help="id of a run, or its beginning or end; a column of numbers; a setting"
    )
    complete_by(run, candidates.list_runs)
    add_store(parser)


def execute(options: argparse.Namespace) -> ExitCode:
    """Say where a run stands and why, with its log; or what a column or a setting means."""
    if said := meanings.describe_name(options.run):
        screen.show(*said)
        return ExitCode.FINE
    try:
        screen.show(*explain.explain(options.run, options.store))
    except ConfigError as error:
        raise ConfigError(f"{error}; nor is it a column of numbers or a setting") from error
    return ExitCode.FINE
