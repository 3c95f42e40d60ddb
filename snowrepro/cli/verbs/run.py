"""``snowrepro run``: simulate one run, a sweep or an experiment, and report what came of it."""

import argparse

from ...analysis import states
from ...errors import ExitCode
from ...report.figures import kinds
from ...store import files
from ...store import run as store_run
from ...summary import columns, row
from ...sweep import plan as sweep_plan
from .. import candidates, plans, reporting, scenes, screen, single, sweeping
from ..arguments import EXITS, add_folders, add_multirun, add_no_report, add_part, complete_by

HELP = f"""\
A run or sweep that was stopped in whatever way goes on where it was; what is done is not done again.  Several
calls at once, on one machine or many, share the work.  seeds=N is short for seed=0,..,N-1.

examples:
  snowrepro run shape=ball floor=L pressure=2900 sintering=paper fidelity=preview
  snowrepro run -m pressure=300,2900 sintering=paper,none
  snowrepro run experiment=fig5
  snowrepro run experiment=grid hydra.launcher.workers=4 hydra.launcher.time_limit_minutes=30
  snowrepro run experiment=grid hydra/launcher=ray
  snowrepro run experiment=grid rerun=[code]       again, what was made by other code

{EXITS}
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What is to be run, and which part of it."""
    add_multirun(parser)
    add_part(parser)
    overrides = parser.add_argument(
        "overrides", nargs="*", help="Hydra overrides; 'snowrepro config' shows what there is"
    )
    complete_by(overrides, candidates.list_overrides)
    add_no_report(parser)
    add_folders(parser, writes_reports=True)


def execute(options: argparse.Namespace) -> ExitCode:
    """Validate everything, run what is not done, then report from the store."""
    part = sweep_plan.read_part(options.part) if options.part else None
    return run_plan(plans.plan_overrides(options.overrides, options.multirun, part), part, not options.no_report)


def run_plan(plan: "sweep_plan.Plan", part: tuple[int, int] | None, is_drawn: bool) -> ExitCode:
    """Run what is not done of a plan, or of its ``part``; then report, with pictures if ``is_drawn``."""
    if not plan.runs:
        screen.say("this part of the sweep has no runs")
        return ExitCode.FINE
    scenes.build_scenes(plan)
    if part:
        sweeping.run_missing(plan, is_whole=False)
        return sweeping.require_results(plan)
    if not kinds.needs_runs(plan.runs):
        return _report(plan, is_drawn)
    if plan.is_sweep:
        sweeping.run_missing(plan)
        sweeping.write_table(plan)
        return _report(plan, is_drawn)
    files.require_writable(plan.runs[0].store)
    single.run_and_print(plan.runs[0])
    return ExitCode.FINE


def _report(plan: "sweep_plan.Plan", is_drawn: bool) -> ExitCode:
    """Write the experiment's report if ``is_drawn``, or list the runs of a plain sweep and what can be done next.

    Raises RunsFailed if any run is missing.
    """
    if plan.experiment:
        if is_drawn:
            reporting.print_report(plan.overrides, plan.runs[0].config.execution.store)
    else:
        for run in plan.runs:
            if run.is_done():
                _print_line(run)
        screen.show(*sweeping.describe_sweep(plan))
    return sweeping.require_results(plan)


def _print_line(run: "store_run.Run") -> None:
    """Print one run of a sweep in one line."""
    numbers = row.read_row(run)
    unit = columns.CASE_COLUMNS["pressure"].format_unit([run.case.reading.length_unit])  # and of hardness
    finding = (
        f"hardness {numbers['hardness']:.4g} {unit}"
        if run.case.indenter
        else ", ".join(f"{state} {numbers[f'{state}_fraction']:.3f}" for state in states.STATES)
    )
    screen.show(f"{numbers['run_id']}: {finding}")
