"""Lumps, crushed and loose snow in words, and as a notebook shows them."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from ..markup import make_paragraph, make_table
from ..quantities import add_unit, format_unit
from .states import STATES

MOST_ROWS = 10  # of fragments


def describe_lumps(measures: Mapping[str, Any]) -> str:
    """Describe lumps, crushed and loose snow in a sentence, from the measures of a frame or the row of a run."""
    lumps = int(measures["lumps"])
    lump, crushed, loose = (format_share(measures[f"{state}_fraction"]) for state in STATES)
    if lumps == 0:
        text = f"No lump is left: {crushed} of the mass is crushed, {loose} is loose"
    else:
        where = "1 lump" if lumps == 1 else f"{lumps:,} lumps"
        text = f"{lump} of the mass is in {where}, {crushed} is crushed, {loose} is loose"
    gone = f", {format_share(measures['vanished'])} is no longer there" if measures["vanished"] > 0 else ""
    return f"{text}{gone}."


def format_share(share: float) -> str:
    """Format a part of the mass in per cent; what is not all and not nothing does not look so."""
    if 0 < share < 0.005:
        return "less than 1 %"
    if 0.995 <= share < 1:
        return "more than 99 %"
    return f"{100 * share:.0f} %"


def make_html(title: str, measures: Mapping[str, Any], fragments: pd.DataFrame, unit: str, notes: Sequence[str]) -> str:
    """Return the fragments of a frame as HTML: a sentence, the heaviest of them as a table, and notes.

    ``fragments``: as ``tabulate_fragments`` gives them, but masses as parts of the body's; ``unit``: of lengths, empty
    where it is not known.
    """
    shown = fragments.sort_values("mass", ascending=False, kind="stable").head(MOST_ROWS)
    axes = [name.removeprefix("centre_") for name in shown.columns if name.startswith("centre_")]
    length = format_unit(unit)
    header = ["fragment", "what it is", "mass [% of all]", "crushed in it [%]", "loose in it [%]", "particles"]
    header += [add_unit(f"{what} {axis}", length) for what in ("centre", "extent") for axis in axes]
    rest = len(fragments) - len(shown)
    return "".join(
        [
            make_paragraph(title, is_bold=True),
            make_paragraph(describe_lumps(measures)),
            make_table(header, [_make_row(row, axes) for _, row in shown.iterrows()]),
            make_paragraph(f"The heaviest {len(shown)} of {len(fragments)} fragments.") if rest else "",
            *(make_paragraph(f"Assumed: {note}") for note in notes),
        ]
    )


def _make_row(fragment: pd.Series, axes: Sequence[str]) -> list[str]:
    """Return the cells of a fragment."""
    places = [f"{fragment[f'{what}_{axis}']:.1f}" for what in ("centre", "extent") for axis in axes]
    what = "lump" if fragment["is_lump"] else "crushed" if fragment["crushed"] > fragment["loose"] else "loose"
    parts = [f"{100 * fragment[name]:.1f}" for name in ("mass", "crushed", "loose")]
    return [f"{int(fragment['id'])}", what, *parts, f"{int(fragment['particles']):,}", *places]
