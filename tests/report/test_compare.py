"""Two sweeps side by side, from a store with numbers as wanted and no snow."""

import pandas as pd
import pytest

from snowrepro.report.figures.strip import Row
from snowrepro.report.page.compare import write_comparison
from snowrepro.sweep.plan import make_claims_plan
from tests.report.reports import LIKE_THE_PAPER, PRESSURES, fill, paper_like


@pytest.fixture
def compared(tmp_path, monkeypatch):
    """Figure 6 with its own gravity beside another, at which lumps are as given; returns page and table."""
    monkeypatch.setattr(
        "snowrepro.report.figures.strip._make_row", lambda run, _: Row(f"{run.case.pressure:g}", {}, {}, {})
    )
    for module in ("broken", "specification"):
        monkeypatch.setattr(f"snowrepro.report.sections.{module}.make_blocks", lambda _: [])

    def compare(lumps):
        common = ["experiment=fig6", PRESSURES, f"store={tmp_path}/runs", f"reports={tmp_path}/reports"]
        first = fill(make_claims_plan(common, 3), paper_like)
        second = fill(make_claims_plan([*common, "reading.gravity=20"], 3), lumps)
        page = write_comparison(first, second)
        return page.with_suffix(".md").read_text(), pd.read_csv(page.parent / "differences.csv")

    return compare


def test_what_changes_comes_first(compared):
    """The verdict that flips, before those that stay; the largest difference, before the others."""

    def more_at_the_lowest(run):
        return paper_like(run) + (0.4 if run.case.sintering.enabled and run.case.pressure == 340 else 0.0)

    page, table = compared(more_at_the_lowest)
    changes = page.split("What changes in the verdicts")[1].split("##")[0]
    assert changes.count("- **") == 3  # C1, C2 and C2-loose; C5 has the numbers of C1
    assert "**C2**, star on stair3: A **REPRODUCED** (0.21 " in changes and "B **CONTRADICTED** (0.61 " in changes
    assert "`reading.gravity 10 -> 20`" in page.split("## Verdicts")[0]
    rows = [line for line in page.split("## Verdicts")[1].split("## Numbers")[0].splitlines() if line.startswith("| C")]
    assert {row.split("|")[1].strip() for row in rows[:4]} == {"C1", "C2", "C2-loose", "C5"}
    assert table["difference"].abs().is_monotonic_decreasing
    assert table["difference"].head(3).tolist() == pytest.approx([0.4] * 3)
    assert set(table["pressure"].head(3)) == {340}


@pytest.mark.nightly
def test_the_same_is_said_to_be_the_same(compared):
    """No verdict changes, no number differs."""
    page, table = compared(paper_like)
    assert "Nothing: 8 verdicts are the same word in both." in page
    assert not table["difference"].any()


def test_a_run_without_a_result_is_compared_with_nothing(compared):
    """It is named with its states, is in no difference, and changes a verdict to NOT RUN, said as a change."""
    lost = next(iter(LIKE_THE_PAPER))
    page, table = compared(lambda run: None if (run.case.pressure, run.case.seed) == (lost, 2) else paper_like(run))
    assert len(table) == 16
    assert "Cells without a result on one side, or with other kinds of result: 2." in page
    assert page.split("What changes in the verdicts")[1].split("##")[0].count("B **NOT RUN**") >= 3
