"""The committed answer in a minute: each claim stands in the column that the committed verdicts put it into."""

import json
import re
from pathlib import Path

import pandas as pd
import pytest

from snowrepro.composition.compose import compose
from snowrepro.evidence.answer import HOLDS, NOT, ONLY_IF, Finding, list_losing_readings, sort_claim
from snowrepro.evidence.claims import NOT_RUN, Verdict
from snowrepro.settings.question import Claim

REPORTS = Path(__file__).parents[2] / "reports"
PAGE = REPORTS / "paper" / "README.md"
JUDGED = ("fig5", "fig6", "grid")
CLAIMS = compose().question.claims.list


def read_columns() -> dict[str, list[str]]:
    """The claims that the page names in each column of its table."""
    lines = [line for line in PAGE.read_text("utf-8").splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    head, _, *rows = cells
    return {
        name: [found for row in rows for found in re.findall(r"\*\*(C\S+?)\*\*", row[i])] for i, name in enumerate(head)
    }


def find_committed(claim: Claim) -> list[Finding]:
    """The committed verdicts on a claim, of each scene that it was judged on."""
    found = []
    for name in JUDGED:
        record = json.loads((REPORTS / name / "claims.json").read_text("utf-8"))
        if claim.test == "scenes":
            verdicts = [("other scenes", each) for each in record["over_scenes"] if each["word"] != NOT_RUN]
        else:
            verdicts = [(f"{s['shape']} on {s['floor']}", v) for s in record["scenes"] for v in s["verdicts"]]
        found += [
            Finding(where, Verdict(claim.name, claim.statement, each["word"], each["calibrated"]))
            for where, each in verdicts
            if each["claim"] == claim.name
        ]
    return found


def find_lost() -> dict[str, list[str]]:
    """The readings under which claims are lost by the committed table, by the names of claims."""
    lost: dict[str, list[str]] = {}
    for row in pd.read_csv(REPORTS / "fitted" / "fitted.csv").fillna("").itertuples():
        for name in row.never.split():
            lost.setdefault(name, []).append(row.reading)
    return lost


def test_the_page_begins_with_three_columns():
    assert list(read_columns()) == [HOLDS, ONLY_IF, NOT]


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.name)
def test_each_claim_stands_where_the_verdicts_put_it(claim):
    column = sort_claim(claim, find_committed(claim), list_losing_readings(claim, find_lost())).column
    assert [name for name, claims in read_columns().items() if claim.name in claims] == [column]


def test_it_is_read_in_a_minute():
    """Ten lines and three pictures, which are there."""
    text = PAGE.read_text("utf-8")
    assert re.findall(r"^(\d+)\. ", text, re.MULTILINE) == [str(number) for number in range(1, 11)]
    pictures = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", text)
    assert len(pictures) == 3 and all((PAGE.parent / picture).is_file() for picture in pictures)


def test_the_committed_reports_stay_small() -> None:
    assert sum(path.stat().st_size for path in REPORTS.rglob("*") if path.is_file()) < 10e6
