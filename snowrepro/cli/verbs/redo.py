"""``snowrepro redo``: do a run again from its manifest, and say whether it came to the same bits."""

import argparse
from pathlib import Path

from ...errors import ConfigError, ExitCode
from ...evidence import redo
from .. import candidates, screen, single
from ..arguments import add_store, complete_by

HELP = """\
RUN is the id of one in the store (or its beginning or end), its folder, or its manifest.json alone, which says all that
is needed.  The run is simulated again into a store of its own, by this program; called again, it goes on where it was
stopped, and does not repeat what is redone unless the code or the environment has changed.  It is compared with run.nc
where that is beside the manifest, and with the checksums of the arrays in the manifest.

examples:
  snowrepro redo 2f63b27e3e
  snowrepro redo manifest.json
  snowrepro redo /shared/runs/ball-L-740-paper-paper-0-5ae7c16ddc --into elsewhere

exit codes: 0 the same bits, 1 not the same bits, 2 bad input (no such run, broken manifest), 3 the run failed,
4 redone, but nothing to compare with, 130 interrupted
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which run, and where to."""
    run = parser.add_argument("run", metavar="RUN", help="id or folder of a run, or a manifest")
    complete_by(run, candidates.any_of(candidates.list_runs, otherwise=candidates.list_files))
    parser.add_argument(
        "--into", default="redone", metavar="FOLDER", help="store of the redone run (default: %(default)s)"
    )
    add_store(parser)


def execute(options: argparse.Namespace) -> ExitCode:
    """Do a run again from its manifest, and compare it with what it was."""
    original = redo.find_original(options.run, options.store)
    if Path(options.into).resolve() == Path(options.store).resolve():
        raise ConfigError(f"'{options.into}' is the store, in which nothing is to be replaced: choose another folder")
    run = redo.make_repetition(original, options.into)
    single.run_here(run)
    comparison = redo.compare_with_original(original, run)
    screen.show(*redo.describe_repetition(comparison))
    if not comparison.is_compared:
        return ExitCode.INCOMPLETE
    return ExitCode.REGRESSED if comparison.changes else ExitCode.FINE
