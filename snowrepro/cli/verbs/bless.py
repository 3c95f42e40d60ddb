"""``snowrepro bless``: renew the references of ``snowrepro check``."""

import argparse
from pathlib import Path

from ...checks import baseline, bless
from ...errors import ExitCode
from ...store import files
from .. import checking, screen
from ..arguments import EXITS, add_checked

HELP = f"""\
Makes the references of 'snowrepro check' anew with this code, shows what changes, and keeps a log of it.  Refuses code
that differs from the clone's last commit.

examples:
  snowrepro bless --reason "Eq. 9 weighs an update by its time, see the log of that commit"
  snowrepro bless --tier 1 --reason "fingerprints of macOS on arm64"

{EXITS}
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What is to be renewed, and why."""
    parser.add_argument("--reason", metavar="TEXT", help="why they change; goes into the log")
    parser.add_argument("--full", action="store_true", help="also what only a full check compares with")
    add_checked(parser)


def execute(options: argparse.Namespace) -> ExitCode:
    """Renew references, and say what that changes."""
    request = checking.read_options(options)
    for folder in (options.baseline, Path(options.store)):
        files.require_writable(folder)
    for line in bless.bless(request, options.reason or ""):
        print(line, flush=True)
    screen.say(f"renewed {options.baseline}, see {options.baseline / baseline.LOG}; commit it")
    return ExitCode.FINE
