"""Lumps and powder in words, and as a notebook shows them."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from ..markup import make_paragraph, make_table

MOST_ROWS = 10  # of fragments


def describe_lumps(measures: Mapping[str, Any]) -> str:
    """Return a sentence on lumps and powder, from the measures of a frame or the row of numbers of a run."""
    lumps = int(measures["lumps"])
    counted = "no lump" if not lumps else f"{lumps} lump{'s' * (lumps != 1)}"
    parts = [f"{measures['lump_fraction']:.0%} of the mass in {counted}", f"{measures['powder_fraction']:.0%} powder"]
    if measures["vanished"] > 0:
        parts.append(f"{measures['vanished']:.0%} no longer there")
    return ", ".join(parts).replace("%", " %") + "."


def make_html(title: str, measures: Mapping[str, Any], fragments: pd.DataFrame, unit: str, notes: Sequence[str]) -> str:
    """Return the fragments of a frame as HTML: a sentence, the heaviest of them as a table, and notes.

    ``fragments``: as ``tabulate_fragments`` gives them, but masses as parts of the body's; ``unit``: of lengths, empty
    where it is not known.
    """
    shown = fragments.sort_values("mass", ascending=False, kind="stable").head(MOST_ROWS)
    axes = [name.removeprefix("centre_") for name in shown.columns if name.startswith("centre_")]
    length = f" [{'cells' if unit == 'cell' else unit}]" if unit else ""
    header = ["fragment", "what it is", "mass [% of all]", "particles"]
    header += [f"{what} {axis}{length}" for what in ("centre", "extent") for axis in axes]
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
