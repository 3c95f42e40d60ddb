"""The answer in three columns, from verdicts that are given."""

import pytest

from snowrepro.composition.compose import compose
from snowrepro.evidence.answer import HOLDS, NOT, ONLY_IF, OPEN, Finding, list_losing_readings, sort_claim
from snowrepro.evidence.claims import CONTRADICTED, INCONCLUSIVE, NOT_RUN, REPRODUCED, Verdict

CLAIM = compose().question.claims.list[0]


def find(where: str, word: str, calibrated: bool = False) -> Finding:
    return Finding(where, Verdict(CLAIM.name, CLAIM.statement, word, calibrated))


@pytest.mark.parametrize(
    ("findings", "column", "why"),
    [
        ([find("A", REPRODUCED), find("B", REPRODUCED)], HOLDS, "on A and B"),
        ([find("A", REPRODUCED, True), find("B", REPRODUCED)], HOLDS, "on B; by choice of the pressures on A"),
        ([find("A", REPRODUCED, True)], ONLY_IF, "the pressures are chosen for it, as on A"),
        (
            [find("A", REPRODUCED, True), find("B", CONTRADICTED)],
            ONLY_IF,
            "the pressures are chosen for it, as on A; not on B",
        ),
        ([find("A", REPRODUCED), find("B", CONTRADICTED)], ONLY_IF, "it is on A; not on B"),
        ([find("A", REPRODUCED), find("B", INCONCLUSIVE)], ONLY_IF, "it is on A; open on B"),
        ([find("A", CONTRADICTED), find("B", CONTRADICTED)], NOT, "contradicted on A and B"),
        ([find("A", CONTRADICTED), find("B", NOT_RUN)], NOT, "contradicted on A; open on B"),
        ([find("A", INCONCLUSIVE), find("B", NOT_RUN)], OPEN, "open on A and B"),
        ([], OPEN, ""),
        ([find(name, REPRODUCED) for name in "ABCD"], HOLDS, "on 4 scenes"),
        ([find(name, REPRODUCED) for name in ("Fig. 5, A", *"ABCD")], HOLDS, "on 4 scenes"),
    ],
)
def test_claims_are_sorted_by_the_words_of_their_verdicts(findings, column, why):
    answer = sort_claim(CLAIM, findings)
    assert (answer.column, answer.why) == (column, why)


LOST = ["SI units", "no friction"]
SO = "not if the paper is read so: SI units, or no friction"


@pytest.mark.parametrize(
    ("findings", "column", "why"),
    [
        ([find("A", REPRODUCED), find("B", REPRODUCED)], ONLY_IF, f"it is on A and B; {SO}"),
        ([find("A", REPRODUCED), find("B", CONTRADICTED)], ONLY_IF, f"it is on A; not on B; {SO}"),
        ([find("A", REPRODUCED, True)], ONLY_IF, f"the pressures are chosen for it, as on A; {SO}"),
        ([find("A", CONTRADICTED)], NOT, "contradicted on A"),
        ([find("A", INCONCLUSIVE)], OPEN, "open on A"),
    ],
)
def test_a_reading_that_loses_a_claim_is_a_condition(findings, column, why):
    answer = sort_claim(CLAIM, findings, LOST)
    assert (answer.column, answer.why) == (column, why)


def test_a_claim_over_scenes_is_lost_with_any_that_it_sums_up():
    over_scenes = next(claim for claim in compose().question.claims.list if claim.name == "C6")
    lost = {"C1": ["SI units"], "C4": ["no friction", "SI units"], "C2-loose": ["as in Figure 5"]}
    assert list_losing_readings(over_scenes, lost) == LOST
    assert list_losing_readings(CLAIM, lost) == ["SI units"]
