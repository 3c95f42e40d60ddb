"""Verdicts on claims that count other claims over scenes, by snow shape.

Scenes of one shape are no independent trials: what the shape is decides most of what their numbers are.  So the claims
are counted by shape, with the margins, and there is no p.
"""

from collections.abc import Sequence
from dataclasses import replace

import pandas as pd

from ..settings.case import ARMS
from ..settings.question import Claim, Claims
from .claims import (
    CONTRADICTED,
    INCONCLUSIVE,
    NOT_RUN,
    REPRODUCED,
    Count,
    JudgedScene,
    ShapeCount,
    Verdict,
    select_arm,
)

LEAST_SCENES = 2  # beside the calibrated one, to speak of other scenes
LEAST_SHAPES = 4  # of fewer, all agree by chance more often than once in sixteen
SAME_WITHIN = 0.02  # of a measure; scenes that differ by less, or by less than seeds do, are the same


def judge_scenes(claims: Claims, scenes: Sequence[JudgedScene]) -> list[Verdict]:
    """Judge each claim that counts other claims over scenes.

    The calibrated scene does not count, nor do scenes whose runs give the same as its own.
    """
    measures = list(dict.fromkeys(claim.measure for claim in claims.list))
    calibrated = [scene for scene in scenes if scene.calibrated]
    others = [scene for scene in scenes if not scene.calibrated]
    same = [scene for scene in others if any(_gives_the_same(scene, one, measures) for one in calibrated)]
    counted = [scene for scene in others if scene not in same]
    return [_judge_over_scenes(claim, counted, same) for claim in claims.list if claim.test == "scenes"]


def _gives_the_same(scene: JudgedScene, other: JudgedScene, measures: Sequence[str]) -> bool:
    """Return whether the runs of two scenes give the same, by all measures: within what seeds do, or SAME_WITHIN."""
    compared = 0
    for measure in measures:
        for arm in ARMS:
            blocks = [select_arm(one.table, arm, measure) for one in (scene, other)]
            differences = (blocks[0].mean() - blocks[1].mean()).abs().dropna()
            spread = pd.concat([block.max() - block.min() for block in blocks], axis=1).max(axis=1)
            if (differences > spread.reindex(differences.index).clip(lower=SAME_WITHIN)).any():
                return False
            compared += len(differences)
    return compared > 0


def _judge_over_scenes(claim: Claim, scenes: Sequence[JudgedScene], same: Sequence[JudgedScene]) -> Verdict:
    """Judge whether each claim named holds on every shape; on too few shapes nothing is decided."""
    counts = tuple(_count_claim(claim, name, scenes) for name in _list_counted(claim, scenes))
    left_out = tuple(scene.name for scene in same)
    verdict = Verdict(
        claim.name, claim.statement, counts=counts, left_out=left_out,
        measured=", ".join(count.words for count in counts) if scenes else "no other scenes",
        disagrees=tuple(filter(None, map(_describe_against, counts))),
        seeds=min((scene.verdict(name).seeds for scene in scenes for name in claim.claims), default=0),
    )  # fmt: skip
    unrun = [scene for scene in scenes if any(scene.verdict(name).word == NOT_RUN for name in claim.claims)]
    if len(scenes) < LEAST_SCENES or not counts:
        return replace(verdict, note=f"Needs {LEAST_SCENES} scenes beside the calibrated one, has {len(scenes)}.")
    if unrun:
        return replace(verdict, note=f"Not all runs are there on {', '.join(scene.name for scene in unrun)}.")
    agrees = all(count.holds == len(count.by_shape) for count in counts)
    verdict = replace(verdict, word=INCONCLUSIVE, agrees=agrees, note=_describe_left_out(claim, counts, left_out))
    shapes = len(counts[0].by_shape)
    if shapes < LEAST_SHAPES:
        few = f"{shapes} shape{'s' * (shapes > 1)} decide{'s' * (shapes == 1)} nothing, {LEAST_SHAPES} are needed."
        return replace(verdict, note=f"{few} {verdict.note}".rstrip())
    contradicted = any(count.holds == 0 for count in counts)
    return replace(verdict, word=CONTRADICTED if contradicted else REPRODUCED if agrees else INCONCLUSIVE)


def _list_counted(claim: Claim, scenes: Sequence[JudgedScene]) -> list[str]:
    """List the claims to be counted: one that has the same numbers as another one in every scene is counted once."""
    same = {name: {scene.verdict(name).same_as for scene in scenes} for name in claim.claims}
    return [name for name in claim.claims if not (len(same[name]) == 1 and same[name] <= set(claim.claims))]


def _count_claim(claim: Claim, name: str, scenes: Sequence[JudgedScene]) -> Count:
    """Count the scenes that agree with the claim ``name``, by shape; scenes without numbers do not count."""
    margins: dict[str, list[float]] = {}
    for scene in scenes:
        margin = scene.verdict(name).margin
        if margin is not None:
            margins.setdefault(scene.shape, []).append(margin)
    by_shape = []
    for shape, values in margins.items():
        agree = sum(margin > 0 for margin in values)
        holds = agree > claim.threshold * len(values)
        by_shape.append(ShapeCount(shape, agree, len(values), holds, min(values), max(values)))
    return Count(name, tuple(by_shape), tuple(scene.name for scene in scenes if scene.verdict(name).agrees is False))


def _describe_against(count: Count) -> str:
    """Describe the shapes on which a claim does not hold; empty if there are none."""
    shapes = [f"{shape.shape} ({shape.agree} of {shape.scenes})" for shape in count.by_shape if not shape.holds]
    return f"{count.claim}: {', '.join(shapes)}" if shapes else ""


def _describe_left_out(claim: Claim, counts: Sequence[Count], left_out: Sequence[str]) -> str:
    """Describe which scenes and claims are not counted, and why; empty if all are."""
    once = [name for name in claim.claims if name not in [count.claim for count in counts]]
    parts = []
    if once:
        parts.append(f"{', '.join(once)}: the same numbers as another claim in every scene, counted once.")
    if left_out:
        parts.append(f"Left out, as they give the same as the calibrated scene: {', '.join(left_out)}.")
    return " ".join(parts)
