"""What verbs print: results on standard output, everything else on the error stream.

All text goes through ``make_printable``, as much of it comes from data.
"""

from collections.abc import Mapping
from typing import Any

from rich.console import Console

from ..text import make_lines_printable, make_printable

console = Console(stderr=True, highlight=False)


def say(text: str) -> None:
    """A line, or several, on the error stream; no text in it acts on the terminal."""
    console.print(make_lines_printable(text), markup=False, emoji=False, soft_wrap=True)


def show(*lines: object) -> None:
    """Lines on standard output."""
    for line in lines:
        print(make_printable(line))


def print_rows(row: Mapping[str, Any], units: Mapping[str, str] | None = None) -> None:
    """Name, value and unit a line; floats in five digits, whole numbers with separators."""
    width = max(len(name) for name in row)
    for name, value in row.items():
        form = ".5g" if isinstance(value, float) else "," if type(value) is int else ""
        show(f"{name:{width}}  {value:{form}} {(units or {}).get(name, '')}".rstrip())
