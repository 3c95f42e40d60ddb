"""The live table of a sweep on a terminal; plain lines elsewhere, which read well in a log."""

import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.live import Live
from rich.markup import escape
from rich.table import Table

from ..store import states
from ..store.models import Progress
from ..store.run import Run, read_progress
from ..text import make_printable
from .processes import DONE, Job

REDRAW_SECONDS = 0.5
LINE_SECONDS = 30.0
WATCH_SECONDS = 2.0
MOST_ROWS = 20
MOST_FAILURES = 5
LEAST_DONE = 0.1  # of a run's frames, before they tell how long it takes


class SweepTable:
    """Shows the jobs of a sweep as they run: called with those that run and those that just ended."""

    def __init__(self, total: int, workers: int, console: Console | None = None) -> None:
        self.console = console or Console(file=sys.__stderr__)
        self.live = Live(console=self.console, auto_refresh=False) if self.console.is_terminal else None
        self.total, self.workers = total, workers
        self.began = self.last = time.monotonic()
        self.lengths: list[float] = []  # seconds of each job that ended well here
        self.failures: list[Job] = []
        self.ended = 0

    def __enter__(self) -> "SweepTable":
        if self.live:
            self.live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self.live:
            self.live.stop()

    def __call__(self, running: Sequence[Job], ended: Sequence[Job]) -> None:
        """Take note of what ended, and show how far the sweep is if it is time to."""
        now = time.monotonic()
        for job in ended:
            self.ended += 1
            if job.state != DONE:
                self.failures.append(job)
            elif job.tries:
                self.lengths.append(job.seconds)
            if not self.live and job.tries:
                self._line(running, now, f"{job.label}: {job.state} in {clock(job.seconds)}{_why(job)}")
        if self.live and (now - self.last > REDRAW_SECONDS or self.ended == self.total):
            self.last = now
            self.live.update(self.render(running, now), refresh=True)
        elif not self.live and now - self.last > LINE_SECONDS:
            self._line(running, now, ", ".join(f"{job.label} {_frame(job)}" for job in running[:MOST_ROWS]))

    def render(self, running: Sequence[Job], now: float) -> Table:
        """The table of what runs and of the last that failed; its caption has the counts."""
        table = Table(caption=self.summary(running, now))
        for column in ("run", "state", "frame", "frames/s", "time"):
            table.add_column(column, justify="left" if column in ("run", "state") else "right")
        for job in self.failures[-MOST_FAILURES:]:
            table.add_row(_shown(job.label), job.state, "", "", clock(job.seconds))
        for job in running[:MOST_ROWS]:
            progress, seconds = _progress(job), now - job.started
            rate = f"{progress.frame / seconds:.1f}" if progress and seconds > 0 else ""
            again = f", try {job.tries}" if job.tries > 1 else ""
            table.add_row(_shown(job.label), job.state + again, _frame(job), rate, clock(seconds))
        return table

    def summary(self, running: Sequence[Job], now: float) -> str:
        """How many have ended and failed, how many a minute, and how long it will take."""
        parts = [f"{self.ended} of {self.total} ended"]
        if self.failures:
            parts.append(f"{len(self.failures)} failed")
        if self.lengths:
            parts.append(f"{60 * len(self.lengths) / max(now - self.began, 1e-9):.1f} a minute")
        left = self.time_left(running, now)
        return ", ".join([*parts, f"about {clock(left)} left"] if left else parts)

    def time_left(self, running: Sequence[Job], now: float) -> float | None:
        """Seconds until the last job ends, from what jobs have needed so far; None before anything is known."""
        expected = [_expected(job, now) for job in running]
        lengths = [*self.lengths, *filter(None, expected)]  # so a job counts alike before and after its end
        if not lengths:
            return None
        mean = sum(lengths) / len(lengths)
        waiting = self.total - self.ended - len(running)
        pairs = zip(running, expected, strict=True)
        total = mean * waiting + sum(max(0.0, (length or mean) - (now - job.started)) for job, length in pairs)
        return total / max(1, min(self.workers, len(running) + waiting))

    def _line(self, running: Sequence[Job], now: float, text: str) -> None:
        self.last = now
        left = self.time_left(running, now)
        ending = f", about {clock(left)} left" if left else ""
        count = f"[{self.ended}/{self.total}]"
        self.console.print(make_printable(f"{count} {text}{ending}"), markup=False, highlight=False, soft_wrap=True)


def clock(seconds: float) -> str:
    """Hours, minutes and seconds; hours where there are any."""
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def _progress(job: Job) -> Progress | None:
    return read_progress(job.folder) if job.folder else None


def _expected(job: Job, now: float) -> float | None:
    """Seconds that a job will have taken, by the frames that it has done; None while these are too few to tell."""
    progress = _progress(job)
    if not progress or progress.frame < max(1, LEAST_DONE * progress.frames):
        return None
    return (now - job.started) * progress.frames / progress.frame


def _frame(job: Job) -> str:
    progress = _progress(job)
    return f"{progress.frame}/{progress.frames}" if progress else ""


def _shown(label: str) -> str:
    """A job's name as it is, whatever letters it has: a table takes brackets for markup."""
    return escape(make_printable(label))


def _why(job: Job) -> str:
    """Of a job that failed: the reason, in a line."""
    return "" if job.state == DONE else f": {job.result}".splitlines()[0]


@contextmanager
def watching(runs: Sequence[Run]) -> Iterator[None]:
    """Says now and then how far the store is with runs that others do, as long as the block lasts."""
    ended = threading.Event()
    thread = threading.Thread(target=_watch, args=(runs, ended), daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def _watch(runs: Sequence[Run], ended: threading.Event) -> None:
    """A line whenever the number of runs in some state has changed; looking takes a tenth of the time at most."""
    console = Console(file=sys.__stderr__)
    shown, pause = "", WATCH_SECONDS
    while not ended.wait(pause):
        began = time.monotonic()
        counts = Counter(standing.state for standing in states.standings(runs))
        text = ", ".join(f"{counts[state]} {state}" for state in states.STATES if counts[state])
        if text != shown:
            shown = text
            console.print(f"[{counts[states.DONE]}/{len(runs)}] {text}", markup=False, highlight=False)
        pause = max(WATCH_SECONDS, 10.0 * (time.monotonic() - began))
