"""The bar that shows how far a run or a drawing is."""

from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from .screen import console


def build_bar(counted: str, is_hidden: bool = False) -> Progress:
    """A bar that counts frames or pictures on the error stream; hidden also where that is no terminal."""
    columns = (TextColumn(counted + " {task.completed:.0f}/{task.total:.0f}"), BarColumn(), TimeRemainingColumn())
    return Progress(*columns, console=console, transient=True, disable=is_hidden or not console.is_terminal)
