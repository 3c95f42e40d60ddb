"""``snowrepro claims``: decide the paper's claims by an experiment with several seeds."""

import argparse

from ...errors import ConfigError, ExitCode
from ...evidence import gather
from ...report.figures import kinds
from ...report.page import folder
from ...sweep import plan as sweep_plan
from .. import candidates, reporting, scenes, screen, sweeping
from ..arguments import EXITS, add_folders, add_needless_multirun, add_no_report, complete_by

DEFAULT_SEEDS = 3
HELP = f"""\
Runs the experiment with the seeds 0 to N - 1, as far as it is not done, and judges the paper's claims by the
rules of conf/claims: a table here; pictures, claims.json and claims.csv with the experiment's report, in
my_reports/<name of the sweep>/.

examples:
  snowrepro claims experiment=fig5
  snowrepro claims experiment=grid seeds=5 fidelity=preview

{EXITS.replace("fine,", "fine, whatever the verdicts,")}
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which experiment, and how many seeds."""
    add_needless_multirun(parser)
    overrides = parser.add_argument(
        "overrides", nargs="*", help=f"experiment=..., seeds=N (default: {DEFAULT_SEEDS}) and other overrides"
    )
    complete_by(overrides, candidates.list_overrides)
    add_no_report(parser)
    add_folders(parser, writes_reports=True)


def execute(options: argparse.Namespace) -> ExitCode:
    """Run what is not done of an experiment with several seeds, then judge the claims from the store."""
    seeds, overrides = sweep_plan.split_seeds(options.overrides)
    plan = sweep_plan.make_claims_plan(overrides, DEFAULT_SEEDS if seeds is None else seeds)
    experiment = plan.experiment
    assert experiment is not None, "make_claims_plan requires one"
    if not kinds.find_figure(experiment).is_judged:
        raise ConfigError(f"claims are not judged by '{experiment.name}', but by a strip or grid, such as fig5")
    sweep_plan.require_one_run_a_cell(plan)
    kinds.require_drawable(plan.runs)
    scenes.build_scenes(plan)
    sweeping.run_missing(plan)
    sweeping.write_table(plan)
    if options.no_report:
        evidence = gather.gather_evidence(plan.runs, folder.find_report_folder(plan.runs[0], plan.overrides))
        screen.show(*reporting.describe_claims(evidence, plan))
    else:
        reporting.print_claims(plan)
    return sweeping.require_results(plan)
