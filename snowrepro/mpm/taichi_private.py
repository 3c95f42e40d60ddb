"""All that is changed inside Taichi: names that its next version may move.

``tests/mpm/test_taichi_private.py`` fails first when one has.
"""

import textwrap

from taichi.lang.ast import ast_transformer_utils


class _Unwrapped(textwrap.TextWrapper):
    """Leaves each line of text as long as it is."""

    def wrap(self, text: str) -> list[str]:
        """The text as one line; none where it is blank."""
        return [text.rstrip()] if text.strip() else []


def leave_lines_unwrapped() -> None:
    """Have Taichi quote source lines in its messages as they stand, instead of at most 80 letters a line.

    It prepares a message for each expression of each kernel that it compiles, and wrapping these takes more than a
    third of the time that a coarse run takes.
    """
    ast_transformer_utils.TextWrapper = _Unwrapped
