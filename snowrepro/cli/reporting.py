"""The report of a sweep, as several verbs write it."""

import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from ..errors import ConfigError
from ..evidence.gather import Evidence, command_to_repeat
from ..report.figures.kinds import find_figure, needs_runs, require_drawable
from ..report.page import paper
from ..report.page.folder import find_report_folder
from ..report.page.lead import WITHOUT_CHANGES, list_changed_settings
from ..report.page.page import ExperimentReport, draw_experiment, write_experiment_page
from ..report.page.unchanged import STAMP, digest_inputs, draw_if_changed
from ..report.sections import choices, claims
from ..store.run import BrokenResult
from ..sweep import record
from ..sweep.plan import Plan, compose_first_run, make_plan
from .screen import say, show

CLAIMS = "claims"
Written = TypeVar("Written")


def print_report(overrides: Sequence[str], store: str) -> None:
    """Write the report of a sweep, with every seed that it was asked for with, and print what it comes to."""
    asked = record.add_remembered_seeds(overrides, store)
    first = compose_first_run(asked)

    def draw() -> tuple[list[str], list[Path]]:
        """Draw the report; returns what to print, and the folder."""
        plan = make_plan(asked, multirun=True)
        require_drawable(plan.runs)
        part, page = leave_out_broken(lambda: write_report(plan))
        count = len(part.evidence.missing) if needs_runs(plan.runs) else 0
        missing = [f"missing: {count} of {len(plan.runs)} runs have no result"] if count else []
        return [f"verdict: {part.content.verdict}", *missing, f"report: {page}"], [page.parent]

    print_drawn(find_report_folder(first, asked), asked, first.store, draw)


def print_claims(plan: Plan) -> None:
    """Write the report of an experiment that judges claims, and print the verdicts."""

    def draw() -> tuple[list[str], list[Path]]:
        """Draw the report; returns what to print, and the folder."""
        part, page = leave_out_broken(lambda: write_report(plan))
        return [*describe_claims(part.evidence, plan), f"report: {page}"], [page.parent]

    words = [CLAIMS, *plan.overrides]  # its lines are others than those of a report alone
    print_drawn(find_report_folder(plan.runs[0], plan.overrides), words, plan.runs[0].store, draw)


def describe_claims(evidence: Evidence, plan: Plan) -> list[str]:
    """Lines on the claims, and what the command changed of an experiment whose pressures were chosen without that."""
    changed = list_changed_settings(command_to_repeat(plan.overrides))
    lines = claims.format_for_screen(evidence)
    return [*lines, f"Changed: {', '.join(changed)}. {WITHOUT_CHANGES}"] if changed else lines


def print_paper_report(overrides: Sequence[str], store: str) -> None:
    """Write the report on the whole paper, and print where it is.  Raises ConfigError for what nothing was run with."""
    others = [word for word in overrides if not word.startswith("store=")]

    def draw() -> tuple[list[str], list[Path]]:
        """Draw the report and those of its experiments; returns what to print, and all folders."""
        planned = paper.plan_paper(overrides, store, say)
        _require_any_run(planned, others)
        pages = leave_out_broken(lambda: paper.write_paper(planned, say))
        return [f"report: {pages[0]}"], [page.parent for page in pages]

    print_drawn(paper.find_paper_folder(overrides), overrides, Path(store), draw)


def _require_any_run(planned: paper.PlannedPaper, words: Sequence[str]) -> None:
    """Raise ConfigError where the paper was run with none of the ``words``: all of its report would be empty."""
    simulated = [part for part in planned.experiments if needs_runs(part.plan.runs)]
    if words and not any(part.is_drawn for part in simulated):
        asked = shlex.join(words)
        raise ConfigError(
            f"nothing of the paper was run with {asked} in the folder '{planned.store}'. To run it so: snowrepro run "
            f"experiment=fig5 {asked}. One run has no report: 'snowrepro classify' and 'animate' show it"
        )


def print_drawn(
    folder: Path, overrides: Sequence[str], store: Path, draw: Callable[[], tuple[list[str], list[Path]]]
) -> None:
    """Draw a report, unless nothing changed since it was drawn, and print its lines: see ``draw_if_changed``."""
    say("looking for what changed since the report was drawn" if (folder / STAMP).exists() else "drawing the report")
    others = [word for word in overrides if not word.startswith("store=")]  # some verbs say where it is, some do not
    lines, is_drawn = draw_if_changed(folder, digest_inputs(others, store), draw)
    if not is_drawn:
        say("nothing changed: the report stays as it is")
    show(*lines)


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
