"""Tier 4: every change of a verdict fails, and what was so before may stay so."""

import pandas as pd
import pytest

from snowrepro.checks import verdicts
from snowrepro.checks.finding import CONTRADICTED, FAILED, NOT_MEASURED, OK, REGRESSED
from snowrepro.evidence import claims


def row(word: str, claim: str = "C1", seeds: int = 3) -> dict:
    return {"experiment": "fig5", "fidelity": "preview", "seeds": seeds, "claim": claim, "verdict": word,
            "numbers": "agree", "measured": "0.4 at 340"}  # fmt: skip


@pytest.mark.parametrize(
    ("before", "now", "state"),
    [
        (claims.REPRODUCED, claims.REPRODUCED, OK),
        (claims.CONTRADICTED, claims.CONTRADICTED, OK),
        (claims.REPRODUCED, claims.CONTRADICTED, CONTRADICTED),
        (claims.INCONCLUSIVE, claims.CONTRADICTED, CONTRADICTED),
        (claims.REPRODUCED, claims.INCONCLUSIVE, REGRESSED),
        (claims.INCONCLUSIVE, claims.REPRODUCED, REGRESSED),
        (claims.REPRODUCED, claims.NOT_RUN, FAILED),
        (None, claims.REPRODUCED, NOT_MEASURED),
        (None, claims.CONTRADICTED, CONTRADICTED),
    ],
)
def test_a_verdict_beside_the_one_before(before, now, state):
    reference = pd.DataFrame([row(before)] if before else [])
    (found,) = verdicts.compare_with_reference(pd.DataFrame([row(now)]), reference)
    assert found.state == state and found.measured == now


def test_only_runs_of_the_same_size_are_compared():
    (found,) = verdicts.compare_with_reference(
        pd.DataFrame([row(claims.REPRODUCED)]), pd.DataFrame([row(claims.REPRODUCED, seeds=10)])
    )
    assert found.state == NOT_MEASURED


def test_what_a_new_reference_changes_is_told():
    before = pd.DataFrame([row(claims.REPRODUCED), row(claims.REPRODUCED, "C2")])
    after = pd.DataFrame([row(claims.REPRODUCED), row(claims.INCONCLUSIVE, "C2"), row(claims.REPRODUCED, "C3")])
    assert verdicts.describe_changes(before, after) == [
        "fig5, preview, 3, C2: REPRODUCED -> INCONCLUSIVE",
        "fig5, preview, 3, C3: new -> REPRODUCED",
    ]
