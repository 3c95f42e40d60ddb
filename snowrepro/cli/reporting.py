"""The report of a sweep, as several verbs write it."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from ..report.figures.kinds import find_figure, require_drawable
from ..report.page.page import ExperimentReport, draw_experiment, write_experiment_page
from ..report.sections import choices
from ..store.run import BrokenResult
from ..sweep import record
from ..sweep.plan import Plan, make_plan
from .screen import say, show

Written = TypeVar("Written")


def print_report(overrides: Sequence[str], store: str) -> None:
    """Write the report of a sweep, with every seed that it was asked for with, and print what it comes to."""
    plan = make_plan(record.add_remembered_seeds(overrides, store), multirun=True)
    require_drawable(plan.runs)
    part, page = leave_out_broken(lambda: write_report(plan))
    show(f"verdict: {part.content.verdict}", f"report: {page}")


def leave_out_broken(write: Callable[[], Written]) -> Written:
    """What ``write`` writes, made again without a result that turns out to be broken when it is drawn.

    Such a one stands as broken in this process: see ``Run.open``.
    """
    seen: set[str] = set()
    while True:
        try:
            return write()
        except BrokenResult as error:
            if str(error) in seen:
                raise
            seen.add(str(error))
            say(f"left out: {error}")


def write_report(plan: Plan) -> tuple[ExperimentReport, Path]:
    """Write the report of a sweep's runs; returns what it shows, and its page."""
    part = draw_experiment(plan)
    sections = []
    if find_figure(part.evidence.experiment).is_judged:
        sections.append(choices.make_section(plan.overrides, plan.runs[0].config.execution.store))
    return part, write_experiment_page(part, sections)
