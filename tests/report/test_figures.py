"""What figures there are and what each needs, so that an experiment that cannot be drawn is refused before any run."""

import pytest

from snowrepro.composition.experiments import read_experiments
from snowrepro.errors import ConfigError
from snowrepro.report.figures.kinds import FigureKind, find_figure, list_figure_names, needs_runs, require_drawable
from snowrepro.settings.question import Experiment
from snowrepro.sweep.plan import make_plan

JUDGED = {"strip", "grid"}
WITHOUT_RUNS = {"audit", "shapes", "floors", "parameters"}


def kind_of(picture: str) -> FigureKind:
    return find_figure(Experiment(name="any", title="any", picture=picture))


def test_every_module_of_the_folder_is_a_figure():
    """Each declares one, and what it says of itself is so."""
    kinds = {name: kind_of(name) for name in list_figure_names()}
    assert len(kinds) > 10 and all(isinstance(kind, FigureKind) for kind in kinds.values())
    assert {name for name, kind in kinds.items() if kind.is_judged} == JUDGED
    assert {name for name, kind in kinds.items() if not kind.needs_runs} == WITHOUT_RUNS
    assert {name for name, kind in kinds.items() if kind.takes_indenter} == {"hardness", "sweep"}


@pytest.mark.parametrize("experiment", sorted(read_experiments()))
def test_every_experiment_can_be_drawn(experiment):
    """As its file has it; whether it has runs is what its figure says."""
    one = ["variant=base"] if read_experiments()[experiment].get("variants") else []
    plan = make_plan([f"experiment={experiment}", "seed=0", *one], multirun=False)
    require_drawable(plan.runs)
    assert needs_runs(plan.runs) == (plan.experiment.picture not in WITHOUT_RUNS)


def test_runs_of_no_experiment_are_simulated_and_drawn_by_nothing():
    """And where there are no runs, there is nothing to simulate."""
    runs = make_plan(["pressure=1,2"], multirun=True).runs
    require_drawable(runs)
    assert needs_runs(runs)
    require_drawable(())
    assert not needs_runs(())


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["experiment=fig5", "experiment.picture=film"], "experiment.picture: there is no 'film'; there are: ablat"),
        (["experiment=fig5", "experiment.picture=kinds"], "experiment.picture: there is no 'kinds'"),
        (["experiment=fig5", "experiment.frames=[]"], "a strip needs frames"),
        (["experiment=fig4", "experiment.frames=[]"], "a setting needs frames"),
        (["experiment=fig4", "experiment.frames=[0,20,40]"], r"experiment.frames: a setting needs 2 \(got 3\)"),
        (["experiment=calibration", "experiment.targets=[]"], "a calibration needs targets"),
        (["experiment=fig5", "experiment.frames=[0,262]"], r"experiment.frames \[262\] are not stored"),
        (["experiment=hardness", "experiment.picture=laws"], "a laws shows snow that falls: it takes no indenter"),
        (["experiment=fig5", "indenter=disc"], "a strip shows snow that falls: it takes no indenter"),
    ],
)
def test_what_cannot_be_drawn_is_refused_with_a_reason(overrides, message):
    with pytest.raises(ConfigError, match=message):
        require_drawable(make_plan(overrides, multirun=True).runs)
