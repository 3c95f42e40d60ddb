"""Verdicts, their statistics and calibration on tables whose answer is known."""

from collections.abc import Sequence
from functools import cache
from typing import get_args

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy import stats

from snowrepro.analysis.statistics import Estimate, estimate_mean
from snowrepro.composition.compose import compose
from snowrepro.evidence import claims
from snowrepro.evidence.calibration import Crossing, bracket_half, calibrate_pressures, fit_rising_curve
from snowrepro.evidence.claims import CONTRADICTED, INCONCLUSIVE, NOT_RUN, REPRODUCED, JudgedScene, Verdict
from snowrepro.evidence.scenes import judge_scenes
from snowrepro.settings.case import ARMS
from snowrepro.settings.question import Claim, Claims, Measure
from snowrepro.summary.row import ARM, summarise

PAPER = compose().question.claims
PRESSURES = (340.0, 530.0, 3300.0)
LIKE_THE_PAPER = [[0.20, 0.52, 0.80], [0.22, 0.50, 0.78], [0.21, 0.54, 0.79]]
POWDER = [[0.0, 0.0, 0.0]] * 3


def table(sintered: Sequence, unsintered: Sequence, pressures: Sequence[float] = PRESSURES) -> pd.DataFrame:
    """A row a run from lumps by seed and pressure, all else is loose; None: there is no such run."""
    rows = [
        (arm, pressure, seed, value)
        for arm, block in zip(ARMS, (sintered, unsintered), strict=True)
        for seed, values in enumerate(block)
        for pressure, value in zip(pressures, values, strict=False)
        if value is not None
    ]
    frame = pd.DataFrame(rows, columns=[ARM, "pressure", "seed", "lump_fraction"])
    return frame.assign(loose_fraction=1 - frame["lump_fraction"])


def judged(sintered: Sequence, unsintered: Sequence = POWDER, **options) -> dict[str, Verdict]:
    return {v.claim: v for v in claims.judge_claims(PAPER, table(sintered, unsintered), **options)}


def words(*blocks: Sequence, **options) -> dict[str, str]:
    return {name: verdict.word for name, verdict in judged(*blocks, **options).items()}


# Statistics


def test_the_interval_is_students():
    """Each end alone leaves the mean out with a chance of alpha."""
    got = estimate_mean(np.array([0.1, 0.2, 0.3]), 0.05)
    half = 2.919985580353726 * 0.1 / np.sqrt(3)  # t(0.95, 2)
    assert (got.mean, got.low, got.high) == pytest.approx((0.2, 0.2 - half, 0.2 + half))
    assert estimate_mean(np.array([0.1]), 0.05).low is None
    assert estimate_mean(np.zeros(2), 0.05) == Estimate(0.0, 0.0, 0.0, 2)


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(0, 1), min_size=2, max_size=5), st.sampled_from([0.1, 0.5, 0.9]))
def test_limits_cut_an_interval_and_change_no_decision(values, threshold):
    free, cut = (estimate_mean(np.array(values), 0.05, limits) for limits in ((-np.inf, np.inf), (0.0, 1.0)))
    assert 0.0 <= cut.low <= cut.mean <= cut.high <= 1.0
    assert (cut.is_above(threshold), cut.is_below(threshold)) == (free.is_above(threshold), free.is_below(threshold))


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ([0.0, 0.0, 0.0], "none in 3 seeds"),
        ([0.25, 0.25], "0.25 in all 2 seeds"),
        ([0.9], "0.90"),
        ([0.1, 0.2, 0.3], "0.20 [0.03, 0.37]"),
        ([0.9, 0.99, 0.95], "0.95 [0.87, 1.00]"),
    ],
)
def test_an_interval_says_what_it_knows(values, text):
    """Equal values have no spread, and their interval is not drawn as one."""
    assert claims.format_interval(estimate_mean(np.array(values), 0.05, (0.0, 1.0))) == text


# One scene


def test_what_the_paper_claims_is_reproduced():
    verdicts = judged(LIKE_THE_PAPER)
    assert {v.word for v in verdicts.values()} == {REPRODUCED}
    assert (verdicts["C1"].effect.mean, verdicts["C1"].effect_of) == (pytest.approx(0.27), "530 to 3300")
    assert verdicts["C1"].margin == pytest.approx(0.27)
    assert verdicts["C1"].seeds == 3
    assert not any(v.calibrated or v.disagrees or v.note for v in verdicts.values())
    assert all(v.agrees for v in verdicts.values())


def test_equal_values_are_decided():
    """Exactly 0.00 in two seeds is below one half, and says so without an interval."""
    c4 = judged(LIKE_THE_PAPER[:2], POWDER[:2])["C4"]
    assert (c4.word, c4.effect_text) == (REPRODUCED, "none in 2 seeds, at 340")
    assert words(LIKE_THE_PAPER, [[0.5] * 3] * 3)["C4"] == INCONCLUSIVE  # half and half is neither
    assert words(POWDER)["C1"] == INCONCLUSIVE  # nothing rises and nothing falls
    assert words(POWDER)["C3"] == CONTRADICTED


@pytest.mark.parametrize(
    ("sintered", "unsintered", "claim", "against"),
    [
        ([[0.8, 0.5, 0.2], [0.82, 0.51, 0.19], [0.81, 0.5, 0.2]], POWDER, "C1", ["340 to 530", "530 to 3300"]),
        ([[0.3, 0.2, 0.9], [0.31, 0.2, 0.91], [0.3, 0.21, 0.9]], POWDER, "C1", ["340 to 530"]),  # rises over all
        ([[0.6, 0.7, 0.9], [0.61, 0.7, 0.9], [0.6, 0.71, 0.9]], POWDER, "C2", ["340"]),
        ([[0.2, 0.3, 0.4], [0.2, 0.31, 0.4], [0.21, 0.3, 0.4]], POWDER, "C3", ["3300"]),
        (LIKE_THE_PAPER, [[0.0, 0.8, 0.1], [0.0, 0.81, 0.1], [0.0, 0.8, 0.12]], "C4", ["530"]),
        (LIKE_THE_PAPER, [[0.0, 0.1, 0.9], [0.0, 0.1, 0.91], [0.0, 0.11, 0.9]], "C5", ["530 to 3300"]),
    ],
)
def test_each_claim_can_be_contradicted(sintered, unsintered, claim, against):
    """Also where the pressures were calibrated; the pressures or steps that are against it are named."""
    verdict = judged(sintered, unsintered)[claim]
    assert verdict.word == CONTRADICTED
    assert verdict.agrees is False
    assert [part.where for part in verdict.parts if not part.agrees] == against
    assert all(told.startswith(where) for told, where in zip(verdict.disagrees, against, strict=True))
    assert words(sintered, unsintered, calibrated=True)[claim] == CONTRADICTED
    said = claims.write_sentence(table(sintered, unsintered), list(judged(sintered, unsintered).values()))
    assert claim in said.split("contradicted: ")[1].split(";")[0]


def test_what_may_be_chance_is_inconclusive():
    """A rise that two of three seeds have; a mean whose interval holds 1/2: whichever way they point."""
    verdicts = judged([[0.45, 0.5, 0.6], [0.2, 0.4, 0.3], [0.48, 0.4, 0.7]])
    assert {verdicts[c].word for c in ("C1", "C2", "C3")} == {INCONCLUSIVE}
    assert verdicts["C2"].agrees and verdicts["C3"].agrees
    assert verdicts["C3"].note == "open: 3300; the numbers agree"


def test_bonferroni_for_what_is_against_the_claim():
    """One of three pressures above 1/2 with a chance of alpha / 3 to be wrong, not of alpha."""
    middle = np.array([0.55, 0.60, 0.65])
    low = middle.mean() - stats.t.ppf(1 - 0.05, 2) * stats.sem(middle)
    near = middle - low + 0.501  # just above by the usual interval
    c4 = judged(LIKE_THE_PAPER, [[0.0, value, 0.0] for value in near])["C4"]
    assert c4.word == INCONCLUSIVE
    assert c4.effect.low == pytest.approx(0.501)
    assert c4.effect_of == "at 530"
    lower = middle.mean() - stats.t.ppf(1 - 0.05 / 3, 2) * stats.sem(middle)
    assert words(LIKE_THE_PAPER, [[0.0, value, 0.0] for value in middle - lower + 0.501])["C4"] == CONTRADICTED


def test_one_seed_decides_nothing():
    """It says which way the numbers point."""
    verdicts = judged(LIKE_THE_PAPER[:1], POWDER[:1])
    assert {v.word for v in verdicts.values()} == {INCONCLUSIVE}
    assert {v.note for v in verdicts.values()} == {"one seed decides nothing; the numbers agree"}
    assert all(v.agrees and v.effect.low is None for v in verdicts.values())
    against = judged([[0.9, 0.5, 0.2]], POWDER[:1])["C1"]
    assert (against.word, against.agrees) == (INCONCLUSIVE, False)
    assert against.note.endswith("the numbers disagree")
    said = claims.write_sentence(table([[0.9, 0.5, 0.2]], POWDER[:1]), [against, verdicts["C4"]])
    assert "one seed decides nothing, the numbers disagree with: C1" in said
    assert "the numbers agree with: C4" in said


def test_calibration_stands_beside_the_word():
    """What the pressures were chosen by is no test; unsintered snow is never chosen by."""
    verdicts = judged(LIKE_THE_PAPER, calibrated=True)
    assert {v.word for v in verdicts.values()} == {REPRODUCED}
    assert [c for c, v in verdicts.items() if v.calibrated] == ["C1", "C2", "C3", "C5"]
    assert verdicts["C1"].label == "REPRODUCED (by calibration, no test)"
    assert verdicts["C4"].label == "REPRODUCED"
    said = claims.write_sentence(table(LIKE_THE_PAPER, POWDER), list(verdicts.values()))
    assert "reproduced (by calibration, no test): C1, C2, C3;" in said
    assert "reproduced: C2-loose, C4, C4-loose" in said
    assert said.endswith("the same numbers as C1: C5.")


def test_missing_arms_are_not_run():
    """A claim without runs has no verdict; an empty table has none at all; one pressure has no order."""
    only = judged(LIKE_THE_PAPER, [])
    assert [c for c, v in only.items() if v.word == NOT_RUN] == ["C4", "C4-loose", "C5"]
    assert "without" not in claims.write_sentence(table(LIKE_THE_PAPER, []), list(only.values()))
    assert {v.word for v in claims.judge_claims(PAPER, pd.DataFrame())} == {NOT_RUN}
    one = {v.claim: v for v in claims.judge_claims(PAPER, table([[0.2]] * 3, [[0.0]] * 3))}
    assert one["C1"].word == one["C5"].word == NOT_RUN
    assert one["C2"].word == one["C4"].word == REPRODUCED


def test_a_missing_run_is_not_stood_in_for():
    """Without the lowest pressure the next one is not the lowest; claims that do not need it are judged."""
    block = [[None, 0.4, 0.8], [None, 0.41, 0.8], [None, 0.4, 0.81]]
    verdicts = judged(block, missing=[("sintered", 340.0)])
    assert {verdicts[c].word for c in ("C1", "C2", "C5")} == {NOT_RUN}
    assert verdicts["C3"].word == verdicts["C4"].word == REPRODUCED
    assert verdicts["C2"].note == "no result at 340"


def test_one_seed_of_a_pressure_missing_is_not_run():
    """Two seeds do not stand in for the third that was asked for."""
    block = [[0.2, 0.52, 0.8], [0.22, 0.5, 0.78], [0.21, None, 0.79]]
    verdicts = judged(block, missing=[("sintered", 530.0)])
    assert [c for c, v in verdicts.items() if v.word == NOT_RUN] == ["C1", "C5"]


def test_seeds_that_were_not_asked_for_everywhere_are_left_out():
    block = [*LIKE_THE_PAPER, [0.9, 0.1, None]]
    verdicts = judged(block)
    assert verdicts["C1"].seeds == 3
    assert verdicts["C1"].note == "seeds without every pressure are left out: 3"
    assert verdicts["C1"].word == REPRODUCED
    assert verdicts["C5"].seeds == 3  # unsintered runs have three seeds


def test_contrast_is_taken_seed_by_seed():
    """Seeds that differ much, alike in both arms, do not hide what sintering adds."""
    shift = np.array([[0.0], [0.2], [0.1]])
    sintered, loose = np.array([[0.1, 0.2, 0.3]] * 3) + shift, np.array([[0.0, 0.0, 0.0]] * 3) + shift
    c5 = judged(sintered.tolist(), loose.tolist())["C5"]
    assert c5.word == REPRODUCED
    assert c5.effect.is_of_equals


# Numbers without rounding, so that equal means are equal.
VALUES = st.integers(0, 1024).map(lambda n: n / 1024)
BLOCKS = st.integers(1, 4).flatmap(
    lambda seeds: st.lists(st.lists(VALUES, min_size=3, max_size=3), min_size=seeds, max_size=seeds)
)


@settings(deadline=None, max_examples=15)
@given(sintered=BLOCKS, order=st.randoms(use_true_random=False))
def test_the_order_of_seeds_and_rows_does_not_matter(sintered, order):
    loose = [[0.0, 0.25, 0.25]] * len(sintered)
    expected = judged(sintered, loose)
    frame = table(sintered, loose)
    names = list(range(len(sintered)))
    order.shuffle(names)
    frame["seed"] = frame["seed"].map(dict(enumerate(names)))
    rows = list(frame.index)
    order.shuffle(rows)
    for verdict in claims.judge_claims(PAPER, frame.loc[rows]):
        was = expected[verdict.claim]
        assert (verdict.word, verdict.agrees, verdict.same_as) == (was.word, was.agrees, was.same_as)
        assert verdict.effect.mean == pytest.approx(was.effect.mean)


@settings(deadline=None, max_examples=15)
@given(sintered=BLOCKS, shift=st.integers(-2048, 2048).map(lambda n: n / 1024))
def test_a_constant_does_not_change_what_rises(sintered, shift):
    moved = [[value + shift for value in values] for values in sintered]
    one, other = judged(sintered)["C1"], judged(moved)["C1"]
    assert (one.word, one.agrees, one.margin) == (other.word, other.agrees, other.margin)


STEPS = st.floats(0.01, 0.5)


@settings(deadline=None, max_examples=20)
@given(st.lists(st.lists(STEPS, min_size=4, max_size=4), min_size=2, max_size=5), st.integers(0, 3), st.floats(-0.5, 0))
def test_a_flat_or_falling_step_is_never_a_rise(steps, place, fall):
    """Whatever the other steps are, and by the mean of the seeds alone; if it falls alike in all, it is certain."""
    changed = np.array(steps)
    changed[:, place] += fall - changed[:, place].mean()
    frame = table(np.cumsum(np.c_[np.zeros(len(steps)), changed], axis=1).tolist(), [], pressures=range(5))
    rise = claims.judge_claims(PAPER, frame)[0]
    assert rise.word != REPRODUCED
    changed[:, place] = fall
    frame = table(np.cumsum(np.c_[np.zeros(len(steps)), changed], axis=1).tolist(), [], pressures=range(5))
    assert claims.judge_claims(PAPER, frame)[0].word == (CONTRADICTED if fall < -1e-9 else INCONCLUSIVE)


@settings(deadline=None, max_examples=15)
@given(sintered=BLOCKS, value=VALUES)
def test_the_rise_of_the_contrast_is_that_of_sintered_snow_where_the_other_is_constant(sintered, value):
    """It has the same word and numbers, and says which claim it repeats; where the other snow changes, it does not."""
    verdicts = judged(sintered, [[value] * 3] * len(sintered))
    assert verdicts["C5"].same_as == "C1"
    assert verdicts["C5"].word == verdicts["C1"].word
    assert verdicts["C5"].margin == verdicts["C1"].margin
    assert not judged(sintered, [[value, value, value + 0.001]] * len(sintered))["C5"].same_as
    assert not judged(sintered, [])["C5"].same_as


@settings(deadline=None, max_examples=30)
@given(st.lists(st.floats(0, 1).map(lambda value: round(value, 2)), min_size=6, max_size=6))
def test_many_at_once_point_where_one_points(values):
    """``check_agreement`` of a row is ``Verdict.agrees`` of a table with the same numbers."""
    names = [(arm, p) for arm in ARMS for p in PRESSURES]
    one = pd.DataFrame(names, columns=[ARM, "pressure"]).assign(seed=0, lump_fraction=values)
    means = pd.DataFrame([values], columns=pd.MultiIndex.from_tuples(names))
    verdicts = {v.claim: v.agrees for v in claims.judge_claims(PAPER, one)}
    for claim in PAPER.list:
        if claim.test != "scenes" and claim.measure == "lump_fraction":
            assert bool(claims.check_agreement(claim, means).iloc[0]) == verdicts[claim.name], claim.name


# Other readings of powder


def test_loose_snow_is_judged_by_its_own_column():
    """What is crushed in one piece is in no lump and not loose: one reading holds, the other does not."""
    frame = table(LIKE_THE_PAPER, POWDER).assign(crushed_fraction=0.9, loose_fraction=0.1, flattening_end=0.76)
    verdicts = {v.claim: v for v in claims.judge_claims(PAPER, frame)}
    assert (verdicts["C4"].word, verdicts["C4-loose"].word) == (REPRODUCED, CONTRADICTED)
    assert verdicts["C4"].beside == "crushed 0.90, 0.90, 0.90; height lost 0.76, 0.76, 0.76"
    assert verdicts["C2"].beside == "crushed 0.90; height lost 0.76"
    assert verdicts["C5"].beside == ""
    said = claims.write_sentence(frame, list(verdicts.values()))
    assert "without sintering the mass in lumps is 0.00, 0.00, 0.00 (crushed 0.90, 0.90, 0.90; loose 0.10, " in said


def test_a_measure_that_the_runs_lack_is_not_run():
    frame = table(LIKE_THE_PAPER, POWDER).drop(columns="loose_fraction")
    verdicts = {v.claim: v for v in claims.judge_claims(PAPER, frame)}
    assert [name for name, verdict in verdicts.items() if verdict.word == NOT_RUN] == ["C2-loose", "C4-loose"]
    assert verdicts["C4-loose"].agrees is None


# Over scenes

GOOD, LOST = LIKE_THE_PAPER, [[0.6, 0.7, 0.9], [0.62, 0.7, 0.9], [0.61, 0.71, 0.9]]  # LOST: C2 fails


def move(block: Sequence, *shifts: float) -> list:
    """Add to the values at each pressure."""
    return np.add(block, shifts).tolist()


@cache
def judge_block(block: tuple, seeds: int, calibrated: bool) -> tuple[pd.DataFrame, list[Verdict]]:
    frame = table(block[:seeds], POWDER[:seeds])
    return frame, claims.judge_claims(PAPER, frame, calibrated=calibrated)


def make_scene(shape: str, number: int, block: Sequence, seeds: int, calibrated: bool = False) -> JudgedScene:
    frame, verdicts = judge_block(tuple(map(tuple, block)), seeds, calibrated)
    return JudgedScene(shape, f"floor{number}", frame, calibrated, verdicts)


def make_scenes(against: dict[str, int], floors: int = 3, seeds: int = 1) -> list[JudgedScene]:
    """The calibrated scene, and ``floors`` scenes of each shape, of which the number given disagrees with C2 alone."""
    others = move(GOOD, 0.05, 0.05, -0.05)  # not the calibrated scene again
    found = [make_scene("ball", 99, GOOD, seeds, calibrated=True)]
    for shape, bad in against.items():
        found += [make_scene(shape, i, LOST if i < bad else others, seeds) for i in range(floors)]
    return found


def over(found: Sequence[JudgedScene], paper: Claims = PAPER) -> Verdict:
    return next(verdict for verdict in judge_scenes(paper, found) if verdict.claim == "C6")


def test_scenes_are_counted_by_shape():
    """One scene of three against C2 loses no shape, two do; the margins are there, and C5 counts once, as C1."""
    c6 = over(make_scenes({"ball": 0, "star": 1, "triangle": 0, "rectangle": 0}))
    assert (c6.word, c6.agrees) == (REPRODUCED, True)
    assert [count.claim for count in c6.counts] == ["C1", "C2", "C3", "C4"]
    assert "C2 on 4 of 4 shapes (11 of 12 scenes)" in c6.measured
    assert "C5: the same numbers as another claim in every scene" in c6.note
    star = c6.counts[1].by_shape[1]
    assert (star.shape, star.agree, star.scenes) == ("star", 2, 3)
    assert (star.least, star.most) == pytest.approx((-0.1, 0.25))
    lost = over(make_scenes({"ball": 0, "star": 2, "triangle": 0, "rectangle": 0}))
    assert (lost.word, lost.agrees) == (INCONCLUSIVE, False)
    assert lost.disagrees == ("C2: star (1 of 3)",)
    none = over(make_scenes({"ball": 2, "star": 2, "triangle": 3, "rectangle": 3}))
    assert (none.word, none.agrees) == (CONTRADICTED, False)


def test_few_shapes_decide_nothing():
    """However many scenes there are of them."""
    c6 = over(make_scenes({"ball": 0, "star": 0, "triangle": 0}, floors=9))
    assert (c6.word, c6.agrees) == (INCONCLUSIVE, True)
    assert c6.note.startswith("3 shapes decide nothing, 4 are needed.")


@pytest.mark.parametrize(("shift", "is_same"), [(0.0, True), (0.015, True), (0.04, False)])
def test_scenes_that_are_the_calibrated_one_again_are_left_out(shift, is_same):
    found = make_scenes({"ball": 0, "star": 0, "triangle": 0, "rectangle": 0})
    found.append(make_scene("ball", 7, move(GOOD, 0.0, shift, 0.0), 1))
    c6 = over(found)
    assert c6.left_out == (("ball on floor7",) if is_same else ())
    assert ("ball on floor7" in c6.note) == is_same
    assert c6.counts[0].by_shape[0].scenes == (3 if is_same else 4)


def test_seeds_say_how_far_the_same_scene_may_differ():
    """By 0.05 at one pressure, where its own seeds differ by as much."""
    wide = [[0.15, 0.5, 0.8], [0.2, 0.5, 0.8], [0.25, 0.5, 0.8]]
    found = make_scenes({"star": 0, "triangle": 0, "rectangle": 0, "ball": 0}, seeds=3)
    found[0] = make_scene("ball", 99, wide, 3, calibrated=True)
    found += [
        make_scene("ball", 7, move(wide, 0.05, 0.0, 0.0), 3),
        make_scene("ball", 8, move(wide, 0.0, 0.0, 0.05), 3),
    ]
    assert over(found).left_out == ("ball on floor7",)


@settings(deadline=None, max_examples=10)
@given(st.randoms(use_true_random=False), st.lists(st.integers(0, 3), min_size=4, max_size=4))
def test_the_order_of_scenes_does_not_matter(order, against):
    found = make_scenes(dict(zip(("ball", "star", "triangle", "rectangle"), against, strict=True)))
    expected = over(found)
    order.shuffle(found)
    c6 = over(found)
    assert (c6.word, c6.agrees, c6.measured) == (expected.word, expected.agrees, expected.measured)
    assert {frozenset(count.by_shape) for count in c6.counts} == {
        frozenset(count.by_shape) for count in expected.counts
    }


def test_other_scenes_need_runs():
    """The calibrated scene and one other are no statement of others; nor are scenes with missing runs."""
    assert over(make_scenes({"star": 0}, floors=1)).word == NOT_RUN
    found = make_scenes({"ball": 0, "star": 0, "triangle": 0, "rectangle": 0})
    frame = found[3].table[lambda t: t["pressure"] < 3000]
    lost = [("sintered", PRESSURES[2])]
    found[3] = JudgedScene("ball", "floor2", frame, False, claims.judge_claims(PAPER, frame, missing=lost))
    c6 = over(found)
    assert (c6.word, c6.note) == (NOT_RUN, "Not all runs are there on ball on floor2.")
    assert "C1 on 4 of 4 shapes (11 of 11 scenes), C2 on 4 of 4 shapes (12 of 12 scenes)" in c6.measured


# Curves


def test_calibration_reads_the_rising_fit():
    """On a straight line in log pressure the crossings are exact; a dip is levelled; out of reach is None."""
    line = pd.DataFrame({ARM: "sintered", "pressure": [10.0, 100.0, 1000.0], "lump_fraction": [0.0, 0.5, 1.0]})
    assert calibrate_pressures(line, [0.25, 0.5, 0.75]) == [32.0, 100.0, 320.0]
    dip = pd.DataFrame({ARM: "sintered", "pressure": [1.0, 2.0, 4.0, 8.0], "lump_fraction": [0.1, 0.5, 0.3, 0.7]})
    assert calibrate_pressures(dip, [0.4]) == [2.0]
    assert calibrate_pressures(dip, [0.05, 0.9]) == [None, None]
    assert list(fit_rising_curve(pd.Series([0.5, 0.2, 0.4], [0.0, 1.0, 2.0]))) == [
        0.2,
        0.4,
    ]  # pressure 0 is on no log axis


def blocks(values: Sequence, pressures: Sequence[float] = (10.0, 100.0, 1000.0)) -> pd.DataFrame:
    return pd.DataFrame(values, columns=pressures, dtype=float)


@pytest.mark.parametrize(
    ("values", "low", "high"),
    [
        ([[0.4, 0.6, 0.9]] * 3, 10, 100),
        ([[0.4, 0.6, 0.9]], 10, 100),
        ([[0.4, 0.6, 0.9], [0.3, 0.45, 0.9]], 10, 1000),  # one seed crosses later
        ([[0.4, 0.5, 0.9]], 10, 1000),  # one half itself is on no side
        ([[0.6, 0.7, 0.8]], None, 10),
        ([[0.1, 0.2, 0.3]], 1000, None),
        ([[0.7, 0.8, 0.9], [0.2, 0.6, 0.9]], None, 100),
        ([[0.1, 0.6, 0.4]], 10, None),  # crosses, and falls back
    ],
)
def test_half_is_bracketed_by_pressures_that_were_run(values, low, high):
    assert bracket_half(blocks(values)) == Crossing(low, high, len(values))


def test_half_is_not_bracketed_where_seeds_disagree_everywhere():
    assert bracket_half(blocks([[0.1, 0.2, 0.3], [0.7, 0.8, 0.9]])).note.startswith("not bracketed")
    assert bracket_half(blocks([])).note == "no runs"


@settings(deadline=None, max_examples=60)
@given(BLOCKS, st.randoms(use_true_random=False))
def test_a_bracket_holds_the_crossing_of_every_seed(values, order):
    """All seeds are below one half up to its lower end, above it from its upper end on; seeds have no order."""
    frame = blocks(values)
    got = bracket_half(frame)
    order.shuffle(values)
    assert bracket_half(blocks(values)) == got
    assert got.low is None or (frame.loc[:, : got.low] < 0.5).all(axis=None)
    assert got.high is None or (frame.loc[:, got.high :] > 0.5).all(axis=None)


def test_every_measure_is_a_number_in_the_summary(small_run):
    """A claim about another one is refused before any run, with the right names."""
    row = summarise(small_run)
    for name in get_args(Measure):
        assert isinstance(row[name], int | float) and not isinstance(row[name], bool), name
    claim = compose().question.claims.list[0].model_dump()
    with pytest.raises(ValidationError, match="'lump_fraction', 'crushed_fraction'"):
        Claim.model_validate({**claim, "measure": "lumpiness"})


def test_an_order_without_an_effect_is_inconclusive():
    """Every seed rises at every step; but by how much, the seeds do not agree."""
    verdict = judged([[0.0, 0.01, 0.02], [0.0, 0.01, 0.02], [0.0, 0.3, 0.9]], POWDER)["C1"]
    assert (verdict.word, verdict.agrees) == (INCONCLUSIVE, True)
    assert verdict.note == "open: 340 to 530, 530 to 3300; the numbers agree"
