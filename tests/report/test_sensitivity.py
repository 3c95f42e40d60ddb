"""What other definitions of a lump make of the same numbers."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snowrepro.analysis import claims
from snowrepro.analysis.sensitivity import CHOICES
from snowrepro.composition import compose
from snowrepro.report import sensitivity
from snowrepro.store import runs
from tests.conftest import SMALL
from tests.report.reports import reported

PRESSURES = (340.0, 530.0, 3300.0)
WRITTEN = compose().claims
PART = st.floats(0, 1).map(lambda value: round(value, 2))


@settings(deadline=None, max_examples=60)
@given(st.lists(PART, min_size=6, max_size=6))
def test_many_at_once_point_where_one_points(values):
    """``claims.points`` of a row is ``Verdict.agrees`` of a table with the same numbers."""
    rows = [(arm, p, 0) for arm in ("paper", "none") for p in PRESSURES]
    table = pd.DataFrame(rows, columns=["sintering", "pressure", "seed"]).assign(lump_fraction=values)
    names = [("sintered" if arm == "paper" else "unsintered", p) for arm, p, _ in rows]
    means = pd.DataFrame([values], columns=pd.MultiIndex.from_tuples(names))
    verdicts = {v.claim: v.agrees for v in claims.judge(WRITTEN, table)}
    for claim in WRITTEN.list:
        if claim.test != "scenes":
            assert bool(claims.points(claim, means).iloc[0]) == verdicts[claim.name], claim.name


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
    assert sensitivity._any_three(np.array([values]))[0] == expected


def test_exceptions_are_single_changes():
    """Only definitions one choice away from the one used are named, with what they lose."""
    base = dict(zip(CHOICES, ("bonds", "both", 0.3, 0.3333, 1.5, 0.01), strict=True))
    rows = [base, {**base, "break_strain": 0.5}, {**base, "break_strain": 0.5, "core_fraction": 0.5}]
    rows += [{**base, "definition": "grid", "break_by": "", "break_strain": np.nan, "core_fraction": np.nan}]
    choices = pd.DataFrame(rows)
    holds = pd.DataFrame({"C1": [True, True, False, False], "C2": [True, False, False, True]})
    assert sensitivity._usual(choices, compose()) == 0
    told = sensitivity._exceptions(choices, holds, 0)
    assert told[1].splitlines() == ["- break strain 0.5: C2", "- grid: C1"]


def test_the_scan_in_the_report(small_run, tmp_path):
    """The same result at two pressures and in both arms: nothing grows under any definition, and all is written."""
    of_all = [*SMALL, f"store={tmp_path}/runs", f"reports={tmp_path}/reports", "experiment=fig5"]
    of_all.append("experiment.frames=[0,20,60]")
    configs = [
        compose([*of_all, f"sintering={arm}", f"pressure={p}"]) for arm in ("paper", "none") for p in (2000, 3000)
    ]
    for config in configs:
        runs.save(small_run, config, wall_seconds=2.0, seconds_per_frame=0.01)
    report = reported(configs, ["experiment=fig5"])
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
