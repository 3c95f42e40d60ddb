"""Verdicts on the paper's claims from the numbers of a set of runs.

conf/claims says what is claimed and by which rule it is judged; this module applies the rules.  Where the rule for
CONTRADICTED and that for REPRODUCED are both met, the claim is contradicted.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from ..analysis.statistics import Estimate, adjust_by_holm, estimate_kendall_tau, estimate_mean, run_page_test
from ..settings.case import ARMS
from ..settings.question import Claim, Claims
from ..summary.row import ARM

REPRODUCED = "REPRODUCED"
CONTRADICTED = "CONTRADICTED"
INCONCLUSIVE = "INCONCLUSIVE"
NOT_RUN = "NOT RUN"

ARMS_OF = {"sintered": ARMS[:1], "unsintered": ARMS[1:], "contrast": ARMS}
LEAST_SEEDS, MOST_SEEDS = 2, 20  # that an interval needs, and that are tried
LEAST_SCENES = 2  # beside the calibrated one, to speak of other scenes
# Written behind the word where the pressures were chosen by the scene's own sintered runs.
CALIBRATION_NOTES = {
    REPRODUCED: " (by calibration, no test)",
    CONTRADICTED: " (in spite of calibration)",
    INCONCLUSIVE: " (pressures calibrated here)",
    NOT_RUN: "",
}


@dataclass(frozen=True)
class VerdictPart:
    """One part of a verdict: of a pressure, of a step between two pressures, or of one claim counted over scenes.

    ``agrees``: whether the mean agrees with the claim; ``certain``: it disagrees, and not by chance.
    """

    where: str
    estimate: Estimate
    agrees: bool
    certain: bool = False


@dataclass(frozen=True)
class Count:
    """The number of scenes in which the numbers agree with a claim.

    ``p``, ``p_less``: chances (Holm) of so many scenes or more, and of so few or fewer; ``against``: scenes that
    disagree.
    """

    claim: str
    holds: int
    scenes: int
    against: tuple[str, ...]
    p: float = 1.0
    p_less: float = 1.0


@dataclass(frozen=True)
class Verdict:
    """The verdict on a claim: its word, and the numbers behind it.

    ``calibrated``: the pressures were chosen by these very runs; ``agrees``: whether the means agree with the claim,
    None without numbers; ``counts``: of a claim over scenes; ``disagrees``: pressures, steps or scenes that disagree.
    """

    claim: str
    statement: str
    word: str = NOT_RUN
    calibrated: bool = False
    agrees: bool | None = None
    measured: str = "no runs"
    effect: Estimate | None = None
    effect_of: str = ""
    seeds: int = 0
    p: float | None = None
    tau: Estimate | None = None
    parts: tuple[VerdictPart, ...] = ()
    counts: tuple[Count, ...] = ()
    disagrees: tuple[str, ...] = ()
    note: str = ""

    @property
    def label(self) -> str:
        """The word, with a note where the pressures were calibrated by these runs."""
        return self.word + (CALIBRATION_NOTES[self.word] if self.calibrated else "")

    @property
    def direction(self) -> str:
        """Whether the means "agree" or "disagree" with the claim, whatever the word; empty without numbers."""
        return {True: "agree", False: "disagree", None: ""}[self.agrees]

    @property
    def effect_text(self) -> str:
        """The effect with its interval and what it is of, in words; empty without one."""
        return f"{format_interval(self.effect)}, {self.effect_of}" if self.effect else ""


@dataclass(frozen=True)
class JudgedScene:
    """One shape on one floor, with the numbers of its runs and the verdicts on them.

    ``table``: rows of runs; ``missing``: arm and pressure of runs without a result.
    """

    shape: str
    floor: str
    table: pd.DataFrame
    calibrated: bool
    verdicts: list[Verdict]
    missing: list[tuple[str, float]] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Snow shape and floor in words."""
        return f"{self.shape} on {self.floor}"

    def verdict(self, claim: str) -> Verdict:
        """Return the verdict on a claim by its name."""
        return next(v for v in self.verdicts if v.claim == claim)


@dataclass(frozen=True)
class ClaimValues:
    """The values that a claim is about.

    ``values``: (seeds, pressures), only seeds that have every pressure; ``dropped_seeds``: the others;
    ``without_result``: pressures at which a planned run has no result.
    """

    values: pd.DataFrame
    without_result: tuple[float, ...] = ()
    dropped_seeds: tuple[int, ...] = ()


def judge_claims(
    claims: Claims, table: pd.DataFrame, calibrated: bool = False, missing: Collection[tuple[str, float]] = ()
) -> list[Verdict]:
    """Judge each claim about one scene by its table: columns arm, pressure, seed and the claims' measures.

    ``calibrated``: the pressures were chosen by the sintered runs of this very scene; ``missing``: arm and pressure of
    planned runs that have no result.
    """
    return [
        _judge_claim(
            claim, claims.alpha, pair_values(claim, table, missing), calibrated and _depends_on_pressures(claim)
        )
        for claim in claims.list
        if claim.test != "scenes"
    ]


def count_least_seeds(claims: Claims, pressures: int) -> int:
    """Count the seeds from which on every claim about one scene can be REPRODUCED, if all of its numbers agree.

    An interval needs two.  A claim that numbers rise needs as many as make Page's p small enough, for ``pressures``.
    """
    if pressures < 2 or not any(claim.test == "rises" for claim in claims.list):
        return LEAST_SEEDS
    values = np.arange(pressures, dtype=float)
    chances = ((seeds, run_page_test(np.tile(values, (seeds, 1)))) for seeds in range(LEAST_SEEDS, MOST_SEEDS))
    return next((seeds for seeds, p in chances if p is not None and p <= claims.alpha), MOST_SEEDS)


def list_calibrated_claims(claims: Claims) -> list[str]:
    """List the claims that hold by choice of the pressures where the scene's own sintered runs chose them."""
    return [claim.name for claim in claims.list if _depends_on_pressures(claim)]


def _depends_on_pressures(claim: Claim) -> bool:
    """Return whether pressures can be chosen so that a claim holds: not where it is about unsintered snow alone."""
    return claim.test != "scenes" and claim.of != "unsintered"


def judge_scenes(claims: Claims, scenes: Sequence[JudgedScene]) -> list[Verdict]:
    """Judge each claim that counts other claims over scenes; the calibrated scene does not count."""
    others = [scene for scene in scenes if not scene.calibrated]
    return [_judge_claim_over_scenes(claim, claims.alpha, others) for claim in claims.list if claim.test == "scenes"]


def write_sentence(table: pd.DataFrame, verdicts: Sequence[Verdict], unit: str = "") -> str:
    """Write the mass in lumps and the verdicts of one scene as a sentence.  ``unit``: of pressures."""
    parts = []
    for arm, preposition in zip(ARMS, ("with", "without"), strict=True):
        means = select_arm(table, arm, "lump_fraction").mean()
        if len(means):
            lumps = ", ".join(f"{value:.2f}" for value in means)
            pressures = ", ".join(f"{pressure:g}" for pressure in means.index)
            parts.append(
                f"{preposition} sintering the mass in lumps is {lumps} at pressures {pressures} {unit}".rstrip()
            )
    groups: dict[str, list[str]] = {}
    for verdict in sorted(verdicts, key=lambda v: list(CALIBRATION_NOTES).index(v.word)):
        groups.setdefault(_describe_verdict(verdict), []).append(verdict.claim)
    parts += [f"{words}: {', '.join(names)}" for words, names in groups.items()]
    text = "; ".join(parts)
    return f"{text[0].upper()}{text[1:]}."


def select_arm(table: pd.DataFrame, arm: str, measure: str) -> pd.DataFrame:
    """Select a measure of one arm from the rows of runs, (seeds, pressures), both rising.

    Several runs of one seed and pressure are averaged.
    """
    if table.empty:
        return pd.DataFrame()
    own = table[table[ARM] == arm]
    return own.astype({measure: float}).pivot_table(index="seed", columns="pressure", values=measure)


def check_agreement(claim: Claim, means: pd.DataFrame) -> pd.Series:
    """Check row by row whether numbers agree with a claim: for many definitions of its measure at once.

    ``means``: over seeds, a row for each definition, with columns (arm, pressure), pressures rising.  The result is
    what ``Verdict.agrees`` is for the same numbers.
    """
    arms = [means[name] for name in ARMS_OF[claim.of]]
    values = arms[0] if len(arms) == 1 else arms[0] - arms[1]
    values = values[{"every": values.columns, "lowest": values.columns[:1], "highest": values.columns[-1:]}[claim.at]]
    if claim.test == "rises":
        steps = values.diff(axis=1).iloc[:, 1:]
        return (values.iloc[:, -1] - values.iloc[:, 0] > claim.threshold) & (steps > 0).all(axis=1)
    sided = values < claim.threshold if claim.test == "below" else values > claim.threshold
    return sided.all(axis=1)


def pair_values(claim: Claim, table: pd.DataFrame, missing: Collection[tuple[str, float]] = ()) -> ClaimValues:
    """Select the values that a claim is about, paired seed by seed; ``missing``: as ``judge_claims`` takes it."""
    names = ARMS_OF[claim.of]
    arms = [select_arm(table, name, claim.measure) for name in names]
    missing_by_arm = [{pressure for arm, pressure in missing if arm == name} for name in names]
    pressures = sorted(
        set.intersection(*({*arm.columns} | gone for arm, gone in zip(arms, missing_by_arm, strict=True)))
    )
    pressures = {"every": pressures, "lowest": pressures[:1], "highest": pressures[-1:]}[claim.at]
    arms = [arm.reindex(columns=pressures) for arm in arms]
    values = arms[0] if len(arms) == 1 else arms[0] - arms[1]
    gone = tuple(sorted(set.union(*missing_by_arm).intersection(pressures)))
    if gone:
        return ClaimValues(values, without_result=gone)
    complete = values.dropna()
    return ClaimValues(complete, dropped_seeds=tuple(int(seed) for seed in values.index.difference(complete.index)))


def _judge_claim(claim: Claim, alpha: float, claim_values: ClaimValues, calibrated: bool) -> Verdict:
    """Apply a claim's rule to its values, if all that it needs is there."""
    values = claim_values.values
    means = ", ".join(f"{format_number(mean)} at {p:g}" for p, mean in values.mean().dropna().items())
    verdict = Verdict(claim.name, claim.statement, calibrated=calibrated, measured=means or "no runs")
    seeds = ", ".join(map(str, claim_values.dropped_seeds))
    notes = [f"seeds without every pressure are left out: {seeds}"] if seeds else []
    if claim_values.without_result:
        return replace(verdict, note=f"no result at {', '.join(f'{p:g}' for p in claim_values.without_result)}")
    if values.empty:
        return replace(verdict, note="; ".join([*notes, "no runs"]))
    if claim.test == "rises" and len(values.columns) < 2:
        return replace(verdict, note="; ".join([*notes, "one pressure has no order"]))
    rule = _judge_rise if claim.test == "rises" else _judge_side
    verdict = rule(replace(verdict, seeds=len(values)), claim, alpha, values)
    verdict = replace(verdict, disagrees=tuple(_describe_part(part) for part in verdict.parts if not part.agrees))
    if len(values) < 2:
        verdict = replace(verdict, word=INCONCLUSIVE, note="one seed decides nothing")
    if verdict.word == INCONCLUSIVE:
        notes += [verdict.note, f"the numbers {verdict.direction}"]
    return replace(verdict, note="; ".join(notes))


def _judge_rise(verdict: Verdict, claim: Claim, alpha: float, values: pd.DataFrame) -> Verdict:
    """Judge whether values rise with pressure: by their order, by the highest pressure less the lowest, and by steps.

    A step between neighbours that falls for certain contradicts the claim.
    """
    pressures, numbers = list(values.columns), values.to_numpy()
    effect = estimate_mean(numbers[:, -1] - numbers[:, 0], alpha)
    steps = [estimate_mean(step, alpha / (len(pressures) - 1)) for step in np.diff(numbers, axis=1).T]
    names = [f"{low:g} to {high:g}" for low, high in pairwise(pressures)]
    parts = tuple(
        VerdictPart(name, step, step.mean > 0, step.is_below(0)) for name, step in zip(names, steps, strict=True)
    )
    p = run_page_test(numbers)
    word, note = INCONCLUSIVE, ""
    if effect.is_below(claim.threshold) or any(part.certain for part in parts):
        word = CONTRADICTED
    elif p is not None and p <= alpha and effect.is_above(claim.threshold):
        word = REPRODUCED
    elif p is not None and p > alpha:
        note = f"the order of the pressures may be chance (p > {alpha:g})"
    else:
        note = f"the interval of the effect holds {claim.threshold:g}"
    return replace(
        verdict, word=word, note=note, p=p, tau=estimate_kendall_tau(numbers, alpha), parts=parts,
        effect=effect, effect_of=f"{pressures[0]:g} to {pressures[-1]:g}",
        agrees=effect.mean > claim.threshold and all(part.agrees for part in parts),
    )  # fmt: skip


def _judge_side(verdict: Verdict, claim: Claim, alpha: float, values: pd.DataFrame) -> Verdict:
    """Judge whether values at every pressure are below, or above, the threshold.

    The effect is the mean at the pressure where it is nearest to the other side.
    """
    sign = -1.0 if claim.test == "below" else 1.0
    wide_estimates = [estimate_mean(column, alpha / values.shape[1]) for column in values.to_numpy().T]
    estimates = [estimate_mean(column, alpha) for column in values.to_numpy().T]
    against = [one.is_above(claim.threshold) if sign < 0 else one.is_below(claim.threshold) for one in wide_estimates]
    claimed = [one.is_below(claim.threshold) if sign < 0 else one.is_above(claim.threshold) for one in estimates]
    parts = tuple(
        VerdictPart(f"{pressure:g}", one, sign * (one.mean - claim.threshold) > 0, certain)
        for pressure, one, certain in zip(values.columns, estimates, against, strict=True)
    )
    nearest = min(parts, key=lambda part: sign * part.estimate.mean)
    word = CONTRADICTED if any(against) else REPRODUCED if all(claimed) else INCONCLUSIVE
    return replace(
        verdict, word=word, parts=parts, effect=nearest.estimate, effect_of=f"at {nearest.where}",
        note=f"an interval holds {claim.threshold:g}" if word == INCONCLUSIVE else "",
        agrees=all(part.agrees for part in parts),
    )  # fmt: skip


def _judge_claim_over_scenes(claim: Claim, alpha: float, scenes: Sequence[JudgedScene]) -> Verdict:
    """Judge whether the means agree with each claim named in more scenes than by chance."""
    counts = _count_scenes(claim, scenes)
    verdict = Verdict(
        claim.name, claim.statement, counts=counts,
        measured=", ".join(map(_describe_count, counts)) if scenes else "no other scenes",
        disagrees=tuple(f"{c.claim}: {', '.join(c.against)}" for c in counts if c.against),
        seeds=min((scene.verdict(name).seeds for scene in scenes for name in claim.claims), default=0),
    )  # fmt: skip
    unrun = [scene for scene in scenes if any(scene.verdict(name).word == NOT_RUN for name in claim.claims)]
    if len(scenes) < LEAST_SCENES or not counts:
        return replace(verdict, note=f"Needs {LEAST_SCENES} scenes beside the calibrated one, has {len(scenes)}.")
    if unrun:
        return replace(verdict, note=f"Not all runs are there on {', '.join(scene.name for scene in unrun)}.")
    parts = tuple(_make_share(count, claim, alpha) for count in counts)
    worst = min(parts, key=lambda part: part.estimate.mean)
    contradicted = any(part.certain for part in parts)
    reproduced = all(count.p <= alpha for count in counts)
    return replace(
        verdict, word=CONTRADICTED if contradicted else REPRODUCED if reproduced else INCONCLUSIVE,
        parts=parts, effect=worst.estimate, effect_of=f"share of scenes, {worst.where}",
        p=min(count.p_less for count in counts) if contradicted else max(count.p for count in counts),
        agrees=all(part.agrees for part in parts),
    )  # fmt: skip


def _count_scenes(claim: Claim, scenes: Sequence[JudgedScene]) -> tuple[Count, ...]:
    """Count the scenes that agree with each claim, with exact binomial tests, adjusted by Holm over the claims."""
    counts = []
    for name in claim.claims:
        agreement = {scene.name: scene.verdict(name).agrees for scene in scenes}
        known = [agrees for agrees in agreement.values() if agrees is not None]
        against = tuple(scene for scene, agrees in agreement.items() if agrees is False)
        counts.append(Count(name, sum(known), len(known), against))
    more, less = (
        adjust_by_holm(np.array([_test_count(count, claim.threshold, way) for count in counts]))
        for way in ("greater", "less")
    )
    return tuple(replace(count, p=float(p), p_less=float(q)) for count, p, q in zip(counts, more, less, strict=True))


def _describe_count(count: Count) -> str:
    """Describe in how many scenes the numbers agree with a claim."""
    return f"{count.claim} in {count.holds} of {count.scenes}" if count.scenes else f"{count.claim} not run"


def _test_count(count: Count, share: float, alternative: str) -> float:
    """Return p of the exact binomial test of a count against a share, "greater" or "less"; 1 without scenes."""
    return binomtest(count.holds, count.scenes, share, alternative=alternative).pvalue if count.scenes else 1.0


def _make_share(count: Count, claim: Claim, alpha: float) -> VerdictPart:
    """Turn a count into a share of the scenes with its exact interval."""
    exact = binomtest(count.holds, count.scenes).proportion_ci(1.0 - alpha)
    share = Estimate(count.holds / count.scenes, float(exact.low), float(exact.high))
    return VerdictPart(count.claim, share, share.mean > claim.threshold, count.p_less <= alpha)


def format_number(value: float) -> str:
    """Write a number with two decimals where they are enough, else with three digits."""
    return f"{value:.2f}" if value == 0 or 0.005 <= abs(value) < 1000 else f"{value:.3g}"


def format_interval(value: Estimate) -> str:
    """Write a mean and its interval, if it has one."""
    if value.low is None or value.high is None:
        return format_number(value.mean)
    return f"{format_number(value.mean)} [{format_number(value.low)}, {format_number(value.high)}]"


def _describe_part(part: VerdictPart) -> str:
    """Describe a part that disagrees with its claim, and whether that is certain."""
    return f"{part.where} ({format_number(part.estimate.mean)}{', for certain' if part.certain else ''})"


def _describe_verdict(verdict: Verdict) -> str:
    """Describe a verdict in words that introduce a list of claims."""
    if verdict.word == INCONCLUSIVE:
        why = "one seed decides nothing" if verdict.seeds == 1 else "inconclusive"
        return f"{why}, the numbers {verdict.direction} with{CALIBRATION_NOTES[INCONCLUSIVE] * verdict.calibrated}"
    return verdict.label.replace(verdict.word, verdict.word.lower())
