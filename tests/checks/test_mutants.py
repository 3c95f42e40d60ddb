"""The list of mutants fits the program, and a trial says what it should."""

import pytest

from snowrepro.checks import mutants
from snowrepro.checks.finding import FAILED, MOVED, NOT_MEASURED, OK, REGRESSED, TIERS, Finding
from snowrepro.checks.mutants import Edit, Mutant, Trial
from snowrepro.errors import ExitCode

EDIT = Edit("mpm/solver.py", "no such text", "x")
DEFECT, HARMLESS = Mutant("wrong", 2, EDIT), Mutant("other", None, EDIT)


def trial(mutant: Mutant, **states: str) -> Trial:
    """A trial with a finding a tier, such as t2=REGRESSED."""
    found = tuple(Finding(int(tier[1]), "x", state, "") for tier, state in states.items())
    return Trial(mutant, found)


def test_the_list_has_what_it_takes():
    listed = mutants.read_mutants()
    assert sum(mutant.is_defect for mutant in listed) >= 20
    assert sum(not mutant.is_defect for mutant in listed) >= 8
    assert {mutant.tier for mutant in listed} == {0, 2, 3, 4, None}
    for mutant in listed:
        assert mutant.tier is None or mutant.tier in mutant.tiers(full=False)
        assert mutant.tiers(full=True) == [*TIERS]


@pytest.mark.parametrize("mutant", mutants.read_mutants(), ids=lambda mutant: mutant.name)
def test_each_change_can_be_made(mutant):
    """Its text stands where it says, once: the list has not rotted."""
    edit = mutant.edit
    folder = mutants.CONF_DIR.parent if edit.file.startswith("conf/") else mutants.PACKAGE
    assert (folder / edit.file).read_text("utf-8").count(edit.old) == 1
    assert edit.new != edit.old


def test_a_text_that_is_gone_is_not_tried(tmp_path):
    (found,) = mutants.try_mutants([DEFECT], tmp_path, tmp_path / "store", False, 1)
    assert "stands 0 times in mpm/solver.py" in found.problem and found.verdict == "NOT TRIED"
    assert mutants.choose_exit_code([found]) == ExitCode.INCOMPLETE


@pytest.mark.parametrize(
    ("tried", "verdict"),
    [
        (trial(DEFECT, t1=MOVED, t2=REGRESSED), "caught"),
        (trial(DEFECT, t2=FAILED), "caught"),
        (trial(DEFECT, t0=REGRESSED, t2=OK), "MISSED"),
        (trial(DEFECT, t1=MOVED, t2=OK), "MISSED"),
        (trial(DEFECT, t2=NOT_MEASURED), "MISSED"),
        (trial(HARMLESS, t0=OK, t1=MOVED, t2=OK, t3=OK), "left alone"),
        (trial(HARMLESS, t0=OK, t1=MOVED, t2=OK, t3=REGRESSED), "FLAGGED"),
        (trial(HARMLESS, t0=OK, t3=NOT_MEASURED), "FLAGGED"),
    ],
)
def test_a_defect_is_caught_by_its_own_tier_and_a_harmless_change_by_none(tried, verdict):
    assert tried.verdict == verdict
    right = verdict in ("caught", "left alone")
    assert mutants.choose_exit_code([tried]) == (ExitCode.FINE if right else ExitCode.REGRESSED)


def test_the_table_names_what_went_wrong(tmp_path):
    listed = [
        next(m for m in mutants.read_mutants() if m.tier == 2),
        next(m for m in mutants.read_mutants() if m.tier is None),
    ]
    trials = [trial(listed[0], t1=MOVED, t2=OK), trial(listed[1], t0=OK, t3=REGRESSED)]
    mutants.write_trials(trials, {"machine": "m"}, tmp_path)
    text = (tmp_path / "index.md").read_text()
    assert "0 of 1 defects caught by their tier, 1 of 1 harmless changes flagged" in text
    assert "**MISSED**" in text and "**FLAGGED**" in text
    assert len((tmp_path / "findings.csv").read_text().splitlines()) == 1 + 2
