"""What a command line asks for."""

import pytest

from snowrepro.errors import ConfigError
from snowrepro.sweep.plan import make_claims_plan, make_plan, require_one_run_a_cell


def test_one_run():
    plan = make_plan(["pressure=7", "sintering=none"], multirun=False)
    assert not plan.is_sweep
    assert [(run.case.pressure, run.case.sintering.name) for run in plan.runs] == [(7, "none")]


def test_a_sweep_is_the_product():
    plan = make_plan(["pressure=500,2000", "sintering=paper,none", "seed=range(3)"], multirun=True)
    assert len(plan.runs) == 12
    assert {(run.case.pressure, run.case.sintering.name, run.case.seed) for run in plan.runs} == {
        (p, s, i) for p in (500, 2000) for s in ("paper", "none") for i in range(3)
    }


def test_an_experiment_names_its_runs_and_the_command_line_wins():
    assert len(make_plan(["experiment=fig5"], False).runs) == 2 * 5  # with and without sintering, five pressures
    fewer = make_plan(["experiment=fig5", "pressure=510", "fidelity=preview"], False)
    assert [(run.case.pressure, run.case.sintering.name, run.case.fidelity.name) for run in fewer.runs] == [
        (510, "paper", "preview"),
        (510, "none", "preview"),
    ]
    assert fewer.experiment.name == "fig5"


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["shape=bal"], "there is no shape 'bal'; there are: .*ball"),
        (["shape=0.3"], "'shape=0.3': should be one of the names: ball, rectangle, star, triangle"),
        (["reading=true"], "'reading=true': should be one of the names: grid_units, seen, si"),
        (["pressure=[1,2"], r"cannot read 'pressure=\[1,2': a bracket is not closed, or a value is missing"),
        (["sintering=none,"], "cannot read 'sintering=none,': a bracket is not closed, or a value is missing"),
        (["fidelity=ultra"], "there is no fidelity 'ultra'; there are: fine, paper, preview"),
        (["presure=5"], "there is no setting 'presure'; did you mean 'pressure'"),
        (["reading.C4=1"], "there is no setting 'reading.C4'; did you mean 'sintering.C4'?"),
        (["c4=1"], "there is no setting 'c4'; did you mean 'sintering.C4'?"),
        (["E0=3"], "there is no setting 'E0'; did you mean 'material.E'?"),
        (["frames=9"], "there is no setting 'frames'; did you mean 'loading.frames' or 'experiment.frames'?"),
        (["sinterring.C4=1"], "there is no setting 'sinterring.C4'; did you mean 'sintering.C4'?"),
        (["shape.outlin.width=3"], "there is no setting 'shape.outlin.width'; did you mean 'shape.outline'?"),
        (["reading.gravty=5"], "there is no setting 'reading.gravty'; did you mean 'reading.gravity'?"),
        (["pressure=-1"], "pressure: should be greater than or equal to 0 .got -1"),
        (["reading.poisson_cap=0.5"], "reading.poisson_cap: should be less than 0.5"),
        (["pressure=many"], "pressure: should be a valid number"),
        (["solver.spline=linear"], "solver.spline: should be 'quadratic' or 'cubic'"),
        (["loading.frames=50"], "frames .50. must not be fewer than press_frames .100."),
        (["sintering.rho_max=50"], "sintering.rho_max .50.0. must exceed material.rho"),
        (["pressure=.nan"], "pressure"),
        (["pressure=1,2"], "add -m"),
        (["shape=[ball"], "cannot read"),
        (["fig5"], "'fig5' is no override, which is written key=value, as in experiment=fig5$"),
        (["nothing"], "'nothing' is no override, which is written key=value$"),
        (
            ["experiment=fig7"],
            "there is no experiment 'fig7'; there are: ablation, audit, calibration, convergence, energy, fig2, ",
        ),
    ],
)
def test_wrong_input_is_refused_with_a_reason(overrides, message):
    with pytest.raises(ConfigError, match=message):
        make_plan(overrides, multirun=False)


def test_one_wrong_run_refuses_the_whole_sweep():
    with pytest.raises(ConfigError, match="pressure"):
        make_plan(["pressure=1,2,-3"], multirun=True)


def test_claims_take_an_experiment_with_seeds():
    """Every run of it with each seed."""
    plan = make_claims_plan(["experiment=fig5", "pressure=510"], 2)
    assert {(run.case.sintering.name, run.case.seed) for run in plan.runs} == {
        (arm, i) for arm in ("paper", "none") for i in (0, 1)
    }


@pytest.mark.parametrize(
    ("overrides", "seeds", "message"),
    [
        ([], 3, "one experiment, for example experiment=fig5"),
        (["experiment=fig5,fig6"], 3, "one experiment, for example experiment=fig5"),
        (["experiment=fig5", "seed=1"], 3, "leave out the override of seed"),
        (["experiment=fig5", "seed=0,1"], 3, "leave out the override of seed"),
        (["experiment=fig5", "++seed=4"], 3, "leave out the override of seed"),
        (["experiment=fig5"], 0, "seeds: should be 1 to 100 .got 0"),
        (["experiment=fig5"], 101, "seeds: should be 1 to 100 .got 101"),
        (["experiment=fig7"], 3, "there is no experiment 'fig7'"),
        (["experiment=fig5", "shape=[ball"], 3, "cannot read"),
    ],
)
def test_what_claims_cannot_be_judged_by_is_refused(overrides, seeds, message):
    with pytest.raises(ConfigError, match=message):
        make_claims_plan(overrides, seeds)


@pytest.mark.parametrize("overrides", [["experiment=convergence"], ["experiment=fig5", "solver.cfl=0.1,0.2"]])
def test_a_claim_cannot_choose_between_variants_of_a_run(overrides):
    """Which of them would it be judged by?"""
    with pytest.raises(ConfigError, match=r"two of the runs are ball on L, sintered, pressure \d+, seed 0"):
        require_one_run_a_cell(make_claims_plan(overrides, 1))
