"""The report on the whole paper: all figures and tables in its order, and the register of choices."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...composition.experiments import list_in_paper_order
from ...evidence.gather import command_to_repeat
from ...store.run import Run
from ...sweep.plan import Plan, make_plan
from ...sweep.record import add_remembered_seeds, find_records, name_sweep
from ..document import Section, escape, format_code
from ..drawing.common import own_style
from ..figures.kinds import find_figure, needs_runs
from ..sections import choices
from .page import ExperimentReport, draw_experiment, write_experiment_page, write_page

TITLE = "Snow Simulation Considering Pressure Sintering: a reproduction"


@dataclass(frozen=True)
class PlannedExperiment:
    """An experiment of the paper's report.  ``plan``: with every seed that was asked for."""

    plan: Plan

    @property
    def is_drawn(self) -> bool:
        """Whether it is drawn: a study without any run that was asked for is only mentioned."""
        runs = self.plan.runs
        needed = needs_runs(runs)
        return not needed or bool(find_records(self.plan.overrides, runs[0].store)) or all(map(Run.is_done, runs))


@own_style()
def write_paper(overrides: Sequence[str], store: str) -> Path:
    """Write the report on all of the paper's experiments from the store alone; returns the page.

    ``overrides`` hold for each experiment.  Raises ConfigError, StoreError.
    """
    planned = [_plan_experiment([f"experiment={name}", *overrides], store) for name in list_in_paper_order()]
    contents = [draw_experiment(each.plan) if each.is_drawn else _make_placeholder(each.plan) for each in planned]
    register = choices.make_section(overrides, store)
    for content in contents:
        if isinstance(content, ExperimentReport):
            write_experiment_page(content, [register] if find_figure(content.evidence.experiment).is_judged else ())
    folder = Path(planned[0].plan.runs[0].config.question.reports) / name_sweep(["experiment=paper", *overrides])
    return write_page(TITLE, contents, folder, [register])


def _plan_experiment(overrides: Sequence[str], store: str) -> PlannedExperiment:
    """Plan an experiment with the seeds that it was asked for."""
    return PlannedExperiment(make_plan(add_remembered_seeds(overrides, store), multirun=False))


def _make_placeholder(plan: Plan) -> Section:
    """Make the section of an experiment that was not run: it names the command that runs it."""
    experiment = plan.experiment
    assert experiment is not None
    command = format_code(command_to_repeat(plan.overrides))
    text = f"**Not run.** {command} makes its {len(plan.runs)} runs and fills this section."
    return Section(experiment.name, escape(experiment.title), [text], escape(experiment.says))
