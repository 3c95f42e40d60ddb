"""The report on the whole paper: all figures and tables in its order, and the register of choices."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...composition.experiments import list_in_paper_order
from ...evidence.gather import command_to_repeat
from ...store.run import Run
from ...sweep.plan import Plan, compose_first_run, make_plan
from ...sweep.record import add_remembered_seeds, find_records, name_sweep
from ..document import Section, escape, format_code
from ..drawing.common import own_style
from ..figures.kinds import find_figure, needs_runs
from ..sections import choices
from .page import ExperimentReport, draw_experiment, write_experiment_page, write_page

TITLE = "Snow Simulation Considering Pressure Sintering: a reproduction"

COMMITTED = Path("reports")  # of a clone: what the project made itself


@dataclass(frozen=True)
class PlannedExperiment:
    """An experiment of the paper's report.  ``plan``: with every seed that was asked for."""

    plan: Plan

    @property
    def title(self) -> str:
        """Its title."""
        experiment = self.plan.experiment
        assert experiment is not None, "it was planned by the name of an experiment"
        return experiment.title

    @property
    def is_drawn(self) -> bool:
        """Whether it is drawn: a study without any run that was asked for is only mentioned."""
        runs = self.plan.runs
        needed = needs_runs(runs)
        return not needed or bool(find_records(self.plan.overrides, runs[0].store)) or all(map(Run.is_done, runs))


@dataclass(frozen=True)
class PlannedPaper:
    """All experiments of the report on the paper, in its order.

    ``overrides`` hold for each of them; ``store``: the folder that their runs are in; ``folder``: of the report.
    """

    experiments: tuple[PlannedExperiment, ...]
    overrides: tuple[str, ...]
    store: str
    folder: Path


def plan_paper(
    overrides: Sequence[str], store: str, show_step: Callable[[str], None] = lambda line: None
) -> PlannedPaper:
    """Plan the report on all of the paper's experiments: their runs, and where it is written.

    ``show_step`` is given a line on each experiment before it is planned.  Raises ConfigError.
    """
    names = list_in_paper_order()
    planned = []
    for number, name in enumerate(names, 1):
        show_step(f"looking for the runs of {name} ({number} of {len(names)})")
        planned.append(_plan_experiment([f"experiment={name}", *overrides], store))
    return PlannedPaper(tuple(planned), tuple(overrides), store, find_paper_folder(overrides))


def find_paper_folder(overrides: Sequence[str]) -> Path:
    """Find the folder of the report on the paper, without planning its experiments.  Raises ConfigError."""
    first = compose_first_run([f"experiment={list_in_paper_order()[0]}", *overrides])
    return Path(first.config.question.reports) / name_sweep(["experiment=paper", *overrides])


@own_style()
def write_paper(paper: PlannedPaper, show_step: Callable[[str], None] = lambda line: None) -> list[Path]:
    """Write the report on the paper from the store alone; returns its page, and those of the experiments drawn for it.

    ``show_step`` is given a line on each experiment before it is drawn.  Raises StoreError.
    """
    contents: list[ExperimentReport | Section] = []
    for number, each in enumerate(paper.experiments, 1):
        show_step(f"drawing {each.title} ({number} of {len(paper.experiments)})")
        contents.append(draw_experiment(each.plan) if each.is_drawn else _make_placeholder(each.plan))
    show_step("writing the pages")
    register = choices.make_section(paper.overrides, paper.store)
    drawn = [content for content in contents if isinstance(content, ExperimentReport)]
    pages = [
        write_experiment_page(each, [register] if find_figure(each.evidence.experiment).is_judged else ())
        for each in drawn
    ]
    return [write_page(TITLE, contents, paper.folder, [register], in_parts=True), *pages]


def _plan_experiment(overrides: Sequence[str], store: str) -> PlannedExperiment:
    """Plan an experiment with the seeds that it was asked for."""
    return PlannedExperiment(make_plan(add_remembered_seeds(overrides, store), multirun=False))


def _make_placeholder(plan: Plan) -> Section:
    """Make the section of an experiment that was not run: it names the command that runs it."""
    experiment = plan.experiment
    assert experiment is not None
    command = format_code(command_to_repeat(plan.overrides))
    text = f"**Not run here.** {command} makes its {len(plan.runs)} runs and fills this section."
    if (COMMITTED / experiment.name / "index.md").is_file():
        text += f" The project's own result is in {format_code(f'{COMMITTED}/{experiment.name}/index.md')}."
    return Section(experiment.name, escape(experiment.title), [text], escape(experiment.says))
