"""The bar that shows how far something is: on a terminal by rich, in a notebook as HTML that needs no widgets."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from importlib import import_module
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from .markup import escape

REDRAW_SECONDS = 0.2
SPEED_SECONDS = 600.0  # that the mean speed is taken over: of a few seconds it jumps

Update = Callable[[int, int], None]  # how many are done, of how many


def build_bar(counted: str, console: Console, is_hidden: bool = False) -> Progress:
    """A bar that counts frames or pictures on a console; hidden also where that is no terminal."""
    columns = (TextColumn(counted + " {task.completed:.0f}/{task.total:.0f}"), BarColumn(), TimeRemainingColumn())
    return Progress(
        *columns,
        console=console,
        transient=True,
        disable=is_hidden or not console.is_terminal,
        speed_estimate_period=SPEED_SECONDS,
    )


@contextmanager
def show_progress(counted: str, total: int, is_hidden: bool = False) -> Iterator[Update]:
    """Show a bar on the error stream or in the notebook; gives the function to be told how far it is.

    ``counted``: what is counted, in the singular.  Where there is neither a terminal nor a notebook, nothing is shown.
    """
    if is_in_notebook() and not is_hidden:
        bar = NotebookBar(counted, total)
        yield bar.update
        bar.end()
        return
    with build_bar(counted, Console(file=sys.stderr, highlight=False), is_hidden) as progress:
        task = progress.add_task(counted, total=total)
        yield lambda done, count: progress.update(task, completed=done, total=count)


def is_in_notebook() -> bool:
    """Whether this process computes what a notebook asks for."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython else None
    return getattr(shell, "kernel", None) is not None


class NotebookBar:
    """A bar below the cell of a notebook that is at work; at the end a line on how long it took."""

    def __init__(self, counted: str, total: int) -> None:
        self.counted, self.done, self.total = counted, 0, total
        self.began = self.drawn = time.monotonic()
        self.handle = _display().display(self._draw(), display_id=True)

    def update(self, done: int, total: int) -> None:
        """Show how many are done, unless that was shown a moment ago."""
        self.done, self.total = done, total
        if time.monotonic() - self.drawn > REDRAW_SECONDS:
            self.drawn = time.monotonic()
            self.handle.update(self._draw())

    def end(self) -> None:
        """Put a line in place of the bar."""
        took = _format_time(time.monotonic() - self.began)
        self.handle.update(_as_html(f"{self.counted} {self.done} of {self.total}, {took}"))

    def _draw(self) -> Any:
        """The bar, with words behind it."""
        seconds = time.monotonic() - self.began
        left = f", about {_format_time(seconds / self.done * (self.total - self.done))} left" if self.done else ""
        words = f"{self.counted} {self.done} of {self.total}{left}"
        bar = f'<progress value="{self.done}" max="{self.total}" aria-label="{escape(self.counted)}"></progress> '
        return _as_html(words, bar)


def _format_time(seconds: float) -> str:
    """Hours, minutes and seconds."""
    return str(timedelta(seconds=round(seconds)))


def _as_html(words: str, before: str = "") -> Any:
    """Words, and HTML before them, as a notebook displays them."""
    return _display().HTML(before + escape(words))


def _display() -> Any:
    """What notebooks display with: IPython, which is there in each of them."""
    return import_module("IPython.display")
