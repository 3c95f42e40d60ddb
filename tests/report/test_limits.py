"""Grid and time step finer and finer: which sequences have steps that shrink, and what the page says of them."""

import math
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from snowrepro.composition.compose import compose
from snowrepro.evidence.gather import Evidence
from snowrepro.evidence.limits import (
    MEASURES,
    STEP,
    Descent,
    compare_choices,
    count_outcomes,
    list_descents,
    measure_reach,
)
from snowrepro.evidence.refinement import SPACING
from snowrepro.report.document import Table
from snowrepro.report.figures import limits
from snowrepro.settings.question import Experiment
from snowrepro.store.run import Run
from snowrepro.summary.row import ARM
from snowrepro.sweep.plan import make_plan
from tests.configs import carrying, changed
from tests.conftest import SMALL
from tests.report.reports import reported

STUDY = Experiment(name="limits", title="limits", picture="limits")
PRINTED, SOFT = (), (("reading.softening_length", 1.0),)


def converge_when_soft(dx: float, cfl: float, is_soft: bool) -> float:
    """Lumps that converge at first order over cells where cracks have a length, and else do not; all over time steps.

    One run is missing.
    """
    if (dx, cfl, is_soft) == (0.5, 0.1, True):
        return math.nan
    return (0.5 + 0.1 * dx if is_soft else 0.5 - 0.1 / dx) + 0.2 * cfl**2


@pytest.fixture(scope="module")
def runs() -> list[Run]:
    """Runs at three grids, three time steps and two lengths of softening."""
    return [
        Run(changed(compose([f"{SPACING}={dx}", f"{STEP}={cfl}", *soft, "pressure=740"]), experiment=STUDY))
        for soft in ([], ["reading.softening_length=1"])
        for dx in (1.0, 2.0, 0.5)
        for cfl in (0.4, 0.2, 0.1)
    ]


def built(runs: list[Run], lumps: Callable[[float, float, bool], float], folder: Path) -> Evidence:
    """Evidence from built numbers: lumps as asked for, no other measure moves; NaN: the run has no result."""
    rows, missing = [], set()
    for run in runs:
        case = run.case
        value = lumps(case.fidelity.dx, case.solver.cfl, bool(case.reading.softening_length))
        if math.isnan(value):
            missing.add(run.id)
            continue
        row = {"run_id": run.id, ARM: case.arm, "sintering": "paper", "pressure": 740.0, "seed": 0}
        rows.append({**row, **dict.fromkeys(MEASURES, 0.5), "lump_fraction": value})
    return Evidence(STUDY, runs, pd.DataFrame(rows), folder, frozenset(missing))


def select_lumps(descents: list[Descent], along: str) -> list[Descent]:
    """The sequences of lumps along one setting."""
    return [its for its in descents if (its.along, its.measure) == (along, "lump_fraction")]


def test_sequences_are_told_apart_by_what_is_held_and_chosen(runs, tmp_path):
    descents = list_descents(built(runs, converge_when_soft, tmp_path))
    found = {(its.choice, its.held): its.trend for its in select_lumps(descents, SPACING)}
    assert {key: trend.outcome for key, trend in found.items()} == {
        **{(PRINTED, cfl): "do not shrink" for cfl in (0.4, 0.2, 0.1)},
        **{(SOFT, cfl): "shrink" for cfl in (0.4, 0.2)},
        (SOFT, 0.1): "not run",
    }
    assert found[SOFT, 0.4].order == pytest.approx(1.0)
    assert found[SOFT, 0.4].limit[0] == pytest.approx(0.5 + 0.2 * 0.16)
    over_steps = {(its.choice, its.held): its.trend for its in select_lumps(descents, STEP)}
    assert over_steps[PRINTED, 0.5].levels == (0.4, 0.2, 0.1)
    assert over_steps[PRINTED, 0.5].order == pytest.approx(2.0)
    assert over_steps[SOFT, 0.5].outcome == "not run"


def test_choices_are_compared_on_what_was_run_with_each(runs, tmp_path):
    """The sequences that one of them lacks are left out for both."""
    lumps = select_lumps(list_descents(built(runs, converge_when_soft, tmp_path)), SPACING)
    assert compare_choices(lumps) == {PRINTED: {"do not shrink": 2}, SOFT: {"shrink": 2}}
    assert count_outcomes(lumps) == {"do not shrink": 3, "shrink": 2, "not run": 1}


def test_the_page_says_where_steps_shrink(runs, tmp_path):
    """In words that come from the numbers; a run that is missing is no number."""
    content = limits.report(built(runs, converge_when_soft, tmp_path))
    assert content.verdict.startswith(
        "As cells get narrower, steps shrink in 2 of 20 sequences; in 3 they do not, or hardly; in 15 there are "
        "hardly any; 4 were not run. As the time step gets shorter, steps shrink in 5 of 20 sequences;"
    )
    assert "steps shrink in so many (As in Figure 5: 2; cracks take the same energy on any grid: 4)" in content.verdict
    counts, over_cells, over_steps = (block.frame for block in content.blocks if isinstance(block, Table))
    assert counts["lumps"].tolist() == ["0 of 3", "2 of 2", "3 of 3", "2 of 2"]
    soft = over_cells[over_cells["measure"] == "lumps"].set_index("CFL number")[
        "cracks take the same energy on any grid"
    ]
    assert soft["0.4"] == "0.732, 0.632, 0.582; steps -0.100, -0.050; order 1.0, towards 0.53 ± 0.06"
    assert soft["0.1"] == "0.702, 0.602, not run"
    assert len(over_steps) == len(MEASURES) * 3
    written = pd.read_csv(tmp_path / "limits.csv")
    assert len(written) == 2 * len(MEASURES) * 3 * 2
    assert {"limits.png", "limits-narrow.png"} <= {path.name for path in tmp_path.iterdir()}


def test_no_choice_is_named_where_none_is_better(runs, tmp_path):
    content = limits.report(built(runs, lambda dx, cfl, is_soft: 0.5 - 0.1 / dx, tmp_path))
    assert "Of the 24 that were run with every choice, steps shrink in so many (As in Figure 5: 0;" in content.verdict


def test_the_page_is_made_from_a_store(small_run, tmp_path):
    """Two grids with the same result, and one that was not run."""
    asked = []
    for dx in (2.0, 1.0, 0.5):
        config = compose([*SMALL, f"{SPACING}={dx}", "pressure=3000", f"store={tmp_path}/runs"])
        asked.append(Run(changed(config, experiment=STUDY, reports=f"{tmp_path}/reports")))
    for run in asked[:2]:
        run.save(carrying(small_run, run.config), wall_seconds=2.0, seconds_per_frame=0.01)
    report = reported(asked)
    page = (report.evidence.folder / "index.md").read_text()
    assert "4 were not run" in report.content.verdict
    strain = pd.read_csv(report.evidence.folder / "limits.csv").set_index(["finer", "measure"])
    assert 0 < strain.loc[("dx", "strain_at_gauge"), "dx=2"] == strain.loc[("dx", "strain_at_gauge"), "dx=1"] < 1
    assert "| strain at the gauge | 3000 | 0.4 |" in page and "not run" in page
    assert "limits-narrow.png" in {path.name for path in report.evidence.folder.iterdir()}


def test_the_experiment_has_the_runs_that_can_be_paid_for():
    """All sets of choices but those on the finest grid at the smallest time step, where Figure 5 stands alone."""
    runs = make_plan(["experiment=limits"], False).runs
    sets = {
        (case.fidelity.dx, case.solver.cfl, case.reading.softening_length, case.reading.press_damping)
        for case in (run.case for run in runs)
    }
    assert (len(runs), len({run.id for run in runs}), len(sets)) == (99, 99, 3 * 3 * 2 * 2 - 3)
    assert [its[2:] for its in sets if its[:2] == (0.5, 0.1)] == [(None, 0.0)]


def test_how_far_a_choice_reaches(runs, tmp_path):
    """At the same cells and time step, where both were run: here 0.1 (dx + 1/dx), most at 2 and 0.5."""
    descents = list_descents(built(runs, converge_when_soft, tmp_path))
    assert measure_reach(descents, SOFT, "lump_fraction") == pytest.approx(0.25)
    assert measure_reach(descents, PRINTED, "lump_fraction") == measure_reach(descents, SOFT, "flattening_end") == 0
    never = list_descents(built(runs, lambda dx, cfl, is_soft: math.nan if is_soft else 0.5, tmp_path))
    assert math.isnan(measure_reach(never, SOFT, "lump_fraction"))
    said = limits.report(built(runs, converge_when_soft, tmp_path)).verdict
    assert said.endswith("at the same cells and time step: 'cracks take the same energy on any grid' 0.250.")
