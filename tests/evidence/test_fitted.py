"""Readings with pressures of their own: what each keeps of the paper, from rows whose answer is known."""

import numpy as np
import pandas as pd
import pytest

from snowrepro.composition.compose import compose
from snowrepro.evidence.fitted import DEFINITIONS, READING, FittedReading, Fitting, fit_table, group_sentences
from snowrepro.report.figures.fitted import draw_readings, write_verdict
from snowrepro.sweep.plan import make_plan

PRESSURES = (100.0, 200.0, 450.0, 740.0)
CLAIMS = compose(()).question.claims
RISING, FLAT = (0.1, 0.3, 0.6, 0.9), (0.1, 0.1, 0.1, 0.1)


def build_rows(reading: int, lumps: tuple[float, ...], loose: float, bonds: float = 0.0) -> list[dict]:
    """Rows of both arms; ``loose``: part of what is in no lump.  By bonds lumps are ``bonds`` at each pressure."""
    rows = []
    for arm in ("sintered", "unsintered"):
        for pressure, sintered in zip(PRESSURES, lumps, strict=True):
            mass = sintered if arm == "sintered" else 0.0
            others = dict.fromkeys(DEFINITIONS.values(), bonds if arm == "sintered" else 0.0)
            rows.append(
                {READING: reading, "arm": arm, "pressure": pressure, "seed": 0, "state": "done", **others}
                | {"lump_fraction": mass, "loose_fraction": (1 - mass) * loose}
            )
    return rows


def fit(*readings: list[dict]) -> Fitting:
    changes = [{}, *({"reading.friction": float(number)} for number in range(1, len(readings)))]
    return fit_table(CLAIMS, pd.DataFrame([row for rows in readings for row in rows]), changes)


def fit_one(lumps: tuple[float, ...], loose: float) -> FittedReading:
    return fit(build_rows(0, lumps, loose)).readings[0]


def test_the_paper_has_five_sentences_and_two_of_them_are_read_in_two_ways():
    assert [[claim.name for claim in group] for group in group_sentences(CLAIMS)] == [
        ["C1"], ["C2", "C2-loose"], ["C3"], ["C4", "C4-loose"], ["C5"]
    ]  # fmt: skip


def test_a_reading_whose_powder_comes_loose_keeps_all():
    """Each of the four threes begins below one half and ends above it."""
    reading = fit_one(RISING, 1.0)
    assert reading.kept == 5 and reading.known == 4 and not reading.never
    assert reading.best == (100.0, 200.0, 450.0) and reading.reach == 4
    assert (reading.half.low, reading.half.high) == (200.0, 450.0)


def test_crushed_snow_is_no_powder():
    """What is in no lump, and lies where it was, loses both sentences on powder; those on lumps stay."""
    reading = fit_one(RISING, 0.2)
    assert reading.kept == 3 and set(reading.never) == {"C2-loose", "C4-loose"}


def test_lumps_that_do_not_grow_keep_what_is_said_of_powder_alone():
    reading = fit_one(FLAT, 1.0)
    assert reading.kept == 2 and set(reading.never) == {"C1", "C3", "C5"}


def test_the_rule_goes_by_sentences_then_definitions_then_threes():
    """And the base stands first among equals."""
    worse, same = build_rows(1, FLAT, 1.0), build_rows(2, RISING, 1.0)
    better = fit(build_rows(0, FLAT, 1.0), worse, same)
    assert better.rank()[0] is better.readings[2] and better.rank()[1] is better.readings[0]
    grows = build_rows(1, RISING, 1.0)
    for row in grows:
        row["lumps_by_bonds"] = row["lump_fraction"]
    defined = fit(build_rows(0, RISING, 1.0), grows)
    assert defined.readings[1].definitions == ("strain", "bonds") and defined.rank()[0] is defined.readings[1]
    late = fit(build_rows(0, (0.1, 0.2, 0.3, 0.9), 1.0), build_rows(1, RISING, 1.0))
    assert late.readings[0].kept == late.readings[1].kept and late.rank()[0].share == max(
        each.share for each in late.readings
    )


def test_how_far_a_reading_moves_lumps_is_a_mean_over_pressures():
    """Without sign; of those at which it has a result."""
    gaps = build_rows(2, RISING, 1.0)
    for row in gaps:
        row["lump_fraction"] = np.nan if row["pressure"] > 100 else 0.3
    moves = fit(build_rows(0, RISING, 1.0), build_rows(1, FLAT, 1.0), gaps).measure_moves()
    assert moves.tolist() == pytest.approx([0.0, (0.2 + 0.5 + 0.8) / 4, 0.2])


def test_a_reading_without_all_runs_is_not_ranked():
    rows = build_rows(1, RISING, 1.0)
    for row in rows[1:]:
        row["lump_fraction"] = row["loose_fraction"] = np.nan
    fitting = fit(build_rows(0, RISING, 1.0), rows)
    assert [reading.known for reading in fitting.readings] == [4, 0] and fitting.rank() == [fitting.readings[0]]


@pytest.mark.parametrize(
    ("loose", "words"),
    [
        (1.0, "2 of 2 readings keep all 5 sentences of the paper: 'as in Figure 5' and"),
        (0.2, "No reading keeps all 5 sentences of the paper, with whichever three pressures; all 2 keep 3: 'as"),
    ],
)
def test_the_verdict_says_whether_any_reading_keeps_all(loose, words, tmp_path):
    fitting = fit(build_rows(0, RISING, loose), build_rows(1, RISING, loose))
    assert write_verdict(fitting).startswith(words) and "The rule chooses the base" in write_verdict(fitting)
    assert ("C2-loose and C4-loose hold under no reading" in write_verdict(fitting)) == (loose < 1)
    draw_readings(fitting, tmp_path / "fitted.png")
    assert (tmp_path / "fitted.png").stat().st_size > 10_000


def test_the_experiment_has_each_reading_of_its_study_and_places_of_the_fall():
    """No seeds; all changes have words."""
    names = {dict(text.split("=", 1) for text in planned.overrides)["variant"] for planned in plan("fitted")}
    studied = {dict(text.split("=", 1) for text in planned.overrides)["variant"] for planned in plan("readings")}
    assert names - studied == {"drop_x_60", "drop_x_40"}
    assert studied - names == {f"seed_{number}" for number in range(1, 5)}


def plan(experiment: str) -> list:
    return make_plan([f"experiment={experiment}"], multirun=False).planned
