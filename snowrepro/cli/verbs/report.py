"""``snowrepro report``: one page with verdicts, pictures and data, from the store alone."""

import argparse
import shlex
from collections.abc import Sequence

from ...composition import overrides
from ...errors import ConfigError, ExitCode
from ...report.figures import kinds
from ...report.page import compare
from ...sweep import plan as sweep_plan
from ...sweep import record
from .. import candidates, plans, reporting, screen
from ..arguments import EXITS, add_folders, add_needless_multirun, complete_by

PAPER = "paper"
HELP = f"""\
Runs nothing.  Writes index.html, one file that needs nothing beside it, with index.md and report.json, into
my_reports/paper/ or my_reports/<name of the sweep>/, with every seed that the sweep was asked for with.

examples:
  snowrepro report                         the whole paper
  snowrepro report fidelity=preview        the same from coarse runs
  snowrepro report fig5
  snowrepro report fig5 seeds=3 store=/shared/runs
  snowrepro report pressure=300,2900,sintering=paper,none   any sweep, by the name that 'snowrepro status' shows
  snowrepro report pressure=300,2900 sintering=paper,none   the same, by the words of 'snowrepro run -m'
  snowrepro report fig5 --against fig5,reading=si           two sweeps side by side, differences first
  snowrepro report fig5 --against fig5 --against-store ../before/runs      two versions

{EXITS}
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which experiment or sweep, and what to set beside it."""
    against = parser.add_argument(
        "--against", metavar="B", help="a second experiment or sweep, to set beside the first"
    )
    complete_by(against, candidates.any_of(candidates.list_sweeps, candidates.list_experiments))
    parser.add_argument("--against-store", metavar="FOLDER", help="where the runs of B are (default: the same store)")
    words = parser.add_argument(
        "overrides", nargs="*", help="experiment or name of a remembered sweep (default: the paper); overrides"
    )
    complete_by(
        words,
        candidates.any_of(candidates.list_sweeps, candidates.list_experiments, candidates.list_overrides),
    )
    add_needless_multirun(parser)
    add_folders(parser, writes_reports=True)


def execute(options: argparse.Namespace) -> ExitCode:
    """Write a report from the store alone: of the whole paper, or of one experiment or sweep."""
    store, words = sweep_plan.split_store(options.overrides)
    name = words.pop(0) if words and plans.names_sweep(words[0], store) else ""
    if options.against:
        return _compare(name, words, options.against, store, options.against_store or store)
    names_experiment = any(word.startswith("experiment=") for word in words)
    if name == PAPER or not (name or names_experiment or _ask_for_own_sweep(words, store)):
        if any(word.startswith(("seeds=", "seed=")) for word in words):
            raise ConfigError(
                "without a name this is the report on the paper, which shows every seed that was asked for: leave out "
                "the seeds; for that of a sweep give its name, which 'snowrepro status' lists"
            )
        words.append(overrides.override_folder("store", store))
        reporting.print_paper_report(words, store)
        return ExitCode.FINE
    expanded = plans.expand_name(name, words, store)
    choosing = ("seeds=", "seed=") if name else ("seeds=",)  # without a name, seed= is one of the sweep's own words
    chooses_seeds = any(word.startswith(choosing) for word in words)
    if not chooses_seeds and not any(word.startswith("experiment=") for word in expanded):
        # The folder has no seeds in its name, so that it is of all that the sweep was asked for with.
        expanded = record.add_remembered_seeds(record.drop_seeds(expanded), store)
    reporting.print_report(expanded, store)
    return ExitCode.FINE


def _ask_for_own_sweep(words: Sequence[str], store: str) -> bool:
    """Whether overrides are those of a remembered sweep.  Raises ConfigError where they could only be, and are not."""
    _, others = sweep_plan.split_seeds(words)
    if not others:
        return False
    if record.find_records(others, store):
        return True
    if sweep_plan.split_swept(record.drop_seeds(others))[1]:
        asked = shlex.join(["snowrepro", "run", "-m", *words])
        raise ConfigError(f"{record.explain_missing(record.name_sweep(words), store)}; this makes it: {asked}")
    return False


def _compare(name: str, words: Sequence[str], against: str, store: str, against_store: str) -> ExitCode:
    """Write two sweeps side by side; further overrides hold for both."""
    if not name:
        raise ConfigError(f"what is '{against}' to be set beside? snowrepro report A --against {against}")
    compared = []
    for sweep, its_store in ((name, store), (against, against_store)):
        overrides = record.add_remembered_seeds(plans.expand_name(sweep, words, its_store), its_store)
        plan = sweep_plan.make_plan(overrides, multirun=True)
        if not kinds.needs_runs(plan.runs):
            raise ConfigError(f"'{sweep}' is no experiment with runs: there is nothing to compare")
        compared.append(plan)
    screen.show(f"report: {reporting.leave_out_broken(lambda: compare.write_comparison(*compared))}")
    return ExitCode.FINE
