"""``snowrepro retry``: run again what failed."""

import argparse
from collections.abc import Sequence

from ...errors import ExitCode
from ...store import run as store_run
from ...store import states
from ...sweep import explain, record
from ...sweep import plan as sweep_plan
from .. import candidates, plans, scenes, screen, single, sweeping
from ..arguments import EXITS, SWEEP, add_folders, add_needless_multirun, complete_by

HELP = f"""\
A run that diverged is not run again by itself, as it would diverge again.  This runs what failed or took too long.

examples:
  snowrepro retry grid
  snowrepro retry grid hydra.launcher.time_limit_minutes=60
  snowrepro retry ball-L-740-paper-paper-0-5ae7c16ddc

{EXITS}
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which run or sweep."""
    add_needless_multirun(parser)
    overrides = parser.add_argument("overrides", nargs="+", help=f"id of a run, {SWEEP}; and settings of the launcher")
    complete_by(overrides, candidates.any_of(candidates.list_sweeps, candidates.list_overrides, candidates.list_runs))
    add_folders(parser)


def execute(options: argparse.Namespace) -> ExitCode:
    """Forget the failures of a run or a sweep, and run it again."""
    store, words = sweep_plan.split_store(options.overrides)
    sweep = record.find_sweep(words[0], store, words[1:]) if words else None
    if words and plans.is_name(words[0]) and not sweep:
        run = explain.run_named(words[0], store, or_sweep=True)
        _forget_failures([run])
        single.run_and_print(run)
        return ExitCode.FINE
    if sweep:
        plan = record.plan_remembered(sweep, store, words[1:])
    else:
        plan = plans.plan_sweep(options.overrides, multirun=True)
    scenes.build_scenes(plan)
    _forget_failures(plan.runs)
    sweeping.run_missing(plan)
    return sweeping.require_results(plan)


def _forget_failures(runs: Sequence["store_run.Run"]) -> None:
    """Let those of some runs that failed or took too long be tried again."""
    failed = [run for run in runs if states.standing(run).state in (states.FAILED, states.TIMED_OUT)]
    screen.say(f"{len(failed)} failed before")
    for run in failed:
        run.forget_outcome()
