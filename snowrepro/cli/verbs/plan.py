"""``snowrepro plan``: say what would be run, why, and how long it takes."""

import argparse
from pathlib import Path

from ...errors import ExitCode
from ...sweep import batch, todo
from .. import candidates, costs, plans, scenes, screen
from ..arguments import SWEEP, add_folders, add_multirun, add_verify, complete_by

HELP = """\
Says without running anything what 'snowrepro run' with the same words would run, why, and how long it would take.

examples:
  snowrepro plan experiment=grid seeds=3
  snowrepro plan experiment=grid rerun=[code,environment] --list
  snowrepro plan experiment=grid --sbatch grid.sh     a job array for Slurm; then: sbatch grid.sh
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which sweep, and what is to be said or written of it."""
    add_multirun(parser)
    parser.add_argument("--list", action="store_true", help="every run with its reason")
    add_verify(parser)
    parser.add_argument("--sbatch", type=Path, metavar="FILE", help="write a job array for Slurm")
    parser.add_argument(
        "--tasks", type=int, default=1000, metavar="N", help="of the array, at most (default: %(default)s)"
    )
    overrides = parser.add_argument("overrides", nargs="*", help=SWEEP)
    complete_by(overrides, candidates.any_of(candidates.list_sweeps, candidates.list_overrides))
    add_folders(parser)


def execute(options: argparse.Namespace) -> ExitCode:
    """Say what would be run and why, without running anything."""
    plan = plans.plan_sweep(options.overrides, options.multirun)
    scenes.check_sizes(plan)
    decided = todo.decide(plan, options.verify)
    for line in costs.describe_todo(plan, decided, costs.estimate_todo(plan, decided)):
        screen.show(line)
    if options.list:
        for decision in decided.decisions:
            detail = f" ({decision.detail})" if decision.detail and decision.detail != decision.why else ""
            screen.show(f"{decision.action:4}  {decision.planned.run.id}: {decision.why}{detail}")
    if options.sbatch:
        scenes.build_scenes(plan)  # what is refused is not to be submitted, nor remembered
        batch.write_script(options.sbatch, plan, decided, options.tasks)
        screen.show(f"sbatch {options.sbatch}")
    return ExitCode.FINE
