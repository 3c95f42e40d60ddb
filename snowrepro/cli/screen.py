"""What verbs print: results on standard output, everything else on the error stream."""

from collections.abc import Mapping
from typing import Any

from rich.console import Console

console = Console(stderr=True, highlight=False)


def say(text: str) -> None:
    """A line on the error stream."""
    console.print(text, markup=False, soft_wrap=True)


def print_rows(row: Mapping[str, Any]) -> None:
    """Name and value a line; floats in five digits, whole numbers with separators."""
    width = max(len(name) for name in row)
    for name, value in row.items():
        form = ".5g" if isinstance(value, float) else "," if type(value) is int else ""
        print(f"{name:{width}}  {value:{form}}")
