"""Verdicts, their statistics and calibration on tables whose answer is known."""

from collections.abc import Sequence
from typing import get_args

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy import stats

from snowrepro.analysis.statistics import adjust_by_holm, estimate_kendall_tau, estimate_mean, run_page_test
from snowrepro.composition.compose import compose
from snowrepro.evidence import claims
from snowrepro.evidence.calibration import BELOW, BEYOND, calibrate_pressures, find_half_pressure, fit_rising_curve
from snowrepro.evidence.claims import CONTRADICTED, INCONCLUSIVE, NOT_RUN, REPRODUCED, JudgedScene, Verdict
from snowrepro.settings.case import ARMS
from snowrepro.settings.question import Claim, Measure
from snowrepro.summary.row import ARM, summarise

PAPER = compose().question.claims
PRESSURES = (340.0, 530.0, 3300.0)
LIKE_THE_PAPER = [[0.20, 0.52, 0.80], [0.22, 0.50, 0.78], [0.21, 0.54, 0.79]]
POWDER = [[0.0, 0.0, 0.0]] * 3


def table(sintered: Sequence, unsintered: Sequence, pressures: Sequence[float] = PRESSURES) -> pd.DataFrame:
    """A row a run from values by seed and pressure; None: there is no such run."""
    rows = [
        (arm, pressure, seed, value)
        for arm, block in zip(ARMS, (sintered, unsintered), strict=True)
        for seed, values in enumerate(block)
        for pressure, value in zip(pressures, values, strict=False)
        if value is not None
    ]
    return pd.DataFrame(rows, columns=[ARM, "pressure", "seed", "lump_fraction"])


def judged(sintered: Sequence, unsintered: Sequence = POWDER, **options) -> dict[str, Verdict]:
    return {v.claim: v for v in claims.judge_claims(PAPER, table(sintered, unsintered), **options)}


def words(*blocks: Sequence, **options) -> dict[str, str]:
    return {name: verdict.word for name, verdict in judged(*blocks, **options).items()}


# Statistics


def test_page_knows_the_order():
    """Perfect order of 3 x 3: one of the 6^3 orders; of 3 x 5: of the 120^3; ties and the wrong order are no rise."""
    assert run_page_test(np.array([[1, 2, 3]] * 3)) == pytest.approx(1 / 216, rel=1e-9)
    assert run_page_test(np.array([[1, 2, 3, 4, 5]] * 3)) == pytest.approx(1 / 120**3, rel=1e-9)
    assert run_page_test(np.array([[1, 2, 3]] * 2)) == pytest.approx(1 / 36, rel=1e-9)
    # One neighbouring pair changed: 41 of at most 42, which 1 + 3 * 2 of the 216 orders reach.
    assert run_page_test(np.array([[1, 2, 3], [1, 2, 3], [2, 1, 3]])) == pytest.approx(7 / 216, rel=1e-9)
    assert run_page_test(np.array([[3, 2, 1]] * 3)) == 1.0
    assert run_page_test(np.zeros((3, 3))) > 0.5
    assert run_page_test(np.array([[1, 2, 3]])) is None
    assert run_page_test(np.array([[1], [2]])) is None


def test_page_at_two_places_is_the_sign_test():
    assert run_page_test(np.array([[0, 1]] * 5)) == pytest.approx(1 / 32)
    assert run_page_test(np.array([[0, 1], [0, 1], [1, 0]])) == pytest.approx(4 / 8)
    assert run_page_test(np.array([[1, 1]] * 5)) == 1.0


def test_the_interval_is_students():
    got = estimate_mean(np.array([0.1, 0.2, 0.3]), 0.05)
    half = 4.302652729911275 * 0.1 / np.sqrt(3)  # t(0.975, 2)
    assert (got.mean, got.low, got.high) == pytest.approx((0.2, 0.2 - half, 0.2 + half))
    assert estimate_mean(np.array([0.1]), 0.05).low is None
    assert estimate_mean(np.zeros(2), 0.05) == claims.Estimate(0.0, 0.0, 0.0)


def test_holm_by_hand():
    """The least times 3, the next times 2, never less than the one before, never above 1; in the given order."""
    np.testing.assert_allclose(adjust_by_holm(np.array([0.04, 0.01, 0.03])), [0.06, 0.03, 0.06])
    np.testing.assert_allclose(adjust_by_holm(np.array([0.6, 0.5])), [1.0, 1.0])


def test_tau_counts_pairs_within_a_seed():
    """Orders 1 2 3 and 2 1 3: taus 1 and 1/3; equal values have none."""
    assert estimate_kendall_tau(np.array([[1, 2, 3], [2, 1, 3]]), 0.05).mean == pytest.approx(2 / 3)
    assert estimate_kendall_tau(np.array([[1, 2, 3]] * 3), 0.05) == claims.Estimate(1.0, 1.0, 1.0)
    assert estimate_kendall_tau(np.zeros((2, 3)), 0.05).mean == 0.0
    one = estimate_kendall_tau(np.array([[1, 2, 3]]), 0.05)
    assert (one.mean, one.low) == (1.0, None)
    mixed = estimate_kendall_tau(np.array([[1, 2, 3], [2, 1, 3], [1, 2, 3], [3, 2, 1]]), 0.05)
    assert -1 <= mixed.low < mixed.mean < mixed.high <= 1


# One scene


def test_what_the_paper_claims_is_reproduced():
    verdicts = judged(LIKE_THE_PAPER)
    assert {v.word for v in verdicts.values()} == {REPRODUCED}
    assert verdicts["C1"].p == verdicts["C5"].p == pytest.approx(1 / 216)
    assert verdicts["C1"].effect.mean == pytest.approx(0.58)
    assert verdicts["C1"].tau.mean == 1.0
    assert verdicts["C1"].seeds == 3
    assert not any(v.calibrated or v.disagrees or v.note for v in verdicts.values())
    assert all(v.agrees for v in verdicts.values())


def test_equal_values_are_decided():
    """Exactly 0.00 in two seeds has an interval, of length 0."""
    c4 = judged(LIKE_THE_PAPER[:2], POWDER[:2])["C4"]
    assert (c4.word, c4.effect) == (REPRODUCED, claims.Estimate(0.0, 0.0, 0.0))
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
    assert "holds 0.5" in verdicts["C3"].note
    assert "p > 0.05" in judged([[0.1, 0.3, 0.2], [0.2, 0.1, 0.3], [0.3, 0.2, 0.4]])["C1"].note


def test_bonferroni_for_what_is_against_the_claim():
    """One of three pressures above 1/2 by a t interval of 1 - alpha / 3, not by one of 1 - alpha."""
    middle = np.array([0.55, 0.60, 0.65])
    low = middle.mean() - stats.t.ppf(1 - 0.05 / 2, 2) * stats.sem(middle)
    near = middle - low + 0.501  # just above by the usual interval
    c4 = judged(LIKE_THE_PAPER, [[0.0, value, 0.0] for value in near])["C4"]
    assert c4.word == INCONCLUSIVE
    assert c4.effect.low == pytest.approx(0.501)
    assert c4.effect_of == "at 530"
    lower = middle.mean() - stats.t.ppf(1 - 0.05 / 6, 2) * stats.sem(middle)
    assert words(LIKE_THE_PAPER, [[0.0, value, 0.0] for value in middle - lower + 0.501])["C4"] == CONTRADICTED


def test_one_seed_decides_nothing():
    """It says which way the numbers point."""
    verdicts = judged(LIKE_THE_PAPER[:1], POWDER[:1])
    assert {v.word for v in verdicts.values()} == {INCONCLUSIVE}
    assert {v.note for v in verdicts.values()} == {"one seed decides nothing; the numbers agree"}
    assert all(v.agrees and v.p is None and v.effect.low is None for v in verdicts.values())
    against = judged([[0.9, 0.5, 0.2]], POWDER[:1])["C1"]
    assert (against.word, against.agrees) == (INCONCLUSIVE, False)
    assert against.note.endswith("the numbers disagree")
    said = claims.write_sentence(table([[0.9, 0.5, 0.2]], POWDER[:1]), [against, verdicts["C4"]])
    assert "one seed decides nothing, the numbers disagree with: C1" in said
    assert "the numbers agree with: C4" in said


@pytest.mark.parametrize(("pressures", "least"), [(1, 2), (2, 5), (3, 2), (4, 2)])
def test_so_many_seeds_can_reproduce_a_claim(pressures, least):
    """With as many that agree all claims are reproduced, and with one less at least one is not."""
    assert claims.count_least_seeds(PAPER, pressures) == least
    rising = [[0.2, 0.9] if pressures == 2 else [0.2, 0.5, 0.9, 0.95][:pressures]]
    for seeds, is_enough in ((least, True), (least - 1, False)):
        found = claims.judge_claims(PAPER, table(rising * seeds, [[0.0] * pressures] * seeds, (1.0, 2.0, 3.0, 4.0)))
        words = [verdict.word for verdict in found if pressures > 1 or verdict.claim in ("C2", "C4")]
        assert (set(words) == {REPRODUCED}) == is_enough


def test_calibration_stands_beside_the_word():
    """What the pressures were chosen by is no test; unsintered snow is never chosen by."""
    verdicts = judged(LIKE_THE_PAPER, calibrated=True)
    assert {v.word for v in verdicts.values()} == {REPRODUCED}
    assert [c for c, v in verdicts.items() if v.calibrated] == ["C1", "C2", "C3", "C5"]
    assert verdicts["C1"].label == "REPRODUCED (by calibration, no test)"
    assert verdicts["C4"].label == "REPRODUCED"
    said = claims.write_sentence(table(LIKE_THE_PAPER, POWDER), list(verdicts.values()))
    assert "reproduced (by calibration, no test): C1, C2, C3, C5" in said
    assert "reproduced: C4" in said


def test_missing_arms_are_not_run():
    """A claim without runs has no verdict; an empty table has none at all; one pressure has no order."""
    only = judged(LIKE_THE_PAPER, [])
    assert [c for c, v in only.items() if v.word == NOT_RUN] == ["C4", "C5"]
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
    assert c5.effect.high - c5.effect.low < 1e-12


# Numbers without rounding, so that equal means are equal.
VALUES = st.integers(0, 1024).map(lambda n: n / 1024)
BLOCKS = st.integers(1, 4).flatmap(
    lambda seeds: st.lists(st.lists(VALUES, min_size=3, max_size=3), min_size=seeds, max_size=seeds)
)


@settings(deadline=None, max_examples=30)
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
        assert (verdict.word, verdict.agrees, verdict.p) == (was.word, was.agrees, was.p)
        assert verdict.effect.mean == pytest.approx(was.effect.mean)
        assert verdict.tau == was.tau


@settings(deadline=None, max_examples=30)
@given(sintered=BLOCKS, shift=st.integers(-2048, 2048).map(lambda n: n / 1024))
def test_a_constant_does_not_change_what_rises(sintered, shift):
    moved = [[value + shift for value in values] for values in sintered]
    one, other = judged(sintered)["C1"], judged(moved)["C1"]
    assert (one.word, one.agrees, one.p, one.tau) == (other.word, other.agrees, other.p, other.tau)
    assert one.effect.mean == other.effect.mean


@pytest.mark.parametrize("seeds", [3, *(pytest.param(seeds, marks=pytest.mark.nightly) for seeds in (2, 5))])
def test_no_effect_is_rarely_called_one(seeds):
    """Of 500 tables of noise at most alpha are called a rise, and at most alpha a fall (three sigmas of chance)."""
    rng, tables = np.random.default_rng(seeds), 500
    rise = PAPER.model_copy(update={"list": PAPER.list[:1]})
    frame = table(rng.normal(size=(seeds, 3)).tolist(), [])
    found = []
    for _ in range(tables):
        frame["lump_fraction"] = rng.normal(size=len(frame))
        found.append(claims.judge_claims(rise, frame)[0].word)
    most = PAPER.alpha * tables + 3 * np.sqrt(tables * PAPER.alpha * (1 - PAPER.alpha))
    assert found.count(REPRODUCED) <= most
    assert found.count(CONTRADICTED) <= most
    assert found.count(REPRODUCED) > 0 or seeds == 2


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(0, 1).map(lambda value: round(value, 2)), min_size=6, max_size=6))
def test_many_at_once_point_where_one_points(values):
    """``claims.points`` of a row is ``Verdict.agrees`` of a table with the same numbers."""
    names = [(arm, p) for arm in ARMS for p in PRESSURES]
    one = pd.DataFrame(names, columns=[ARM, "pressure"]).assign(seed=0, lump_fraction=values)
    means = pd.DataFrame([values], columns=pd.MultiIndex.from_tuples(names))
    verdicts = {v.claim: v.agrees for v in claims.judge_claims(PAPER, one)}
    for claim in PAPER.list:
        if claim.test != "scenes":
            assert bool(claims.check_agreement(claim, means).iloc[0]) == verdicts[claim.name], claim.name


# Over scenes


def scenes(agree: int, disagree: int, seeds: int = 1) -> list[JudgedScene]:
    """The calibrated scene and others, of which some disagree with C2 alone."""
    good, bad = LIKE_THE_PAPER[:seeds], [[0.6, 0.7, 0.9]] * seeds
    made = []
    for i, block in enumerate([good] * (1 + agree) + [bad] * disagree):
        frame = table(block, POWDER[:seeds])
        made.append(
            JudgedScene("ball", f"floor{i}", frame, i == 0, claims.judge_claims(PAPER, frame, calibrated=i == 0))
        )
    return made


def over(found: list[JudgedScene]) -> Verdict:
    (verdict,) = claims.judge_scenes(PAPER, found)
    return verdict


def test_other_scenes_are_counted_by_exact_tests():
    """27 scenes beside the calibrated one: 22 of 27 are more than half, Holm over five claims."""
    c6 = over(scenes(22, 5))
    assert c6.word == REPRODUCED
    assert c6.measured == "C1 in 27 of 27, C2 in 22 of 27, C3 in 27 of 27, C4 in 27 of 27, C5 in 27 of 27"
    assert c6.p == pytest.approx(stats.binomtest(22, 27, 0.5, alternative="greater").pvalue)  # the largest: times 1
    assert c6.p == pytest.approx(0.00076, rel=0.01)
    assert [part.estimate.mean for part in c6.parts][:2] == [1.0, pytest.approx(22 / 27)]
    assert c6.disagrees == ("C2: " + ", ".join(f"ball on floor{i}" for i in range(23, 28)),)


def test_scenes_that_are_no_majority():
    """18 of 27 may be chance of 1/2 (p 0.061), 5 of 27 is a contradiction of C2 for all five."""
    unsure = over(scenes(18, 9))
    assert (unsure.word, unsure.agrees) == (INCONCLUSIVE, True)
    assert unsure.p == pytest.approx(stats.binomtest(18, 27, 0.5, alternative="greater").pvalue)
    against = over(scenes(5, 22))
    assert (against.word, against.agrees) == (CONTRADICTED, False)
    assert against.p == pytest.approx(5 * stats.binomtest(5, 27, 0.5, alternative="less").pvalue)
    assert [part.where for part in against.parts if part.certain] == ["C2"]


def test_holm_decides_over_scenes():
    """Five of five scenes: p = 1/32 each, 5/32 after Holm; eight of eight: 5/256."""
    assert over(scenes(5, 0)).word == INCONCLUSIVE
    assert over(scenes(5, 0)).p == pytest.approx(5 / 32)
    assert over(scenes(8, 0)).word == REPRODUCED


def test_other_scenes_need_runs():
    """The calibrated scene and one other are no statement of others; nor are scenes with missing runs."""
    assert over(scenes(1, 0)).word == NOT_RUN
    found = scenes(9, 0)
    frame = found[3].table[lambda t: t["pressure"] < 3000]
    lost = [("sintered", PRESSURES[2])]
    found[3] = JudgedScene("ball", "floor3", frame, False, claims.judge_claims(PAPER, frame, missing=lost))
    c6 = over(found)
    assert (c6.word, c6.note) == (NOT_RUN, "Not all runs are there on ball on floor3.")
    assert "C1 in 8 of 8, C2 in 9 of 9" in c6.measured


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


def test_half_pressure_is_where_the_curve_crosses():
    """Halfway in log pressure between 0.4 and 0.6; equal seeds have an interval of length 0; one seed has none."""
    got = find_half_pressure(blocks([[0.4, 0.6, 0.9]] * 3), 0.05)
    assert got.pressure == pytest.approx(10**1.5)
    assert (got.low, got.high) == pytest.approx((10**1.5, 10**1.5))
    assert find_half_pressure(blocks([[0.4, 0.6, 0.9]]), 0.05).low is None
    spread = find_half_pressure(blocks([[0.4, 0.6, 0.9], [0.3, 0.55, 0.9], [0.45, 0.7, 0.9]]), 0.05)
    assert 10 < spread.low < spread.pressure < spread.high < 100
    assert spread == find_half_pressure(blocks([[0.45, 0.7, 0.9], [0.4, 0.6, 0.9], [0.3, 0.55, 0.9]]), 0.05)


@pytest.mark.parametrize(
    ("values", "note"),
    [
        ([[0.6, 0.7, 0.8]], "not crossed: half or more in lumps at every pressure"),
        ([[0.1, 0.2, 0.3]], "not crossed: less than half in lumps at every pressure"),
        ([[0.1, 0.5, 0.5]], "ambiguous: 1/2 at several pressures"),
        ([[0.1, 0.6, 0.4]], "ambiguous: 1/2 at several pressures"),  # levelled
        ([], "no runs"),
    ],
)
def test_half_pressure_is_none_where_there_is_none(values, note):
    got = find_half_pressure(blocks(values), 0.05)
    assert (got.pressure, got.low, got.high, got.note) == (None, None, None, note)


def test_an_interval_may_end_outside_the_pressures_run():
    low = find_half_pressure(blocks([[0.7, 0.8, 0.9], [0.2, 0.6, 0.9], [0.3, 0.6, 0.9]]), 0.05)
    assert low.low == BELOW < low.pressure < low.high < BEYOND
    high = find_half_pressure(blocks([[0.1, 0.2, 0.3], [0.2, 0.4, 0.7], [0.2, 0.4, 0.8]]), 0.05)
    assert high.high == BEYOND


def test_every_measure_is_a_number_in_the_summary(small_run):
    """A claim about another one is refused before any run, with the right names."""
    row = summarise(small_run)
    for name in get_args(Measure):
        assert isinstance(row[name], int | float) and not isinstance(row[name], bool), name
    claim = compose().question.claims.list[0].model_dump()
    with pytest.raises(ValidationError, match="'lump_fraction', 'powder_fraction'"):
        Claim.model_validate({**claim, "measure": "lumpiness"})


def test_an_order_without_an_effect_is_inconclusive():
    """Every seed rises, so the order is no chance; but by how much, the seeds do not agree."""
    verdict = judged([[0.0, 0.01, 0.02], [0.0, 0.01, 0.02], [0.0, 0.3, 0.9]], POWDER)["C1"]
    assert verdict.p == pytest.approx(1 / 216)
    assert (verdict.word, verdict.agrees) == (INCONCLUSIVE, True)
    assert "the interval of the effect holds 0" in verdict.note
