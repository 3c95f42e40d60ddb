"""``snowrepro search``: where along one setting a measure reaches a target, or is largest or smallest."""

import argparse

from ...errors import ExitCode
from ...evidence import search
from .. import candidates, searching
from ..arguments import EXITS, add_folders, complete_by

HELP = f"""\
One setting is written as a range, in quotes for the shell: 'pressure=log(200,6000)', 'reading.gravity=interval(5,20)'
or 'reading.press_ramp=whole(0,20)'.  The ends of the range are run first; from then on a bracketing method says which
value is next, until the target is bracketed as narrowly as asked for.  Lists are crossed: there is a search for each
shape and floor; runs of one value with several seeds are averaged.

The next value follows from the results in the store alone.  So a search that was stopped takes the same path when it is
called again, and a run that is done is not done again.  A run without a result ends the search that it belongs to.
At its end each search is remembered as a sweep, for 'snowrepro plot' and 'report'.

examples:
  snowrepro search 'pressure=log(200,6000)' shape=ball floor=L,square
  snowrepro search 'pressure=log(200,6000)' --measure loose_fraction --target most seeds=3 --points 8

{EXITS}
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What is looked for, and along which setting."""
    parser.add_argument("--measure", default="lump_fraction", help="column of results.csv (default: %(default)s)")
    parser.add_argument(
        "--target",
        default="0.5",
        metavar="VALUE",
        help="number to be reached, or most, or least (default: %(default)s)",
    )
    parser.add_argument("--points", type=int, default=10, help="values of a search at most (default: %(default)s)")
    parser.add_argument(
        "--within",
        type=float,
        default=0.05,
        help="how narrow the bracket is to be: of a log range part of the value, else part of the range (default: "
        "%(default)s)",
    )
    overrides = parser.add_argument("overrides", nargs="*", help="one range, and other overrides")
    complete_by(overrides, candidates.list_overrides)
    add_folders(parser)


def execute(options: argparse.Namespace) -> ExitCode:
    """Run values until each search is at its end, and print what they found."""
    factor, words = searching.split_range(options.overrides)
    asked = search.make_search(factor, options.target, options.within, options.points)
    searching.require_numbers(options.measure)
    searching.run_searches(asked, options.measure, words)
    return ExitCode.FINE
