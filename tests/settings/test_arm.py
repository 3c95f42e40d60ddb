"""With or without sintering: decided by whether it acts, whatever the option of ``sintering`` is called."""

from pathlib import Path

import pandas as pd
import pytest

from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.evidence import claims
from snowrepro.evidence.claims import NOT_RUN, REPRODUCED
from snowrepro.evidence.gather import Evidence, gather_evidence
from snowrepro.settings.case import ARMS
from snowrepro.store.provenance import provenance
from snowrepro.summary.row import ARM, tabulate_runs
from snowrepro.sweep.plan import make_claims_plan, require_one_run_a_cell
from tests.report.reports import PRESSURES, fill, paper_like

SEEDS = 3
MADE_BY = provenance()
OWN = {  # a name that says the arm, one that says nothing, and one that says the other arm
    "off": ("unsintered", 'defaults: [paper, _self_]\nname: "off"\nenabled: false\n'),
    "extra": ("sintered", "defaults: [paper, _self_]\nname: extra\nenabled: true\nC1: 6.0e-7\n"),
    "unsintered": ("sintered", "defaults: [paper, _self_]\nname: unsintered\n"),
}


@pytest.fixture(autouse=True)
def own_options(tmp_path, monkeypatch) -> Path:
    """A user's folder with options of their own; one look at the clone is enough for all runs."""
    monkeypatch.setattr("snowrepro.store.run.provenance", lambda: MADE_BY)
    folder = tmp_path / "conf" / "sintering"
    folder.mkdir(parents=True)
    for name, (_, text) in OWN.items():
        (folder / f"{name}.yaml").write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def judged(*overrides: str, lost: tuple[str, float, int] | None = None) -> Evidence:
    """Figure 6 with numbers like the paper's; ``lost``: option, pressure and seed of a run that has no result."""

    def lumps(run):
        return None if (run.case.sintering.name, run.case.pressure, run.case.seed) == lost else paper_like(run)

    plan = make_claims_plan(["experiment=fig6", PRESSURES, *overrides], SEEDS)
    return gather_evidence(fill(plan, lumps).runs, Path("report"))


@pytest.mark.parametrize(
    ("option", "arm"), [("paper", ARMS[0]), ("none", ARMS[1]), *((n, a) for n, (a, _) in OWN.items())]
)
def test_an_option_is_in_the_arm_of_what_it_does(option, arm):
    """The built-in ones and a user's own."""
    case = compose([f"sintering={option}"]).case
    assert (case.sintering.name, case.arm) == (option, arm)
    assert compose([f"sintering={option}", "sintering.enabled=false"]).case.arm == "unsintered"
    assert compose([f"sintering={option}", "sintering.enabled=true"]).case.arm == "sintered"


@pytest.mark.parametrize("options", ["paper,none", "extra,off", "off,extra", "unsintered,off", "unsintered,none"])
def test_claims_are_judged_by_the_right_runs(options):
    """With and without sintering as the paper has it, the claims hold under any names and in any order of them."""
    evidence = judged(f"sintering={options}")
    (scene,) = evidence.scenes
    assert {verdict.claim: verdict.word for verdict in scene.verdicts} == dict.fromkeys(
        ("C1", "C2", "C2-loose", "C3", "C4", "C4-loose", "C5"), REPRODUCED
    )
    assert (evidence.half_pressures[scene.name].low, evidence.half_pressures[scene.name].high) == (340, 530)
    assert evidence.table[ARM].tolist() == [*["sintered"] * 9, *["unsintered"] * 9]


def test_a_table_says_the_arm_beside_the_name():
    """Rows of runs, sintered first, also where two options are in one arm."""
    evidence = judged("sintering=off,extra", "pressure=340")
    rows = tabulate_runs(evidence.runs)
    assert list(rows[[ARM, "sintering"]].itertuples(index=False, name=None)) == [
        *[("sintered", "extra")] * SEEDS,
        *[("unsintered", "off")] * SEEDS,
    ]


@pytest.mark.parametrize(
    ("lost", "unjudged"), [(("off", 530.0, 1), ["C4", "C4-loose", "C5"]), (("unsintered", 530.0, 1), ["C1", "C5"])]
)
def test_a_run_that_is_missing_is_missed_in_its_own_arm(lost, unjudged):
    """A lost run without sintering leaves what is claimed of sintered snow, and the reverse."""
    (scene,) = judged("sintering=unsintered,off", lost=lost).scenes
    assert [verdict.claim for verdict in scene.verdicts if verdict.word == NOT_RUN] == unjudged


def test_a_claim_takes_its_arm_from_the_column_alone():
    """Names of options are not looked at: here both arms have the same one."""
    settled = compose().question.claims
    rows = [
        {ARM: arm, "sintering": "any", "pressure": pressure, "seed": seed, "lump_fraction": value}
        | {"loose_fraction": 1 - value}
        for arm, values in zip(ARMS, ((0.2, 0.52, 0.8), (0.0, 0.0, 0.0)), strict=True)
        for pressure, value in zip((340.0, 530.0, 3300.0), values, strict=True)
        for seed in range(SEEDS)
    ]
    table = pd.DataFrame(rows)
    assert {verdict.word for verdict in claims.judge_claims(settled, table)} == {REPRODUCED}
    turned = table.assign(**{ARM: table[ARM].map(dict(zip(ARMS, reversed(ARMS), strict=True)))})
    words = {verdict.claim: verdict.word for verdict in claims.judge_claims(settled, turned)}
    assert words["C3"] == words["C4"] == words["C5"] == "CONTRADICTED"


@pytest.mark.parametrize(
    ("options", "arm"), [("none,off", "unsintered"), ("paper,extra", "sintered"), ("paper,unsintered", "sintered")]
)
def test_two_options_of_one_arm_are_two_runs_of_one_cell(options, arm):
    """A claim could not choose between them."""
    plan = make_claims_plan(["experiment=fig6", PRESSURES, f"sintering={options}"], SEEDS)
    message = rf"two of the runs are star on stair3, {arm}, pressure 340, seed 0: claims need one of each"
    with pytest.raises(ConfigError, match=message):
        require_one_run_a_cell(plan)


@pytest.mark.parametrize("options", ["paper,off", "extra,off", "unsintered,none"])
def test_an_option_of_each_arm_makes_one_run_a_cell(options):
    """Two arms, three pressures, and the seeds."""
    plan = make_claims_plan(["experiment=fig6", PRESSURES, f"sintering={options}"], SEEDS)
    require_one_run_a_cell(plan)
    assert len({(run.case.arm, run.case.pressure, run.case.seed) for run in plan.runs}) == 2 * 3 * SEEDS


def test_a_name_that_yaml_takes_for_a_boolean(own_options):
    """The message says what to write."""
    (own_options / "conf" / "sintering" / "bare.yaml").write_text("defaults: [paper, _self_]\nname: off\n")
    with pytest.raises(ConfigError, match=r'sintering.name: .*\(got False\): write it in quotes, as in name: "off"'):
        compose(["sintering=bare"])
