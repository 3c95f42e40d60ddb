"""Verdicts and calibration on tables whose answer is known."""

import pandas as pd
import pytest

from snowrepro.analysis import claims
from snowrepro.analysis.calibration import calibrate


def table(sintered: dict[float, float], unsintered: dict[float, float]) -> pd.DataFrame:
    rows = [("paper", p, f) for p, f in sintered.items()] + [("none", p, f) for p, f in unsintered.items()]
    return pd.DataFrame(rows, columns=["sintering", "pressure", "lump_fraction"])


def words(frame: pd.DataFrame, calibrated: bool = False) -> dict[str, str]:
    return {v.claim: v.word for v in claims.judge(frame, calibrated)}


PAPER_LIKE = table({1: 0.2, 2: 0.5, 3: 0.9}, {1: 0.0, 2: 0.1, 3: 0.1})


def test_what_the_paper_claims_is_reproduced():
    assert set(words(PAPER_LIKE).values()) == {claims.REPRODUCED}


def test_calibrated_pressures_test_only_the_contrast():
    """What the pressures were chosen by cannot count as a test."""
    got = words(PAPER_LIKE, calibrated=True)
    assert got["C4"] == claims.REPRODUCED
    assert {got[c] for c in ("C1", "C2", "C3", "C5")} == {claims.BY_CALIBRATION}


@pytest.mark.parametrize(
    ("frame", "claim"),
    [
        (table({1: 0.2, 2: 0.1, 3: 0.9}, {1: 0.0, 2: 0.0, 3: 0.0}), "C1"),
        (table({1: 0.6, 2: 0.7, 3: 0.9}, {1: 0.0, 2: 0.0, 3: 0.0}), "C2"),
        (table({1: 0.2, 2: 0.3, 3: 0.5}, {1: 0.0, 2: 0.0, 3: 0.0}), "C3"),
        (table({1: 0.2, 2: 0.5, 3: 0.9}, {1: 0.0, 2: 0.5, 3: 0.1}), "C4"),
        (table({1: 0.2, 2: 0.5, 3: 0.9}, {1: 0.0, 2: 0.1, 3: 0.8}), "C5"),
    ],
)
def test_each_claim_can_be_contradicted(frame, claim):
    """Also where the pressures were calibrated."""
    assert words(frame)[claim] == claims.CONTRADICTED
    assert words(frame, calibrated=True)[claim] == claims.CONTRADICTED
    said = claims.sentence(frame, claims.judge(frame, False))
    assert claim in said.split("contradicted: ")[1].split(";")[0]


def test_missing_arms_are_not_run():
    """A claim without runs has no verdict; an empty table has none at all."""
    only = table({1: 0.2, 2: 0.5}, {})
    assert words(only)["C4"] == words(only)["C5"] == claims.NOT_RUN
    assert set(words(pd.DataFrame()).values()) == {claims.NOT_RUN}
    assert "without" not in claims.sentence(only, claims.judge(only, False))


def test_calibration_reads_the_rising_fit():
    """On a straight line in log pressure the crossings are exact; a dip is levelled; out of reach is None."""
    line = pd.DataFrame({"sintering": "paper", "pressure": [10.0, 100.0, 1000.0], "lump_fraction": [0.0, 0.5, 1.0]})
    assert calibrate(line, [0.25, 0.5, 0.75]) == [32.0, 100.0, 320.0]
    dip = pd.DataFrame({"sintering": "paper", "pressure": [1.0, 2.0, 4.0, 8.0], "lump_fraction": [0.1, 0.5, 0.3, 0.7]})
    assert calibrate(dip, [0.4]) == [2.0]
    assert calibrate(dip, [0.05, 0.9]) == [None, None]


def test_a_missing_run_is_not_stood_in_for():
    """Without the lowest pressure the next one is not the lowest: claims about that arm are not judged."""
    frame = table({510: 0.4, 3000: 0.8}, {330: 0.0, 510: 0.0, 3000: 0.0})
    verdicts = {v.claim: v for v in claims.judge(frame, False, missing=[("paper", 330)])}
    assert {verdicts[c].word for c in ("C1", "C2", "C3", "C5")} == {claims.NOT_RUN}
    assert verdicts["C4"].word == claims.REPRODUCED
    assert "no result at 330" in verdicts["C2"].measured
