"""``snowrepro sample``: a sweep over points of a design, in place of a list of values."""

import argparse
from collections.abc import Sequence

from ...errors import ConfigError, ExitCode
from ...sweep import plan as sweep_plan
from .. import candidates, plans
from ..arguments import EXITS, add_folders, add_needless_multirun, add_no_report, add_part, complete_by
from . import run

USUAL = "design=sobol"
HELP = f"""\
Settings whose values a design chooses are written as ranges, in quotes for the shell:

  'reading.gravity=log(1,100)'                equal ratios are equally likely
  'pressure=interval(200,6000)'               equal steps are equally likely
  'reading.press_ramp=whole(0,20)'            whole numbers, both ends among them
  'reading.contact=choice(legacy,coulomb)'    names

All else is as with 'snowrepro run -m': sintering=paper,none runs both at every point, and seeds=3 three seeds.

designs:
  sobol     design.points points, evenly spread (default; design.points=64)
  latin     a Latin hypercube of design.points points
  morris    design.points paths, each with one run more than there are settings
  saltelli  design.points points, each with two runs more than there are settings: for indices of total order

More points of sobol, morris or saltelli add to the runs that are there; a Latin hypercube of another size is another
design, and shares no run.  A sample is a sweep: resumed by the same command, and known to status, plan, report, plot,
retry and open_sweep.  'snowrepro sensitivity' says which setting matters most.

examples:
  snowrepro sample 'pressure=log(200,6000)' 'reading.gravity=log(1,100)' design.points=64 fidelity=preview
  snowrepro sample 'pressure=log(200,6000)' 'reading.gravity=log(1,100)' design.points=256 fidelity=preview
  snowrepro sample design=morris design.points=10 'reading.friction=interval(0,1)' 'reading.press_ramp=whole(0,20)'

{EXITS}
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What is sampled, and which part of it is run."""
    add_needless_multirun(parser)
    add_part(parser)
    overrides = parser.add_argument(
        "overrides", nargs="*", help="ranges, design=NAME, design.points=N, design.seed=N, and other overrides"
    )
    complete_by(overrides, candidates.list_overrides)
    add_no_report(parser)
    add_folders(parser, writes_reports=True)


def execute(options: argparse.Namespace) -> ExitCode:
    """Run what is not done of a sample, as 'snowrepro run' does of a sweep."""
    part = sweep_plan.read_part(options.part) if options.part else None
    plan = plans.plan_overrides(add_design(options.overrides), multirun=True, part=part)
    if plan.sample is None:
        raise ConfigError("this experiment has no design: add one, as in design=sobol")
    return run.run_plan(plan, part, not options.no_report)


def add_design(words: Sequence[str]) -> list[str]:
    """The overrides with a design: the usual one, unless they or their experiment name one."""
    names_one = any(word.lstrip("+").startswith(("design=", "experiment=")) for word in words)
    return list(words) if names_one else [USUAL, *words]
