"""What a column of numbers or a setting means, in words."""

import functools
from collections.abc import Iterator
from typing import Any

from ..composition.comments import adds_to, find_comment
from ..composition.compose import compose
from ..composition.messages import find_setting
from ..summary.row import ALL_COLUMNS

READINGS = {"grid_units": "cell", "si": "m"}  # with their units of length
# Units in descriptions of settings, and what they are with the default reading.
UNITS = {
    " [1]": "", "[unit of E]": "[kg cell⁻¹ s⁻²]", "[Pa]": "[kg cell⁻¹ s⁻²]", "[kg/m^3]": "[kg cell⁻³]",
    "^2": "²", "^3": "³",
}  # fmt: skip


def describe_name(name: str) -> list[str]:
    """Lines on the column and the setting of this name, of which a word may be both; none if it is neither."""
    return [*_describe_column(name), *_describe_setting(name)]


def _describe_column(name: str) -> Iterator[str]:
    """Lines on a column of the rows of numbers: its meaning, and its unit in each reading."""
    if name not in ALL_COLUMNS:
        return
    column = ALL_COLUMNS[name]
    yield f"{name}, a column of numbers of runs: {': '.join(filter(None, (column.long_name, column.note)))}"
    units = {reading: column.format_unit([length]) for reading, length in READINGS.items()}
    if len(set(units.values())) > 1:
        yield f"  unit: {'; '.join(f'{unit} with reading={reading}' for reading, unit in units.items())}"
    elif unit := units["grid_units"]:
        yield f"  unit: {unit}"


def _describe_setting(key: str) -> Iterator[str]:
    """Lines on a setting: its meaning, and its value by default."""
    if not (field := find_setting(key)):
        return
    described, comment = field.description or "", find_comment(key)
    parts = (described, comment if adds_to(comment, described) else "")
    about = "; ".join(filter(None, parts)) or "'snowrepro config' shows what is in it"
    yield f"{key}, a setting: {write_units(about)}"
    value: Any = compose().settings()
    for word in key.split("."):
        value = value.get(word) if isinstance(value, dict) else None
    if value is not None and not isinstance(value, dict):
        yield f"  by default: {value}"


def write_units(text: str) -> str:
    """A description with its units as they are with the default reading."""
    return functools.reduce(lambda written, unit: written.replace(*unit), UNITS.items(), text)
