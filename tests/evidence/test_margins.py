"""Margins of claims in a sample: what decides them, from numbers whose answer is known."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from snowrepro.errors import ConfigError
from snowrepro.evidence.collect import CollectedSweep, collect_sweep
from snowrepro.evidence.influence import FIRST, measure_influence
from snowrepro.evidence.margins import find_claim, list_margins, read_margins
from snowrepro.report.sections.influence import make_blocks
from snowrepro.sweep.plan import make_plan

RANGES = ["reading.friction=interval(0,1)", "reading.drop_height=interval(20,90)"]
LISTED = ["pressure=300,740,5900", "sintering=paper,none", "seed=0,1"]
LUMPS = {300: 0.2, 740: 0.5, 5900: 0.9}
NAMES = ["C1", "C2", "C2-loose", "C3", "C4", "C4-loose", "C5"]


def sample(*listed: str, points: int = 64) -> CollectedSweep:
    """As if friction alone moved the lumps of the lowest pressure, by up to 0.2; without sintering there are none."""
    words = ["design=sobol", f"design.points={points}", *RANGES, *listed]
    sweep = collect_sweep(make_plan(words, multirun=True))
    arm = np.array([run.case.arm for run in sweep.runs])
    pressure, friction = (sweep.table[key].astype(float) for key in ("pressure", "reading_friction"))
    lumps = (pressure.map(LUMPS) + 0.2 * friction * (pressure == 300)) * (arm == "sintered")
    table = sweep.table.assign(state="done", arm=arm, lump_fraction=lumps, loose_fraction=0.0)
    return replace(sweep, table=table)


@pytest.fixture(scope="module")
def sweep() -> CollectedSweep:
    return sample(*LISTED)


def margins_of(sweep: CollectedSweep, name: str) -> pd.Series:
    claim = find_claim(sweep, name)
    assert claim is not None
    return read_margins(sweep, claim)


def test_a_margin_is_of_a_point(sweep):
    """Of all its pressures, arms and seeds, and stands once."""
    margins = margins_of(sweep, "C2")
    assert margins.notna().sum() == 64 and len(margins) == 64 * 12
    known = margins.dropna()
    friction = sweep.table.loc[known.index, "reading_friction"].astype(float)
    np.testing.assert_allclose(known, 0.3 - 0.2 * friction)
    np.testing.assert_allclose(margins_of(sweep, "C1").dropna(), (0.3 - 0.2 * friction).clip(upper=0.4))
    assert (margins_of(sweep, "C2-loose").dropna() == -0.5).all()


def test_the_setting_that_moves_a_claim_is_found(sweep):
    influence = measure_influence(sweep, "C2")
    found = influence.table.set_index("setting")["value"]
    assert influence.rank(FIRST)[0] == "reading.friction" and set(found.index) == {
        "reading.friction", "reading.drop_height"
    }  # fmt: skip
    assert found["reading.friction"] > 0.9 and abs(found["reading.drop_height"]) < 0.2
    assert measure_influence(sweep, "C3").note == "it is the same in all runs"


def test_a_point_without_a_run_has_no_margin(sweep):
    """Of the claims that need the run; those of the other arm have theirs."""
    lost = (sweep.table["point"] == 5) & (sweep.table["arm"] == "sintered") & (sweep.table["pressure"] == 300)
    table = sweep.table.assign(state=np.where(lost, "failed", "done"))
    table.loc[lost, "lump_fraction"] = np.nan
    gone = replace(sweep, table=table)
    counts = {name: int(margins_of(gone, name).notna().sum()) for name in NAMES}
    assert counts == {"C1": 63, "C2": 63, "C2-loose": 63, "C3": 64, "C4": 64, "C4-loose": 64, "C5": 63}


def test_claims_need_pressures_and_both_arms():
    assert list_margins(sample(*LISTED, points=2)) == NAMES
    for listed in (["pressure=300,740"], ["sintering=paper,none", "pressure=300"]):
        sweep = sample(*listed, points=2)
        assert list_margins(sweep) == [] and find_claim(sweep, "C1") is None
        with pytest.raises(ConfigError, match="'C1' is no column"):
            measure_influence(sweep, "C1")


def test_a_report_shows_margins(sweep, tmp_path):
    text = str(make_blocks(sweep, tmp_path))
    counts = {name: int((margins_of(sweep, name) > 0).sum()) for name in NAMES}
    assert len(set(counts.values())) > 1
    listed = ", ".join(f"{name} at {counts[name]} of 64" for name in NAMES[:-1])
    assert f"The numbers agree with {listed} and {NAMES[-1]} at {counts[NAMES[-1]]} of 64 points" in text
    assert "margin of C2" in text and (tmp_path / "influence.png").stat().st_size > 10_000
