"""What came of one run, for people: a sentence, and the unit of each of its numbers."""

import math
from collections.abc import Mapping
from typing import Any

from ..analysis.view import describe_lumps
from .row import ALL_COLUMNS


def describe_outcome(row: Mapping[str, Any], length_unit: str) -> str:
    """Describe a row of numbers in a sentence or two: what became of the snow in a fall, or its hardness in a test.

    ``length_unit``: of the run's reading, as files have it.
    """
    return _describe_test(row, length_unit) if "hardness" in row else _describe_fall(row)


def list_units(row: Mapping[str, Any], length_unit: str) -> dict[str, str]:
    """List the units of the numbers of a row by column, for people; those without a unit are left out."""
    units = {name: ALL_COLUMNS[name].format_unit([length_unit]) for name in row if name in ALL_COLUMNS}
    return {name: unit for name, unit in units.items() if unit}


def _describe_fall(row: Mapping[str, Any]) -> str:
    """Describe lumps, crushed and loose snow at the end of a fall."""
    unsettled = "" if row["settled"] else " It still changes at the end: the snow has not settled."
    return f"{describe_lumps(row)}{unsettled} The run ended in frame {row['end_frame']:.0f}."


def _describe_test(row: Mapping[str, Any], length_unit: str) -> str:
    """Describe the result of a hardness test."""
    hardness, unit = row["hardness"], ALL_COLUMNS["hardness"].format_unit([length_unit])
    depth = f"{row['hardness_depth']:g} cells deep"
    if not hardness > 0:
        return f"The indenter ({row['indenter']}), {depth} in the snow, met no resistance that could be measured."
    digits = 0 if hardness >= 100 else 2 - math.floor(math.log10(hardness))
    return f"The snow has a hardness of {hardness:,.{digits}f} {unit}, measured by a {row['indenter']} {depth}."
