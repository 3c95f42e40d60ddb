"""Verdicts on the paper's claims about one scene, from the numbers of a set of runs.

conf/claims says what is claimed and by which rule it is judged; this module applies the rules, ``scenes`` counts over
several scenes.  Where the rule for CONTRADICTED and that for REPRODUCED are both met, the claim is contradicted.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import get_args

import pandas as pd

from ..analysis.statistics import NO_LIMITS, ROUND_OFF, Estimate, estimate_mean
from ..settings.case import ARMS
from ..settings.question import Claim, Claims, Fraction
from ..summary.row import ARM

REPRODUCED = "REPRODUCED"
CONTRADICTED = "CONTRADICTED"
INCONCLUSIVE = "INCONCLUSIVE"
NOT_RUN = "NOT RUN"

ARMS_OF = {"sintered": ARMS[:1], "unsintered": ARMS[1:], "contrast": ARMS}
LEAST_SEEDS = 2  # that an interval needs
# What else is said of the runs that a verdict is about, by column.
BESIDE = {"crushed_fraction": "crushed", "flattening_end": "height lost"}
OTHER_STATES = {"crushed_fraction": "crushed", "loose_fraction": "loose"}
STATES = {"lump_fraction": "in lumps", **OTHER_STATES}
# Written behind the word where the pressures were chosen by the scene's own sintered runs.
CALIBRATION_NOTES = {
    REPRODUCED: " (by calibration, no test)",
    CONTRADICTED: " (in spite of calibration)",
    INCONCLUSIVE: " (pressures calibrated here)",
    NOT_RUN: "",
}


@dataclass(frozen=True)
class VerdictPart:
    """One part of a verdict: of a pressure, or of a step between two pressures.

    ``margin``: by how much the mean is on the claimed side of the threshold, negative on the other side; ``holds``:
    the whole interval is on the claimed side; ``certain``: it is on the other side, not by chance.
    """

    where: str
    estimate: Estimate
    margin: float
    holds: bool = False
    certain: bool = False

    @property
    def agrees(self) -> bool:
        """Whether the mean agrees with the claim."""
        return self.margin > 0


@dataclass(frozen=True)
class ShapeCount:
    """In how many ``scenes`` of a shape the numbers ``agree`` with a claim, and by which margins: see ``VerdictPart``.

    ``holds``: whether these scenes are more than the share that the rule wants.
    """

    shape: str
    agree: int
    scenes: int
    holds: bool
    least: float
    most: float


@dataclass(frozen=True)
class Count:
    """A claim counted by shapes; ``against``: the scenes whose numbers disagree."""

    claim: str
    by_shape: tuple[ShapeCount, ...]
    against: tuple[str, ...] = ()

    @property
    def holds(self) -> int:
        """The number of shapes on which the claim holds."""
        return sum(shape.holds for shape in self.by_shape)

    @property
    def words(self) -> str:
        """The count in words."""
        if not self.by_shape:
            return f"{self.claim} not run"
        agree, scenes = (sum(getattr(shape, name) for shape in self.by_shape) for name in ("agree", "scenes"))
        return f"{self.claim} on {self.holds} of {len(self.by_shape)} shapes ({agree} of {scenes} scenes)"


@dataclass(frozen=True)
class Verdict:
    """The verdict on a claim: its word, and the numbers behind it.

    ``calibrated``: the pressures were chosen by these very runs; ``agrees``: whether the means agree with the claim,
    None without numbers; ``beside``: what else is to be known of the runs; ``effect``: of the part that is nearest to
    the other side of the threshold; ``same_as``: the claim that has the same numbers; ``counts``: of claims over
    scenes; ``left_out``: scenes that are not counted; ``disagrees``: pressures, steps or shapes that disagree.
    """

    claim: str
    statement: str
    word: str = NOT_RUN
    calibrated: bool = False
    agrees: bool | None = None
    measured: str = "no runs"
    beside: str = ""
    effect: Estimate | None = None
    effect_of: str = ""
    margin: float | None = None
    seeds: int = 0
    same_as: str = ""
    parts: tuple[VerdictPart, ...] = ()
    counts: tuple[Count, ...] = ()
    left_out: tuple[str, ...] = ()
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
    verdicts = []
    for claim in claims.list:
        if claim.test == "scenes":
            continue
        values = pair_values(claim, table, missing)
        verdict = judge_values(claim, claims.alpha, values)
        verdicts.append(
            replace(
                verdict,
                calibrated=calibrated and _depends_on_pressures(claim),
                beside=_describe_beside(claim, table, values.values.columns),
                same_as=_find_same(claim, claims, table) if verdict.parts else "",
            )
        )
    return verdicts


def list_calibrated_claims(claims: Claims) -> list[str]:
    """List the claims that hold by choice of the pressures where the scene's own sintered runs chose them."""
    return [claim.name for claim in claims.list if _depends_on_pressures(claim)]


def _depends_on_pressures(claim: Claim) -> bool:
    """Return whether the pressures are chosen so that a claim holds: by the lumps of sintered snow."""
    return claim.test != "scenes" and claim.of != "unsintered" and claim.measure == "lump_fraction"


def write_sentence(table: pd.DataFrame, verdicts: Sequence[Verdict], unit: str = "") -> str:
    """Write the mass by state and the verdicts of one scene as a sentence.  ``unit``: of pressures."""
    parts = []
    for arm, preposition in zip(ARMS, ("with", "without"), strict=True):
        means = select_arm(table, arm, "lump_fraction").mean()
        if len(means):
            lumps = ", ".join(f"{value:.2f}" for value in means)
            others = _list_means(table, arm, means.index, OTHER_STATES)
            pressures = ", ".join(f"{pressure:g}" for pressure in means.index)
            text = f"{preposition} sintering the mass in lumps is {lumps}{others and f' ({others})'} at pressures "
            parts.append(f"{text}{pressures} {unit}".rstrip())
    groups: dict[str, list[str]] = {}
    for verdict in sorted(verdicts, key=lambda v: list(CALIBRATION_NOTES).index(v.word)):
        words = f"the same numbers as {verdict.same_as}" if verdict.same_as else _describe_verdict(verdict)
        groups.setdefault(words, []).append(verdict.claim)
    parts += [f"{words}: {', '.join(names)}" for words, names in groups.items()]
    text = "; ".join(parts)
    return f"{text[0].upper()}{text[1:]}."


def _list_means(table: pd.DataFrame, arm: str, pressures: pd.Index, names: Mapping[str, str]) -> str:
    """List means by pressure, of those columns that there are: "crushed 0.10, 0.02".  ``names``: by column."""
    means = {
        name: select_arm(table, arm, column).mean().reindex(pressures).dropna()
        for column, name in names.items()
        if column in table
    }
    texts = {name: ", ".join(f"{round(value, 2) + 0.0:.2f}" for value in values) for name, values in means.items()}
    return "; ".join(f"{name} {text}" for name, text in texts.items() if text)


def _describe_beside(claim: Claim, table: pd.DataFrame, pressures: pd.Index) -> str:
    """Describe what else is to be known of the runs that a claim is about; nothing of a difference of two arms."""
    arms = ARMS_OF[claim.of]
    names = {column: name for column, name in BESIDE.items() if column != claim.measure}
    return _list_means(table, arms[0], pressures, names) if len(arms) == 1 else ""


def select_arm(table: pd.DataFrame, arm: str, measure: str) -> pd.DataFrame:
    """Select a measure of one arm from the rows of runs, (seeds, pressures), both rising.

    Several runs of one seed and pressure are averaged.  Empty where there are no such rows, or no such column.
    """
    if table.empty or measure not in table:
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
        values = values.diff(axis=1).iloc[:, 1:]
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


def judge_values(claim: Claim, alpha: float, claim_values: ClaimValues) -> Verdict:
    """Apply a claim's rule to its values, if all that it needs is there."""
    values = claim_values.values
    means = ", ".join(f"{format_number(mean)} at {p:g}" for p, mean in values.mean().dropna().items())
    verdict = Verdict(claim.name, claim.statement, measured=means or "no runs")
    seeds = ", ".join(map(str, claim_values.dropped_seeds))
    notes = [f"seeds without every pressure are left out: {seeds}"] if seeds else []
    if claim_values.without_result:
        return replace(verdict, note=f"no result at {', '.join(f'{p:g}' for p in claim_values.without_result)}")
    if values.empty:
        return replace(verdict, note="; ".join([*notes, "no runs"]))
    if claim.test == "rises" and len(values.columns) < 2:
        return replace(verdict, note="; ".join([*notes, "one pressure has no order"]))
    verdict = _judge_parts(replace(verdict, seeds=len(values)), claim, _make_parts(claim, alpha, values))
    if verdict.word == INCONCLUSIVE:
        notes += [verdict.note, f"the numbers {verdict.direction}"]
    return replace(verdict, note="; ".join(notes))


def _judge_parts(verdict: Verdict, claim: Claim, parts: Sequence[VerdictPart]) -> Verdict:
    """Judge a claim that needs every one of its parts (an intersection-union test)."""
    contradicted, reproduced = any(part.certain for part in parts), all(part.holds for part in parts)
    weakest = min(parts, key=lambda part: (not part.certain, part.holds, part.margin))
    undecided = ", ".join(part.where for part in parts if not part.holds)
    return replace(
        verdict, word=CONTRADICTED if contradicted else REPRODUCED if reproduced else INCONCLUSIVE,
        parts=tuple(parts), effect=weakest.estimate,
        effect_of=weakest.where if claim.test == "rises" else f"at {weakest.where}",
        margin=min(part.margin for part in parts), agrees=all(part.agrees for part in parts),
        disagrees=tuple(_describe_part(part) for part in parts if not part.agrees),
        note="one seed decides nothing" if verdict.seeds < 2 else f"open: {undecided}",
    )  # fmt: skip


def _make_parts(claim: Claim, alpha: float, values: pd.DataFrame) -> list[VerdictPart]:
    """Compare all that a claim needs with its threshold: the value at each pressure, or each step between two.

    What is against the claim may be any of them, so there alpha is divided by their number (Bonferroni).
    """
    numbers = {f"{pressure:g}": column.to_numpy() for pressure, column in values.items()}
    if claim.test == "rises":
        numbers = {f"{low} to {high}": numbers[high] - numbers[low] for low, high in pairwise(numbers)}
    limits, sign = _find_limits(claim), -1.0 if claim.test == "below" else 1.0
    parts = []
    for where, column in numbers.items():
        estimate, wide = (estimate_mean(column, level, limits) for level in (alpha, alpha / len(numbers)))
        is_above, is_below = estimate.is_above(claim.threshold), estimate.is_below(claim.threshold)
        against = wide.is_above(claim.threshold) if sign < 0 else wide.is_below(claim.threshold)
        margin = sign * (estimate.mean - claim.threshold)
        parts.append(VerdictPart(where, estimate, margin, is_below if sign < 0 else is_above, against))
    return parts


def find_limits(measure: str) -> tuple[float, float]:
    """Find the limits of a measure's values: 0 and 1 for parts of a whole."""
    return (0.0, 1.0) if measure in get_args(Fraction) else NO_LIMITS


def _find_limits(claim: Claim) -> tuple[float, float]:
    """Find the limits of what a claim compares: a measure, its difference between two arms, or steps of these."""
    low, high = find_limits(claim.measure)
    for is_difference in (claim.of == "contrast", claim.test == "rises"):
        low, high = (low - high, high - low) if is_difference else (low, high)
    return low, high


def _find_same(claim: Claim, claims: Claims, table: pd.DataFrame) -> str:
    """Find the claim on sintered snow that a rise of the contrast only repeats; empty if there is none.

    It does where unsintered snow is the same at every pressure, seed by seed: then both have the same steps.
    """
    if (claim.of, claim.test) != ("contrast", "rises"):
        return ""
    unsintered = select_arm(table, ARMS[1], claim.measure)
    if (unsintered.max(axis=1) - unsintered.min(axis=1)).max() > ROUND_OFF:
        return ""
    alike = claim.model_dump(include={"measure", "at", "test", "threshold"})
    others = (other for other in claims.list if other.of == "sintered")
    return next((other.name for other in others if other.model_dump(include=set(alike)) == alike), "")


def format_number(value: float) -> str:
    """Write a number with two decimals where they are enough, else with three digits."""
    return f"{value:.2f}" if value == 0 or 0.005 <= abs(value) < 1000 else f"{value:.3g}"


def format_interval(value: Estimate) -> str:
    """Write a mean and its interval, if it has one; of equal values how many they are."""
    if value.low is None or value.high is None:
        return format_number(value.mean)
    if value.is_of_equals:
        is_none = abs(value.mean) <= ROUND_OFF
        return f"none in {value.count} seeds" if is_none else f"{format_number(value.mean)} in all {value.count} seeds"
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
