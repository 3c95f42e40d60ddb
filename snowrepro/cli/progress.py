"""The bar that shows how far a run or a drawing is."""

from rich.progress import Progress

from .. import progress
from .screen import console


def build_bar(counted: str, is_hidden: bool = False) -> Progress:
    """A bar that counts frames or pictures on the error stream; hidden also where that is no terminal."""
    return progress.build_bar(counted, console, is_hidden)
