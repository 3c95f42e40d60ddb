"""The columns of a sweep's table as pictures show them: their names and values, and which to draw if none is named."""

import textwrap
from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches

import numpy as np
import pandas as pd
from pandas.api.types import is_numeric_dtype

from ...errors import ConfigError
from ...evidence.collect import CollectedSweep
from ...quantities import add_unit, format_unit
from ...summary.columns import CASE_COLUMNS
from ...text import make_printable, quote

# Of columns that are drawn often, in fewer words than those that say exactly what they are.
SHORT = {
    "pressure": "nominal pressure",
    "sintering": "sintering",
    "lump_fraction": "mass in lumps",
    "crushed_fraction": "crushed mass",
    "loose_fraction": "loose mass",
    "largest_fragment": "mass in the heaviest fragment",
    "broken_bonds": "broken bonds",
    "density_at_release": "density at release",
    "hardness": "hardness",
    "indentation_work": "work of indentation",
}
WIDTH = 100  # of a line of names
FALL_MEASURES = ("lump_fraction", "crushed_fraction", "loose_fraction", "largest_fragment", "density_at_release")
TEST_MEASURES = ("hardness", "indentation_work")


def list_columns(sweep: CollectedSweep) -> list[str]:
    """List the columns that can be drawn: the settings by which runs differ, then what was measured of them."""
    return [*sweep.dims, *sweep.columns]


def find_column(sweep: CollectedSweep, name: str) -> str:
    """Find a column by its name, or by the setting that it holds.  Raises ConfigError with the nearest name, and all.

    ``name``: such as "reading_gravity", or "reading.gravity" as one types it in an override.
    """
    names = {**{sweep.key_of(column): column for column in sweep.dims}, **{each: each for each in list_columns(sweep)}}
    if name in names:
        return names[name]
    near = get_close_matches(name, names, n=1)
    hint = f"; did you mean '{near[0]}'?" if near else "."
    known = textwrap.fill(", ".join(list_columns(sweep)), WIDTH, initial_indent="  ", subsequent_indent="  ")
    raise ConfigError(f"sweep '{sweep.name}' has no column {quote(name)}{hint} There are:\n{known}")


def read_values(sweep: CollectedSweep, name: str) -> pd.Series:
    """Read a column: as floats if all its values are numbers, also written ones, and else as text; NaN without one."""
    values = sweep.table[name]
    if is_numeric_dtype(values):
        return values.astype(float)
    if name in sweep.columns and sweep.columns[name].is_text:
        return values.astype(object)
    numbers = pd.to_numeric(values, errors="coerce")
    return numbers.astype(float) if numbers.notna().equals(values.notna()) else values.astype(object)


def is_number(sweep: CollectedSweep, name: str) -> bool:
    """Whether all values of a column are numbers."""
    return is_numeric_dtype(read_values(sweep, name))


def label_column(sweep: CollectedSweep, name: str) -> str:
    """Label a column for an axis: in few words, with its unit in brackets if it has one."""
    if name in sweep.further:
        return sweep.further[name]
    about = {**CASE_COLUMNS, **sweep.columns}[name].attrs(sweep.length_unit)
    return add_unit(SHORT.get(name, about["long_name"]), format_unit(about.get("units", "1")))


def format_value(value: object) -> str:
    """Write the value of a setting: numbers in at most six digits, text as it is."""
    return f"{value:g}" if isinstance(value, int | float | np.number) else str(value)


def escape_label(text: object) -> str:
    """Write a value as Matplotlib can show it: all letters of a text are seen, and none is taken for a formula."""
    return make_printable(format_value(text)).replace("$", r"\$")


def describe_cell(sweep: CollectedSweep, row: int) -> str:
    """Describe what tells a run of the table from the others but for its seed, as "pressure 500, sintering paper"."""
    names = [name for name in sweep.varied if name != "seed"] or ["pressure", "sintering"]
    return ", ".join(f"{sweep.key_of(name)} {format_value(sweep.table[name].iloc[row])}" for name in names)


def list_steered(sweep: CollectedSweep) -> list[str]:
    """List the settings over which results are drawn: those that vary in numbers; else the first, or the pressure."""
    varied = [name for name in sweep.varied if name != "seed"]
    return [name for name in varied if is_number(sweep, name)] or varied[:1] or ["pressure"]


def choose_colour(sweep: CollectedSweep, *drawn: str) -> str:
    """Choose the setting that colours tell apart, beside those that are ``drawn`` otherwise; empty if none varies."""
    others = [name for name in sweep.varied if name not in ("seed", *drawn)]
    names = [name for name in others if not is_number(sweep, name)]
    return next(iter([*(["sintering"] if "sintering" in names else []), *names, *others]), "")


def select_runs(sweep: CollectedSweep, only: Sequence[str]) -> CollectedSweep:
    """Select the runs of a sweep whose settings have the values that ``only`` names, such as "sintering=paper".

    Raises ConfigError where none has.
    """
    table = sweep.table
    for word in only:
        name, equals, value = word.partition("=")
        column = find_column(sweep, name)
        known = read_values(replace(sweep, table=table), column)
        table = table[[format_value(each) == value or str(each) == value for each in known]]
        if table.empty or not equals:
            values = ", ".join(dict.fromkeys(format_value(each) for each in read_values(sweep, column)))
            raise ConfigError(f"no run has {quote(word)}; '{name}' is {values}")
    return replace(sweep, table=table.reset_index(drop=True))


def list_measures(sweep: CollectedSweep, wanted: Sequence[str] = (*FALL_MEASURES, *TEST_MEASURES)) -> list[str]:
    """List those of the main measures that any run of a sweep has a value of."""
    return [name for name in wanted if name in sweep.columns and sweep.table[name].notna().any()]
