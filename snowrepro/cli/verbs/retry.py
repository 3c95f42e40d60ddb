"""``snowrepro retry``: run again what failed."""

import argparse

from ...errors import ExitCode
from ...store import states
from ...sweep import explain, record
from ...sweep import plan as sweep_plan
from .. import candidates, plans, screen, single, sweeping
from ..arguments import EXITS, SWEEP, add_folders, add_multirun, complete_by

HELP = f"""\
A run that diverged is not run again by itself, as it would diverge again.  This runs what failed or took too long.

examples:
  snowrepro retry grid
  snowrepro retry grid hydra.launcher.time_limit_minutes=60
  snowrepro retry ball-L-530-paper-paper-0-2f63b27e3e

{EXITS}
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which run or sweep."""
    add_multirun(parser)
    overrides = parser.add_argument("overrides", nargs="+", help=f"id of a run, {SWEEP}; and settings of the launcher")
    complete_by(overrides, candidates.any_of(candidates.list_sweeps, candidates.list_overrides, candidates.list_runs))
    add_folders(parser)


def execute(options: argparse.Namespace) -> ExitCode:
    """Forget the failures of a run or a sweep, and run it again."""
    store, words = sweep_plan.split_store(options.overrides)
    sweep = record.find_sweep(words[0], store, words[1:]) if words else None
    names_run = words and plans.is_name(words[0]) and not sweep
    plan = record.plan_remembered(sweep, store, words[1:]) if sweep else None
    if not (plan or names_run):
        plan = plans.plan_sweep(options.overrides, options.multirun)
    runs = plan.runs if plan else [explain.run_named(words[0], store)]
    failed = [run for run in runs if states.standing(run).state in (states.FAILED, states.TIMED_OUT)]
    screen.say(f"{len(failed)} failed before")
    for run in failed:
        run.forget_outcome()
    if plan is None:
        single.run_and_print(runs[0])
        return ExitCode.FINE
    sweeping.build_scenes(plan)
    sweeping.run_missing(plan)
    return sweeping.require_results(plan)
