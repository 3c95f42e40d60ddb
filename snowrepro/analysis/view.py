"""Lumps and powder in words, and as a notebook shows them."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from ..markup import make_paragraph, make_table
from ..quantities import add_unit, format_unit

MOST_ROWS = 10  # of fragments


def describe_lumps(measures: Mapping[str, Any]) -> str:
    """Describe lumps and powder in a sentence, from the measures of a frame or the row of numbers of a run."""
    lumps, powder = int(measures["lumps"]), format_share(measures["powder_fraction"])
    if lumps == 0:
        text = f"{powder} of the mass is powder, and no lump is left"
    else:
        where = "1 lump" if lumps == 1 else f"{lumps:,} lumps"
        text = f"{format_share(measures['lump_fraction'])} of the mass is in {where}, {powder} is powder"
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
    header = ["fragment", "what it is", "mass [% of all]", "particles"]
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
    what = "lump" if fragment["is_lump"] else "powder"
    mass, particles = 100 * fragment["mass"], int(fragment["particles"])
    return [f"{int(fragment['id'])}", what, f"{mass:.1f}", f"{particles:,}", *places]
