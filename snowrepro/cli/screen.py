"""What verbs print: results on standard output, everything else on the error stream."""

from collections.abc import Mapping
from typing import Any

from rich.console import Console

from .. import text

console = Console(stderr=True, highlight=False)


def say(message: str) -> None:
    """A line, or several, on the error stream; no text in it acts on the terminal."""
    console.print(text.make_lines_printable(message), markup=False, emoji=False, soft_wrap=True)


def print_rows(row: Mapping[str, Any]) -> None:
    """Name and value a line; floats in five digits, whole numbers with separators."""
    width = max(len(name) for name in row)
    for name, value in row.items():
        form = ".5g" if isinstance(value, float) else "," if type(value) is int else ""
        print(f"{name:{width}}  {text.make_printable(format(value, form))}")
