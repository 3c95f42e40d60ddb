"""The live table of a sweep on a terminal; plain lines elsewhere."""

import sys
import time
from collections.abc import Sequence

from rich.console import Console
from rich.live import Live
from rich.table import Table

from ..store import runs
from .processes import Job

REDRAW_SECONDS = 0.5
LINE_SECONDS = 20.0
MOST_ROWS = 20


class SweepTable:
    """Shows jobs as they run; call it with the jobs several times a second."""

    def __init__(self, console: Console | None = None):
        self.console = console or Console(file=sys.__stderr__)
        self.live = Live(console=self.console, auto_refresh=False) if self.console.is_terminal else None
        self.started = self.last = time.monotonic()
        self.told: set[int] = set()

    def __enter__(self) -> "SweepTable":
        if self.live:
            self.live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self.live:
            self.live.stop()

    def __call__(self, jobs: Sequence[Job]) -> None:
        """Redraw, if it is time to."""
        now = time.monotonic()
        if self.live:
            if now - self.last > REDRAW_SECONDS or all(job.state in ("done", "failed") for job in jobs):
                self.last = now
                self.live.update(render(jobs, now), refresh=True)
            return
        for index, job in enumerate(jobs):
            ended_now = job.state in ("done", "failed") and job.seconds > 0  # not done before
            if ended_now and index not in self.told:
                self.told.add(index)
                self._line(jobs, now, f"{job.label}: {job.state} in {job.seconds:.0f} s")
        if now - self.last > LINE_SECONDS:
            self._line(jobs, now, "running")

    def _line(self, jobs: Sequence[Job], now: float, text: str) -> None:
        self.last = now
        ended = sum(job.state in ("done", "failed") for job in jobs)
        left = time_left(jobs, now)
        ending = f", about {clock(left)} left" if left else ""
        self.console.print(f"[{ended}/{len(jobs)}] {text}{ending}", markup=False, highlight=False, soft_wrap=True)


def render(jobs: Sequence[Job], now: float) -> Table:
    """The table of all jobs, or of those that run or have failed where all would not fit a screen."""
    left = time_left(jobs, now)
    ended = sum(job.state in ("done", "failed") for job in jobs)
    ending = f", about {clock(left)} left" if left else ""
    table = Table(caption=f"{ended} of {len(jobs)} ended{ending}")
    for column in ("run", "state", "frame", "substeps", "time"):
        table.add_column(column, justify="left" if column in ("run", "state") else "right")
    shown = jobs if len(jobs) <= MOST_ROWS else [job for job in jobs if job.state in ("running", "failed")]
    for job in shown[-MOST_ROWS:]:
        frame, substeps = "", ""
        seconds = job.seconds
        if job.state == "running":
            seconds = now - job.started
            said = runs.progress(job.folder) if job.folder else {}
            if said:
                frame, substeps = f"{said['frame']}/{said['frames']}", str(said["substeps"])
        table.add_row(job.label, job.state, frame, substeps, clock(seconds) if seconds else "")
    return table


def time_left(jobs: Sequence[Job], now: float) -> float | None:
    """Seconds until the last job ends, from what the jobs have needed so far; None before anything is known."""
    lengths = [job.seconds for job in jobs if job.state == "done" and job.seconds]
    remaining = []
    for job in jobs:
        if job.state != "running":
            continue
        said = runs.progress(job.folder) if job.folder else {}
        if said.get("frame"):
            lengths.append((now - job.started) * said["frames"] / said["frame"])
            remaining.append(lengths[-1] - (now - job.started))
    if not lengths:
        return None
    mean = sum(lengths) / len(lengths)
    running = sum(job.state == "running" for job in jobs)
    waiting = sum(job.state == "waiting" for job in jobs)
    total = sum(remaining) + mean * (running - len(remaining) + waiting)
    return total / max(running, 1)


def clock(seconds: float) -> str:
    """Minutes and seconds."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"
