"""The map from rows whose answer is known: shares, failures, claims at chosen pressures, and what is told of it."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from snowrepro.composition.compose import compose
from snowrepro.evidence.choices import BY_BOTH, BY_LUMPS, judge_choices, list_judged
from snowrepro.evidence.map import (
    IMPACT,
    PLACE,
    PRESS,
    READINGS,
    ImpactMap,
    has_failed,
    name_cause,
    place_readings,
    share_choices,
    sum_core_hours,
    tabulate_failures,
)
from snowrepro.mpm.constants import make_constants
from snowrepro.report.figures.map import (
    describe_runs,
    draw_map,
    draw_region,
    tabulate_rows,
    write_verdict,
)
from snowrepro.settings.case import ARMS
from snowrepro.store.run import Run
from snowrepro.sweep.plan import make_plan

E0 = 140_000.0
IMPACTS = (0.1, 1.0)
# Mass in lumps with sintering by impact number; the rest is loose at 0.1, and crushed at 1.
LUMPS = {0.1: {100: 0.2, 300: 0.6, 900: 0.9, 2700: 0.8}, 1.0: {100: 0.1, 300: 0.2, 900: 0.3, 2700: 0.6}}
CAUSES = {
    "diverged in frame 312 at t = 6.2 s: particle 7 at (3.1, 4) left the grid; last good state: frame 310": (
        "diverged: a particle left the grid"
    ),
    "diverged in frame 9 at t = 0.2 s: 31% of the particles are crushed to the lowest J_P, 0.1": (
        "diverged: many particles are crushed to the lowest J_P, 0.1"
    ),
    "diverged in frame 9 at t = 0.2 s: the time step fell to 1e-7 s, with which a frame of 0.02 s needs more than 20": (
        "diverged: the time step fell so far that a frame of 0.02 s needs more than 20"
    ),
    "out of memory": "out of memory",
}


def build_row(floor: str, arm: str, impact: float, pressure: float) -> dict:
    lumps = LUMPS[impact][pressure] if arm == "sintered" else 0.0
    loose = (1.0 - lumps) * (impact < 0.5)
    return {
        "floor": floor, "arm": arm, "pressure": float(pressure), "seed": 0, IMPACT: impact, PRESS: pressure / E0,
        "state": "done", "reason": "", "lump_fraction": lumps, "loose_fraction": loose,
        "crushed_fraction": 1.0 - lumps - loose, "settled": 1.0, "seconds": 90.0,
    }  # fmt: skip


@pytest.fixture
def mapped() -> ImpactMap:
    rows = [build_row(*key, pressure) for key in _list_keys() for pressure in LUMPS[0.1]]
    return ImpactMap(pd.DataFrame(rows))


def _list_keys() -> list[tuple[str, str, float]]:
    return [(floor, arm, impact) for floor in ("L", "triangle") for arm in ARMS for impact in IMPACTS]


def without(mapped: ImpactMap, state: str, reason: str, **where: object) -> ImpactMap:
    """The same map, some of whose runs have no result."""
    table = mapped.table.copy()
    gone = np.logical_and.reduce([table[name] == value for name, value in where.items()])
    table.loc[gone, ["state", "reason"]] = state, reason
    table.loc[gone, ["lump_fraction", "crushed_fraction", "loose_fraction", "settled", "seconds"]] = np.nan
    return replace(mapped, table=table)


@pytest.fixture
def claims():
    return compose().question.claims


def test_runs_are_spread_over_both_numbers(mapped):
    """Also where a whole row of runs has no result."""
    lumps = without(mapped, "pending", "never run", floor="L", impact_number=0.1).spread(
        "L", "sintered", "lump_fraction"
    )
    assert lumps.index.tolist() == [0.1, 1.0] and lumps.columns.tolist() == [p / E0 for p in LUMPS[0.1]]
    assert lumps.loc[1.0].tolist() == [0.1, 0.2, 0.3, 0.6] and lumps.loc[0.1].isna().all()


def test_half_is_bracketed_at_each_impact_number(mapped):
    assert [mapped.bracket_half("L", "sintered", impact).low for impact in IMPACTS] == [100, 900]
    assert mapped.bracket_half("triangle", "unsintered", 1.0).high is None
    missing = without(mapped, "pending", "never run", pressure=300.0)
    half = missing.bracket_half("L", "sintered", 0.1)
    assert (half.low, half.high) == (100, 900)
    assert without(mapped, "pending", "never run", arm="sintered").bracket_half("L", "sintered", 0.1).note == "no runs"


@pytest.mark.parametrize("reason", CAUSES)
def test_causes_are_told_without_their_numbers(reason):
    assert name_cause(reason) == CAUSES[reason]


def test_failures_have_a_region_and_what_was_not_run_is_none(mapped):
    first, second, *_ = CAUSES
    failed = without(mapped, "failed", first, arm="sintered", pressure=2700.0)
    failed = without(failed, "failed", second, arm="unsintered", pressure=100.0, impact_number=1.0)
    failed = without(failed, "pending", "never run", floor="L", arm="unsintered", pressure=300.0)
    table = tabulate_failures(failed.table)
    assert table[["runs", "arm"]].to_numpy().tolist() == [[4, "sintered"], [2, "unsintered"]]
    assert table[IMPACT].tolist() == ["0.1 to 1", "1"] and table[PRESS].tolist() == ["0.019", "0.00071"]
    assert table["floors"].tolist() == ["L, triangle"] * 2 and table["cause"][0] == f"failed: {CAUSES[first]}"
    assert has_failed(failed.table).sum() == 6 and tabulate_failures(mapped.table).empty
    assert failed.spread_failures("L", "sintered").sum().tolist() == [0, 0, 0, 2]
    assert describe_runs(failed.table).startswith("32 runs: 24 with a result, 6 failed, 2 not run yet. 0 still changed")
    assert sum_core_hours(failed.table) == pytest.approx(24 * 90 / 3600)


def test_claims_are_judged_at_every_three_pressures(mapped, claims):
    """Worked out by hand: at 0.1 lumps fall at the end; at 1 only 2700 has over half in lumps, and no snow is loose."""
    choices = (
        judge_choices(claims, mapped.table, PLACE).query("floor == 'L'").set_index([IMPACT, "low", "middle", "high"])
    )
    choices = choices.sort_index()
    expected = {
        (0.1, 100, 300, 900): (True, True), (0.1, 100, 300, 2700): (True, True), (0.1, 100, 900, 2700): (False, False),
        (0.1, 300, 900, 2700): (False, False), (1.0, 100, 300, 900): (False, False),
        (1.0, 100, 300, 2700): (True, False), (1.0, 100, 900, 2700): (True, False),
        (1.0, 300, 900, 2700): (True, False),
    }  # fmt: skip
    found = {key: (bool(row[BY_LUMPS]), bool(row[BY_BOTH])) for key, row in choices.iterrows()}
    assert found == expected
    assert not choices.loc[(0.1, 300, 900, 2700), ["C1", "C2", "C5"]].any()
    assert choices.loc[(1.0, 100, 300, 900), ["C1", "C2", "C4", "C5"]].all() and not choices.loc[1.0, "C4-loose"].any()


def test_a_choice_without_a_run_is_left_out(mapped, claims):
    """Also where a claim is lost without it: else those that are known would be those that lose claims."""
    missing = without(mapped, "pending", "never run", floor="L", arm="unsintered", pressure=300.0)
    choices = judge_choices(claims, missing.table, PLACE).query("floor == 'L'")
    is_known = (choices[["low", "middle", "high"]] != 300).all(axis=1)
    assert choices[BY_LUMPS].notna().tolist() == is_known.tolist() and is_known.sum() == 2
    assert choices["C1"].notna().all()  # sintered snow alone
    shares = share_choices(missing, choices, BY_LUMPS)
    assert shares.loc["L", 1.0].dropna().to_dict() == {100: 1.0, 900: 1.0, 2700: 1.0}
    shares = share_choices(mapped, judge_choices(claims, mapped.table, PLACE), BY_LUMPS)
    assert shares.loc["L", 0.1].round(3).tolist() == [0.667, 0.667, 0.333, 0.333]


def test_the_table_and_the_verdict_are_made_of_the_numbers(mapped, claims):
    missing = without(mapped, "failed", "out of memory", floor="triangle", arm="sintered", pressure=2700.0)
    choices = judge_choices(claims, missing.table, PLACE)
    rows = tabulate_rows(missing, choices, list_judged(claims)).set_index(["floor", "impact number"])
    assert rows.loc[("L", "1")].tolist() == [
        "900 to 2700", "above 2700", "3 of 4", "0 of 4", "C2-loose, C4-loose"
    ]  # fmt: skip
    assert rows.loc[("triangle", "1")].tolist()[:4] == ["above 900", "above 2700", "0 of 1", "0 of 1"]
    assert write_verdict(missing, choices, 1.0) == (
        "With three pressures chosen at each impact number, all claims can hold by lumps on L at 2 of 2 (0.1 and 1, "
        "with the default's) and on triangle at 1 of 2 (0.1, without the default's); by loose snow too on L at 1 of 2 "
        "(0.1, without the default's) and on triangle at 1 of 2 (0.1, without the default's). 30 of 32 runs have a "
        "result."
    )


@pytest.mark.slow
def test_the_pictures_are_drawn_whatever_is_missing(mapped, claims, tmp_path):
    """Failed and missing runs, an arm without any result; a single floor, impact number and pressure."""
    gaps = without(mapped, "failed", "out of memory", pressure=2700.0)
    gaps = without(gaps, "pending", "never run", floor="L", arm="unsintered")
    single = ImpactMap(mapped.table.query("impact_number == 1 and pressure == 300 and floor == 'L'"))
    readings = place_readings([300.0, 900.0])
    for name, shown in (("gaps", gaps), ("single", single)):
        choices = judge_choices(claims, shown.table, PLACE)
        draw_map(shown, readings, tmp_path / f"{name}.png")
        draw_region(shown, choices, readings, tmp_path / f"{name}-region.png")
        assert {path.stat().st_size > 10_000 for path in tmp_path.glob(f"{name}*.png")} == {True}
    assert choices.empty and tabulate_rows(single, choices, list_judged(claims)).empty
    assert "by lumps on L at no impact number, as no choice is known" in write_verdict(single, choices, 1.0)


def test_readings_lie_where_their_numbers_are():
    """Worked out by hand: rho g H / E0 with 100 kg cell^-3, and P / E0."""
    placed = place_readings([1400.0]).set_index("reading")
    expected = [100 * 10 * 60 / E0, 100 * 9.8 * 60 * 0.02 / E0, 100 * 20 * 60 / E0, 100 * 1000 / E0, 100 * 2000 / E0]
    assert placed.index.tolist() == list(READINGS)
    assert placed[IMPACT].tolist() == pytest.approx(expected) and set(placed[PRESS]) == {0.01}


def test_the_experiment_varies_inputs_of_the_kernels_only():
    """So many of its runs can go at once: what is compiled is the same in each arm, and frames follow the fall."""
    runs = make_plan(["experiment=map"], multirun=True).runs
    assert len({run.id for run in runs}) == 256 and {run.case.seed for run in runs} == {0}
    assert len({make_constants(run.case) for run in runs if run.case.arm == "sintered"}) == 1
    frames = {run.case.reading.gravity: run.case.frames for run in runs}
    assert (min(frames), frames[0.196], frames[10], frames[40]) == (0.196, 3672, 600, 350)
    assert Run(compose(["pressure=2900", "fidelity=preview"])).id in {run.id for run in runs}  # one of Figure 5, coarse
