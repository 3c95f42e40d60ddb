"""Snow of two materials side by side: which claims hold with which."""

import re
from dataclasses import replace

import pandas as pd
import pytest

from snowrepro.evidence.conditions import split_conditions
from snowrepro.evidence.gather import Evidence, gather_evidence
from snowrepro.report.document import Picture, Table
from snowrepro.report.figures import conditions as figure
from snowrepro.settings.question import Experiment
from snowrepro.sweep.plan import make_plan
from tests.configs import carrying
from tests.conftest import SMALL
from tests.report.small_runs import SHAKEN, shaken

ASKED = [*SMALL, "material=table1,sand", "sintering=paper,none", "pressure=500,3000", "seed=0,1"]
EXPERIMENT = Experiment(name="mine", title="Mine", picture="conditions", calibrated_on=("ball", "L"))


@pytest.fixture(scope="module")
def evidence(small_run, tmp_path_factory) -> Evidence:
    """Two materials of which the second never stays in lumps; one of its runs has no result."""
    folder = tmp_path_factory.mktemp("conditions")
    plan = make_plan([*ASKED, f"store={folder}/runs"], multirun=True)
    for run in plan.runs[:-1]:
        is_sand = run.case.material.law.name == "sand"
        part = 0.9 if is_sand else SHAKEN[run.case.sintering.name, int(run.case.pressure)]
        run.save(carrying(shaken(small_run, part, run.case.seed), run.config), wall_seconds=1.0)
    gathered = gather_evidence(plan.runs, folder, plan=plan)
    return Evidence(EXPERIMENT, gathered.runs, gathered.table, folder, gathered.missing, plan)


def test_runs_are_split_by_material_alone(evidence):
    """Each condition has its own runs; by calibration claims hold with the first alone."""
    first, second = split_conditions(evidence)
    assert [each.values for each in (first, second)] == [{"material": "table1"}, {"material": "sand"}]
    for condition, law in ((first, "stomakhin"), (second, "sand")):
        assert len(condition.evidence.runs) == 8
        assert {run.case.material.law.name for run in condition.evidence.runs} == {law}
    assert len(first.evidence.table) == 8 and len(second.evidence.table) == 7
    (scene,), (other,) = first.evidence.scenes, second.evidence.scenes
    assert scene.verdict("C3").calibrated and not other.verdict("C3").calibrated
    assert other.verdict("C4").word == "NOT RUN"


def test_the_report_says_which_claims_hold_with_which(evidence):
    """In a sentence, in a table with a row for each material, and in numbers; a panel without a result says so."""
    content = figure.report(evidence)
    assert content.verdict.startswith("Ball on L: reproduced ") and "with table1 alone: C1* and C3*;" in content.verdict
    assert "under every condition (not judged with sand): C5*" in content.verdict
    assert "under none (not judged with sand): " in content.verdict  # one of its runs is missing
    assert " (* with table1 by calibration, no test.)" in content.verdict
    content = figure.report(replace(evidence, table=evidence.table.assign(settled=1.0)))
    assert "not settled" not in content.verdict
    content = figure.report(replace(evidence, table=evidence.table.assign(settled=1.0 * (evidence.table["seed"] < 0))))
    assert content.verdict.endswith("With table1 and sand most runs have not settled at their end.")
    assert re.search(
        r"In lumps at 3000 with sintering, ball on L: 0.\d\d with table1 and 0.\d\d with sand\.", content.verdict
    )
    table = next(block for block in content.blocks if isinstance(block, Table)).frame
    assert table["material"].tolist() == ["table1", "sand"]
    assert table["C3"].tolist() == [r"yes\*", "open-"]
    assert table["settled"].tolist() == ["0 of 8", "0 of 7"]
    numbers = pd.read_csv(evidence.folder / "conditions.csv")
    assert len(numbers) == 8 and set(numbers["arm"]) == {"sintered", "unsintered"}
    known = numbers[(numbers["material"] == "table1") & (numbers["pressure"] == 3000) & (numbers["arm"] == "sintered")]
    assert known["lump_fraction"].item() > 0.5
    pictures = [block.file for block in content.blocks if isinstance(block, Picture)]
    assert pictures == ["conditions.png", "ends-ball-L.png"]
    assert all((evidence.folder / file).stat().st_size > 5000 for file in pictures)


def test_one_condition_alone_is_a_report_too(evidence):
    """Where nothing but scene, sintering, pressure and seed varies."""
    plan = make_plan([*ASKED, "material=table1", f"store={evidence.folder}/runs"], multirun=True)
    gathered = gather_evidence(plan.runs, evidence.folder, plan=plan)
    alone = replace(evidence, runs=gathered.runs, table=gathered.table, missing=gathered.missing, plan=plan)
    (condition,) = split_conditions(alone)
    assert condition.values == {} and len(condition.evidence.runs) == 8
    content = figure.report(alone)
    assert content.verdict.startswith("Ball on L: reproduced under every condition: ")
