"""Text from data, made safe to show in a terminal or in a message."""

from collections.abc import Iterable

LONGEST_QUOTE = 60  # characters of a quoted text


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
