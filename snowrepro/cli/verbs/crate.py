"""``snowrepro crate``: a folder to publish, with a sweep's files and how each was made."""

import argparse
from pathlib import Path

from ...errors import ExitCode
from ...report import crate
from .. import candidates, screen
from ..arguments import EXITS, add_reports, add_store, complete_by

HELP = f"""\
Copies the runs with their manifests and logs, the tables of the sweep and its report, as it stands, into a folder of
their own, with ro-crate-metadata.json (Process Run Crate 0.5): which run made which file, when, with what, and which
failed.  Under which licence and by whom is not known to the store: state it.  snowrepro reads the folder's runs/.

examples:
  snowrepro crate fig5 --license CC-BY-4.0
  snowrepro crate fig5 --agent "Ada Snow" --orcid 0000-0002-1825-0097 --out upload/fig5
  snowrepro crate 2f63b27e3e                one run

{EXITS}
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which sweep or run, where to, and what the store does not know of it."""
    sweep = parser.add_argument(
        "sweep", metavar="SWEEP", help="a remembered sweep, or id of a run (or its beginning or end)"
    )
    complete_by(sweep, candidates.any_of(candidates.list_sweeps, candidates.list_runs))
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="a new one (default: <SWEEP>-crate)")
    parser.add_argument("--license", metavar="ID", help="of what is published: an SPDX identifier or a URL")
    parser.add_argument("--agent", metavar="NAME", help="who made the runs")
    parser.add_argument("--orcid", metavar="ID", help="of whoever that is")
    add_store(parser)
    add_reports(parser)


def execute(options: argparse.Namespace) -> ExitCode:
    """Write a sweep or a run as an RO-Crate."""
    terms = crate.parse_terms(options.license, options.agent, options.orcid)
    folder = options.out or Path(f"{Path(options.sweep).name}-crate")
    lacking = crate.write_crate(options.sweep, options.store, folder, terms, options.reports)
    if lacking:
        screen.say(f"without a result: {lacking}")
    screen.show(folder)
    return ExitCode.FINE
