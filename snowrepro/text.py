"""Text that comes from data, made harmless for where it goes.

Names, messages, hosts, overrides and attributes may have been written by anybody.  Each place that text goes to has one
function: a terminal here, a table's cell here, Markdown in ``report.document.escape``, HTML by autoescaping.
"""

import re
from collections.abc import Iterable
from difflib import get_close_matches
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

LONGEST_QUOTE = 60  # letters of a quoted text
FORMULA = re.compile(r"[=+\-@]")  # what spreadsheets begin a formula with
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?( [\w ,.]*)?")  # and words behind it


def make_printable(text: object) -> str:
    """Return text on one line in which no character acts on a terminal: such ones are written as Python escapes them.

    Control characters, line breaks, marks that change the direction of writing, and lone surrogates are such.
    """
    return "".join(
        letter if letter.isprintable() else letter.encode("unicode_escape").decode("ascii") for letter in str(text)
    )


def make_lines_printable(text: object) -> str:
    """Return text as ``make_printable`` does, but keep its line breaks."""
    return "\n".join(make_printable(line) for line in str(text).split("\n"))


def offer_names(wrong: str, names: Iterable[str]) -> str:
    """Say which of ``names`` is probably meant by a wrong one; list all where none is like it."""
    known = list(names)
    near = get_close_matches(wrong, known, n=1)
    return f"did you mean '{near[0]}'?" if near else f"there are: {', '.join(known)}"


def quote(text: object) -> str:
    """Return text from data for a message: printable, in quotation marks, and cut where it is long."""
    whole = str(text)
    cut = whole if len(whole) <= LONGEST_QUOTE else f"{whole[: LONGEST_QUOTE - 3]}..."
    return f"'{make_printable(cut)}'"


def quote_all(texts: Iterable[object], most: int = 12) -> str:
    """Return several texts from data for a message, with commas between them; of many only the first ``most``."""
    quoted = [quote(text) for text in texts]
    rest = len(quoted) - most
    return ", ".join([*quoted[:most], *([f"and {rest} more"] if rest > 0 else [])])


def make_cell(value: object) -> object:
    """Return the value of a table's cell so that no spreadsheet takes text for a formula; numbers stay as they are."""
    if not isinstance(value, str):
        return value
    line = make_printable(value)
    is_formula = FORMULA.match(line.lstrip()) and not NUMBER.fullmatch(line)
    return f"'{line}" if is_formula else line


def make_cells(table: "pd.DataFrame") -> "pd.DataFrame":
    """Return a table as it can go into a CSV file: each value as ``make_cell`` makes it."""
    return table.apply(lambda column: column if column.dtype.kind in "biufc" else column.map(make_cell))
