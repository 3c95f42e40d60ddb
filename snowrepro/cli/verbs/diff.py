"""``snowrepro diff``: what differs between two runs or two sweeps."""

import argparse

from ...errors import ExitCode
from ...evidence import differences
from .. import candidates, screen
from ..arguments import add_store, complete_by

HELP = """\
What differs between two runs, or two sweeps cell by cell: configuration, code, environment, results.

examples:
  snowrepro diff ball-L-740-paper-paper-0-5ae7c16ddc bc03aab03a
  snowrepro diff fig5 fig5,fidelity=preview                an experiment's name: its newest sweep
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which two."""
    list_names = candidates.any_of(candidates.list_sweeps, candidates.list_runs, otherwise=candidates.list_files)
    complete_by(
        parser.add_argument("a", metavar="A", help="id of a run (or its beginning or end), its path, or a sweep"),
        list_names,
    )
    complete_by(parser.add_argument("b", metavar="B", help="likewise"), list_names)
    add_store(parser)


def execute(options: argparse.Namespace) -> ExitCode:
    """Say what differs between two runs or two sweeps."""
    screen.show(*differences.describe_differences(options.a, options.b, options.store))
    return ExitCode.FINE
