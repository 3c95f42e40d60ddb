"""What other definitions of a lump make of the same numbers."""

import numpy as np
import pandas as pd
import pytest

from snowrepro.composition.compose import compose
from snowrepro.evidence.sensitivity import CHOICES
from snowrepro.report.sections import specification as sensitivity
from snowrepro.store.run import Run
from tests.conftest import SMALL
from tests.report.reports import reported


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([0.1, 0.3, 0.8], True),
        ([0.9, 0.1, 0.6, 0.7], True),  # 0.1, 0.6, 0.7
        ([0.1, 0.8, 0.3, 0.2], False),  # nothing rises twice to above one half
        ([0.6, 0.7, 0.8], False),
        ([0.1, 0.2, 0.3], False),
        ([0.1, 0.6, 0.6], False),
    ],
)
def test_three_pressures_that_would_do(values, expected):
    """By hand."""
    assert sensitivity._has_rising_three(np.array([values]))[0] == expected


def test_exceptions_are_single_changes():
    """Only definitions one choice away from the one used are named, with what they lose."""
    base = dict(zip(CHOICES, ("bonds", "both", 0.3, 0.3333, 1.5, 0.01), strict=True))
    rows = [base, {**base, "break_strain": 0.5}, {**base, "break_strain": 0.5, "core_fraction": 0.5}]
    rows += [{**base, "definition": "grid", "break_by": "", "break_strain": np.nan, "core_fraction": np.nan}]
    choices = pd.DataFrame(rows)
    holds = pd.DataFrame({"C1": [True, True, False, False], "C2": [True, False, False, True]})
    assert sensitivity._find_usual(choices, Run(compose())) == 0
    told = sensitivity._list_exceptions(choices, holds, 0)
    assert told[1].splitlines() == ["- break strain 0.5: C2", "- grid: C1"]


@pytest.mark.nightly
def test_the_scan_in_the_report(small_run, tmp_path):
    """The same result at two pressures and in both arms: nothing grows under any definition, and all is written."""
    of_all = [*SMALL, f"store={tmp_path}/runs", f"reports={tmp_path}/reports", "experiment=fig5"]
    of_all.append("experiment.frames=[0,20,60]")
    runs = [
        Run(compose([*of_all, f"sintering={name}", f"pressure={p}"]))
        for name in ("paper", "none")
        for p in (2000, 3000)
    ]
    for run in runs:
        run.save(small_run, wall_seconds=2.0, seconds_per_frame=0.01)
    report = reported(runs, ["experiment=fig5"])
    table = pd.read_csv(report.evidence.folder / "sensitivity.csv")
    assert len(table) == 892
    assert not table[["C1", "C5"]].to_numpy().any()
    assert (table["C2"] != table["C3"]).mean() > 0.99
    assert (table["C2"] == table["C4"]).all()
    assert (table["sintered 2000"] == table["unsintered 3000"]).all()
    assert table["sintered 2000"].nunique() > 10
    page = (report.evidence.folder / "index.md").read_text()
    assert "| all |  | 892 | 0 % |" in page
    assert {"specification.png", "strains.png"} <= {path.name for path in report.evidence.folder.iterdir()}


def test_claims_on_another_measure_are_not_scanned(small_run, tmp_path):
    """Claims of which none is about the mass in lumps: the report says so in place of the scan."""
    own = "claims.list=[{name: K, statement: s, paper: p, measure: powder_fraction, test: below, threshold: 0.5}]"
    of_all = [*SMALL, f"store={tmp_path}/runs", f"reports={tmp_path}/reports", "experiment=fig5", own]
    of_all.append("experiment.frames=[0,20,60]")
    runs = [Run(compose([*of_all, f"pressure={pressure}"])) for pressure in (2000, 3000)]
    for run in runs:
        run.save(small_run, wall_seconds=2.0, seconds_per_frame=0.01)
    page = (reported(runs, ["experiment=fig5"]).evidence.folder / "index.md").read_text()
    assert "Not scanned: no claim is about the mass in lumps of these runs." in page
