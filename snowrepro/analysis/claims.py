"""The paper's claims as statements about numbers, and what a set of runs says of each.

conf/claims says what is claimed and by which rule it is decided; this module applies the rules.  Where the rule
for CONTRADICTED and that for REPRODUCED are both met, the claim is contradicted.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from ..config import Claim, Claims, Config
from .statistics import Estimate, estimate, holm, kendall, page

REPRODUCED = "REPRODUCED"
CONTRADICTED = "CONTRADICTED"
INCONCLUSIVE = "INCONCLUSIVE"
NOT_RUN = "NOT RUN"

ARMS = ("sintered", "unsintered")
ARMS_OF = {"sintered": ARMS[:1], "unsintered": ARMS[1:], "contrast": ARMS}
LEAST_SCENES = 2  # beside the calibrated one, to speak of other scenes
# What stands beside the word where the scene's own sintered runs chose the pressures.
BESIDE = {
    REPRODUCED: " (by calibration, no test)",
    CONTRADICTED: " (in spite of calibration)",
    INCONCLUSIVE: " (pressures calibrated here)",
    NOT_RUN: "",
}


@dataclass(frozen=True)
class Part:
    """What a verdict is made of: a pressure, a step between two, or one claim counted over scenes."""

    where: str
    estimate: Estimate
    agrees: bool  # the mean, with what is claimed
    certain: bool = False  # against the claim, and not by chance


@dataclass(frozen=True)
class Count:
    """In how many scenes the numbers agree with a claim, and p (Holm) for more, and for less, than by chance."""

    claim: str
    holds: int
    scenes: int
    against: tuple[str, ...]
    p: float = 1.0
    p_less: float = 1.0


@dataclass(frozen=True)
class Verdict:
    """A claim, the word for it, and what the word rests on."""

    claim: str
    statement: str
    word: str = NOT_RUN
    calibrated: bool = False  # the pressures were chosen by these very runs
    agrees: bool | None = None  # whether the means point the claim's way; None without numbers
    measured: str = "no runs"
    effect: Estimate | None = None
    effect_of: str = ""
    seeds: int = 0
    p: float | None = None
    tau: Estimate | None = None
    parts: tuple[Part, ...] = ()
    counts: tuple[Count, ...] = ()  # of a claim over scenes
    disagrees: tuple[str, ...] = ()  # pressures, steps or scenes that point the other way
    note: str = ""

    @property
    def shown(self) -> str:
        """The word, and whether calibration takes its weight."""
        return self.word + (BESIDE[self.word] if self.calibrated else "")

    @property
    def way(self) -> str:
        """Where the numbers point, whatever is decided."""
        return {True: "agree", False: "disagree", None: ""}[self.agrees]

    @property
    def effect_shown(self) -> str:
        """The effect, its interval and what it is of; empty without one."""
        return f"{interval(self.effect)}, {self.effect_of}" if self.effect else ""


@dataclass(frozen=True)
class Scene:
    """One shape on one floor: its runs' numbers and the verdicts on them."""

    shape: str
    floor: str
    table: pd.DataFrame
    calibrated: bool
    verdicts: list[Verdict]
    missing: list[tuple[str, float]] = field(default_factory=list)  # sintering and pressure of runs without result

    @property
    def name(self) -> str:
        """Snow and floor in words."""
        return f"{self.shape} on {self.floor}"

    def verdict(self, claim: str) -> Verdict:
        """The verdict on a claim by its name."""
        return next(v for v in self.verdicts if v.claim == claim)


@dataclass(frozen=True)
class Blocks:
    """The values that a claim is about: (seeds, pressures), only seeds that have every pressure."""

    values: pd.DataFrame
    lost: tuple[float, ...] = ()  # pressures at which a run that was asked for has no result
    dropped: tuple[int, ...] = ()  # seeds that miss a pressure


def judge(
    claims: Claims, table: pd.DataFrame, calibrated: bool = False, missing: Collection[tuple[str, float]] = ()
) -> list[Verdict]:
    """Judge each claim about one scene by its table: columns sintering, pressure, seed and the claims' measures.

    ``calibrated``: the pressures were chosen by the sintered runs of this very scene.
    ``missing``: sintering and pressure of runs that were asked for and have no result.
    """
    return [
        _judge_one(claim, claims.alpha, blocks_of(claim, table, missing), calibrated and claim.of != "unsintered")
        for claim in claims.list
        if claim.test != "scenes"
    ]


def judge_scenes(claims: Claims, scenes: Sequence[Scene]) -> list[Verdict]:
    """Judge each claim that counts others over scenes."""
    others = [scene for scene in scenes if not scene.calibrated]
    return [_over_scenes(claim, claims.alpha, others) for claim in claims.list if claim.test == "scenes"]


def sentence(table: pd.DataFrame, verdicts: Sequence[Verdict]) -> str:
    """The mass in lumps and the verdicts, in one line of words."""
    parts = []
    for arm, how in zip(ARMS, ("with", "without"), strict=True):
        means = arm_of(table, arm, "lump_fraction").mean()
        if len(means):
            listed = ", ".join(f"{value:.2f}" for value in means)
            pressures = ", ".join(f"{pressure:g}" for pressure in means.index)
            parts.append(f"{how} sintering the mass in lumps is {listed} at pressures {pressures}")
    groups: dict[str, list[str]] = {}
    for verdict in sorted(verdicts, key=lambda v: list(BESIDE).index(v.word)):
        groups.setdefault(_in_words(verdict), []).append(verdict.claim)
    parts += [f"{words}: {', '.join(names)}" for words, names in groups.items()]
    text = "; ".join(parts)
    return f"{text[0].upper()}{text[1:]}."


def arm(config: Config) -> str:
    """Which of ARMS a run belongs to."""
    return ARMS[0] if config.sintering.enabled else ARMS[1]


def arm_of(table: pd.DataFrame, arm: str, measure: str) -> pd.DataFrame:
    """A measure of one arm (seeds, pressures), both rising; several runs of one seed are averaged."""
    if table.empty:
        return pd.DataFrame()
    own = table[(table["sintering"] == "none") == (arm == "unsintered")]
    return own.astype({measure: float}).pivot_table(index="seed", columns="pressure", values=measure)


def points(claim: Claim, means: pd.DataFrame) -> pd.Series:
    """Whether numbers point a claim's way, row by row, for many definitions of its measure at once.

    ``means``: over seeds, with columns (arm, pressure), pressures rising.  As ``Verdict.agrees`` of the same numbers.
    """
    arms = [means[name] for name in ARMS_OF[claim.of]]
    values = arms[0] if len(arms) == 1 else arms[0] - arms[1]
    values = values[{"every": values.columns, "lowest": values.columns[:1], "highest": values.columns[-1:]}[claim.at]]
    if claim.test == "rises":
        steps = values.diff(axis=1).iloc[:, 1:]
        return (values.iloc[:, -1] - values.iloc[:, 0] > claim.threshold) & (steps > 0).all(axis=1)
    sided = values < claim.threshold if claim.test == "below" else values > claim.threshold
    return sided.all(axis=1)


def blocks_of(claim: Claim, table: pd.DataFrame, missing: Collection[tuple[str, float]] = ()) -> Blocks:
    """The values that a claim is about, paired seed by seed."""
    names = ARMS_OF[claim.of]
    arms = [arm_of(table, name, claim.measure) for name in names]
    lost = [{p for sintering, p in missing if (sintering == "none") == (name == "unsintered")} for name in names]
    pressures = sorted(set.intersection(*({*arm.columns} | gone for arm, gone in zip(arms, lost, strict=True))))
    pressures = {"every": pressures, "lowest": pressures[:1], "highest": pressures[-1:]}[claim.at]
    arms = [arm.reindex(columns=pressures) for arm in arms]
    values = arms[0] if len(arms) == 1 else arms[0] - arms[1]
    gone = tuple(sorted(set.union(*lost).intersection(pressures)))
    if gone:
        return Blocks(values, lost=gone)
    whole = values.dropna()
    return Blocks(whole, dropped=tuple(int(seed) for seed in values.index.difference(whole.index)))


def _judge_one(claim: Claim, alpha: float, blocks: Blocks, calibrated: bool) -> Verdict:
    """Apply a claim's rule to its blocks, if all that it needs is there."""
    values = blocks.values
    listed = ", ".join(f"{number(mean)} at {p:g}" for p, mean in values.mean().dropna().items())
    verdict = Verdict(claim.name, claim.statement, calibrated=calibrated, measured=listed or "no runs")
    dropped = f"seeds without every pressure are left out: {', '.join(map(str, blocks.dropped))}"
    notes = [dropped] if blocks.dropped else []
    if blocks.lost:
        return replace(verdict, note=f"no result at {', '.join(f'{p:g}' for p in blocks.lost)}")
    if values.empty:
        return replace(verdict, note="; ".join([*notes, "no runs"]))
    if claim.test == "rises" and len(values.columns) < 2:
        return replace(verdict, note="; ".join([*notes, "one pressure has no order"]))
    rule = _rises if claim.test == "rises" else _on_one_side
    found = rule(replace(verdict, seeds=len(values)), claim, alpha, values)
    found = replace(found, disagrees=tuple(_told(part) for part in found.parts if not part.agrees))
    if len(values) < 2:
        found = replace(found, word=INCONCLUSIVE, note="one seed decides nothing")
    if found.word == INCONCLUSIVE:
        notes += [found.note, f"the numbers {found.way}"]
    return replace(found, note="; ".join(notes))


def _rises(verdict: Verdict, claim: Claim, alpha: float, values: pd.DataFrame) -> Verdict:
    """The order of the pressures, what the highest has over the lowest, and no step that falls for certain."""
    pressures, numbers = list(values.columns), values.to_numpy()
    effect = estimate(numbers[:, -1] - numbers[:, 0], alpha)
    steps = [estimate(step, alpha / (len(pressures) - 1)) for step in np.diff(numbers, axis=1).T]
    names = [f"{low:g} to {high:g}" for low, high in pairwise(pressures)]
    parts = tuple(Part(name, step, step.mean > 0, step.below(0)) for name, step in zip(names, steps, strict=True))
    p = page(numbers)
    word, note = INCONCLUSIVE, ""
    if effect.below(claim.threshold) or any(part.certain for part in parts):
        word = CONTRADICTED
    elif p is not None and p <= alpha and effect.above(claim.threshold):
        word = REPRODUCED
    elif p is not None and p > alpha:
        note = f"the order of the pressures may be chance (p > {alpha:g})"
    else:
        note = f"the interval of the effect holds {claim.threshold:g}"
    return replace(
        verdict, word=word, note=note, p=p, tau=kendall(numbers, alpha), parts=parts,
        effect=effect, effect_of=f"{pressures[0]:g} to {pressures[-1]:g}",
        agrees=effect.mean > claim.threshold and all(part.agrees for part in parts),
    )  # fmt: skip


def _on_one_side(verdict: Verdict, claim: Claim, alpha: float, values: pd.DataFrame) -> Verdict:
    """Every pressure below, or above, the threshold; the effect is the mean where it comes nearest to the other."""
    sign = -1.0 if claim.test == "below" else 1.0
    wide = [estimate(column, alpha / values.shape[1]) for column in values.to_numpy().T]
    usual = [estimate(column, alpha) for column in values.to_numpy().T]
    against = [e.above(claim.threshold) if sign < 0 else e.below(claim.threshold) for e in wide]
    claimed = [e.below(claim.threshold) if sign < 0 else e.above(claim.threshold) for e in usual]
    parts = tuple(
        Part(f"{pressure:g}", e, sign * (e.mean - claim.threshold) > 0, certain)
        for pressure, e, certain in zip(values.columns, usual, against, strict=True)
    )
    nearest = min(parts, key=lambda part: sign * part.estimate.mean)
    word = CONTRADICTED if any(against) else REPRODUCED if all(claimed) else INCONCLUSIVE
    return replace(
        verdict, word=word, parts=parts, effect=nearest.estimate, effect_of=f"at {nearest.where}",
        note=f"an interval holds {claim.threshold:g}" if word == INCONCLUSIVE else "",
        agrees=all(part.agrees for part in parts),
    )  # fmt: skip


def _over_scenes(claim: Claim, alpha: float, scenes: Sequence[Scene]) -> Verdict:
    """In how many scenes the means agree with each claim named, and whether that is more than chance."""
    counts = _counts(claim, scenes)
    verdict = Verdict(
        claim.name, claim.statement, counts=counts,
        measured=", ".join(f"{c.claim} in {c.holds} of {c.scenes}" for c in counts) if scenes else "no other scenes",
        disagrees=tuple(f"{c.claim}: {', '.join(c.against)}" for c in counts if c.against),
        seeds=min((scene.verdict(name).seeds for scene in scenes for name in claim.claims), default=0),
    )  # fmt: skip
    unrun = [scene for scene in scenes if any(scene.verdict(name).word == NOT_RUN for name in claim.claims)]
    if len(scenes) < LEAST_SCENES or not counts:
        return replace(verdict, note=f"Needs {LEAST_SCENES} scenes beside the calibrated one, has {len(scenes)}.")
    if unrun:
        return replace(verdict, note=f"Not all runs are there on {', '.join(scene.name for scene in unrun)}.")
    parts = tuple(_share(count, claim, alpha) for count in counts)
    worst = min(parts, key=lambda part: part.estimate.mean)
    contradicted = any(part.certain for part in parts)
    reproduced = all(count.p <= alpha for count in counts)
    return replace(
        verdict, word=CONTRADICTED if contradicted else REPRODUCED if reproduced else INCONCLUSIVE,
        parts=parts, effect=worst.estimate, effect_of=f"share of scenes, {worst.where}",
        p=min(count.p_less for count in counts) if contradicted else max(count.p for count in counts),
        agrees=all(part.agrees for part in parts),
    )  # fmt: skip


def _counts(claim: Claim, scenes: Sequence[Scene]) -> tuple[Count, ...]:
    """Scenes that have numbers, and exact binomial tests of those that agree, Holm over the claims."""
    counts = []
    for name in claim.claims:
        found = {scene.name: scene.verdict(name).agrees for scene in scenes}
        tried = [agrees for agrees in found.values() if agrees is not None]
        against = tuple(scene for scene, agrees in found.items() if agrees is False)
        counts.append(Count(name, sum(tried), len(tried), against))
    more, less = (
        holm(np.array([_chance(count, claim.threshold, way) for count in counts])) for way in ("greater", "less")
    )
    return tuple(replace(count, p=float(p), p_less=float(q)) for count, p, q in zip(counts, more, less, strict=True))


def _chance(count: Count, share: float, way: str) -> float:
    return binomtest(count.holds, count.scenes, share, alternative=way).pvalue if count.scenes else 1.0


def _share(count: Count, claim: Claim, alpha: float) -> Part:
    """A count as a share of the scenes, with its exact interval."""
    exact = binomtest(count.holds, count.scenes).proportion_ci(1.0 - alpha)
    share = Estimate(count.holds / count.scenes, float(exact.low), float(exact.high))
    return Part(count.claim, share, share.mean > claim.threshold, count.p_less <= alpha)


def number(value: float) -> str:
    """Two decimals where they say something, else three digits."""
    return f"{value:.2f}" if value == 0 or 0.005 <= abs(value) < 1000 else f"{value:.3g}"


def interval(value: Estimate) -> str:
    """A number and its interval, if it has one."""
    between = f" [{number(value.low)}, {number(value.high)}]" if value.low is not None else ""
    return number(value.mean) + between


def _told(part: Part) -> str:
    """A part that points the other way, with how certain that is."""
    return f"{part.where} ({number(part.estimate.mean)}{', for certain' if part.certain else ''})"


def _in_words(verdict: Verdict) -> str:
    """The verdict as the head of a list of claims."""
    if verdict.word == INCONCLUSIVE:
        why = "one seed decides nothing" if verdict.seeds == 1 else "inconclusive"
        return f"{why}, the numbers {verdict.way} with{BESIDE[INCONCLUSIVE] * verdict.calibrated}"
    return verdict.shown.replace(verdict.word, verdict.word.lower())
