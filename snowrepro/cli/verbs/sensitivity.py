"""``snowrepro sensitivity``: which setting of a sweep matters most for a measure, and where runs fail."""

import argparse

from ...errors import ConfigError, ExitCode
from ...evidence import influence
from ...report.drawing import columns, plot
from ...report.page import folder
from ...report.sections import influence as section
from ...store import files
from ...sweep import plan as sweep_plan
from .. import candidates, screen
from ..arguments import EXITS, add_folders, complete_by

HELP = f"""\
Runs nothing.  Prints for each measure how far each setting decides it, with intervals of 95 %, and where runs fail;
writes influence.png, influence.csv and failures.csv into my_reports/<name of the sweep>/.

  first order      part of the variance that goes with a setting alone; from any sweep or sample of 8 points or more
  total order      also together with others; from design=saltelli
  mean effect, spread of effects      of a step over a setting's range; from design=morris

A measure is a column of results.csv, or 'failed': whether a run fails.  With --only, other settings stay as they are:
the indices are those among the runs with these values.

examples:
  snowrepro sensitivity design.points=64,design=sobol,pressure=log_200,6000_
  snowrepro sensitivity mysample --measure lump_fraction --measure failed
  snowrepro sensitivity mysample --only sintering=paper

{EXITS}
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which sweep, which measures, and which of its runs."""
    sweep = parser.add_argument("sweep", metavar="SWEEP", help="name of a remembered sweep")
    complete_by(sweep, candidates.list_sweeps)
    parser.add_argument(
        "--measure", action="append", default=[], metavar="COLUMN", help="may be repeated (default: the main ones)"
    )
    parser.add_argument(
        "--only", action="append", default=[], metavar="SETTING=VALUE", help="only runs with it; may be repeated"
    )
    parser.add_argument("overrides", nargs="*", help="store=FOLDER, reports=FOLDER")
    add_folders(parser, writes_reports=True)


def execute(options: argparse.Namespace) -> ExitCode:
    """Print how far each setting decides each measure, and write the same as files."""
    store, places = sweep_plan.split_store(options.overrides)
    if any(not word.startswith("reports=") for word in places):
        raise ConfigError(f"'{places[0]}' is no option here; runs are chosen by --only {places[0]}")
    whole = plot.collect_remembered(options.sweep, store, places)
    sweep = columns.select_runs(whole, options.only)
    measures = options.measure or [*columns.list_measures(sweep), influence.FAILED]
    found = [influence.measure_influence(sweep, measure) for measure in measures]
    out = folder.find_report_folder(whole.runs[0], whole.overrides)
    files.require_writable(out)
    section.show_influences(sweep, found, out)
    for each in found:
        _print_influence(each, section.describe_measure(sweep, each.measure))
    failures = section.tabulate_failed(sweep)
    if len(failures):
        screen.show("", section.describe_region(failures))
    if any(len(each.table) for each in found):
        screen.show("", out / section.CSV)
    return ExitCode.FINE


def _print_influence(found: "influence.Influence", name: str) -> None:
    """Print the indices of a measure, or why there are none."""
    screen.show("", f"{name} ({found.used} of {found.runs} runs)")
    if found.note:
        screen.show(f"  {found.note}")
    for setting, index, value, low, high in found.table.iloc[:, 1:].itertuples(index=False):
        screen.show(f"  {setting:32} {index:18} {value:8.3f}   {low:.3f} to {high:.3f}")
    if found.mixed:
        screen.show(f"  not told from all others: {', '.join(dict.fromkeys(one for one, _ in found.mixed))}")
