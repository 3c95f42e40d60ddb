"""``snowrepro plot``: a picture of any two columns of a sweep's table."""

import argparse
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path

from ...errors import ConfigError, ExitCode
from ...report.drawing import plot
from ...report.page import folder
from ...store import files
from ...sweep import plan as sweep_plan
from ...sweep import record
from .. import candidates, screen
from ..arguments import EXITS, add_folders, complete_by

ROLES = candidates.ROLES
HELP = f"""\
A point for each run, and a line through the means over seeds.  A column is one of results.csv, or a setting as one
types it (reading.gravity).  Without x= it is the first setting that varies, without y= the mass in lumps (in hardness
tests the hardness), without colour= another setting that varies.  Units are those of the columns.

  x        along the lower axis
  y        along the upright axis
  colour   a colour for each value; of many numbers a scale
  panel    a panel for each value

examples:
  snowrepro plot pressure=300,2900,sintering=paper,none
  snowrepro plot fig5 x=pressure y=lump_fraction colour=sintering --log x
  snowrepro plot grid y=lump_fraction colour=sintering panel=floor --out lumps.pdf
  snowrepro plot hardness x=density_at_release y=hardness colour=pressure --log y --out hardness.svg

{EXITS}
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which sweep, which of its columns, and where the picture goes."""
    sweep = parser.add_argument("sweep", metavar="SWEEP", help="name of a remembered sweep")
    complete_by(sweep, candidates.list_sweeps)
    words = parser.add_argument("overrides", nargs="*", metavar="x=COLUMN", help="x, y, colour, panel: see below")
    complete_by(words, candidates.list_plotted)
    parser.add_argument(
        "--log", action="append", choices=("x", "y"), default=[], help="axis with a logarithmic scale; may be repeated"
    )
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help=".png, .svg or .pdf (default: a .png in the folder of the report)"
    )
    add_folders(parser, writes_reports=True)


def execute(options: argparse.Namespace) -> ExitCode:
    """Draw two columns of a sweep, say which runs are not in the picture, and print its path."""
    store, words = sweep_plan.split_store(options.overrides)
    if options.out:
        plot.read_format(options.out)
    places = [word for word in words if word.startswith("reports=")]
    columns = _read_columns([word for word in words if word not in places])
    sweep = plot.collect_remembered(options.sweep, store, places)
    roles = plot.assign_roles(sweep, **columns, log="".join(options.log))
    figure = plot.draw_columns(sweep, roles)
    out = options.out or _choose_path(sweep, roles)
    files.require_writable(out.parent)
    plot.save_plot(figure, out)
    lacking = plot.describe_lacking(sweep, roles)
    if lacking:
        screen.say(f"not in the picture: {lacking}")
    screen.show(out)
    return ExitCode.FINE


def _read_columns(words: Sequence[str]) -> dict[str, str]:
    """Names of columns by their role.  Raises ConfigError for another word."""
    columns = {}
    for word in words:
        role, equals, name = word.partition("=")
        if role not in ROLES or not name:
            near = get_close_matches(role, ROLES, n=1) if equals else []
            hint = f"; did you mean '{near[0]}'?" if near else ""
            raise ConfigError(f"'{word}' is none of {', '.join(f'{each}=COLUMN' for each in ROLES)}{hint}")
        columns[role] = name
    return columns


def _choose_path(sweep: "plot.CollectedSweep", roles: "plot.Roles") -> Path:
    """The path of a picture that was given none: in the folder of the sweep's report, named by what it shows."""
    by = "".join(f"-{name}" for name in (roles.colour, roles.panel) if name)
    name = record.shorten_name(f"{roles.y}-over-{roles.x}{by}")
    return folder.find_report_folder(sweep.runs[0], sweep.overrides) / f"{name}.png"
