"""The answer in three columns: which claims hold, which hold only under a condition, and which do not.

The rule goes by the words of the verdicts over all scenes that claims are judged by, and by the readings of the paper
that were tried on one scene with pressures of their own (``evidence.fitted``).  A claim is lost under a reading if the
numbers of every three pressures disagree with it; one over scenes, if a claim that it sums up is lost.

- holds: REPRODUCED in each scene, in one at least whose pressures were not chosen by the claim's own runs, and lost
  under no reading;
- does not hold: REPRODUCED in none, and CONTRADICTED in one or more;
- not decided: neither in any of them, or no runs;
- holds only if: all else, with the scenes in which it holds, and the readings under which it is lost, as the condition.

That readings count was added, as the stricter rule, when their results were known: it took four claims out of "holds".
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..settings.question import Claim
from .claims import CONTRADICTED, NOT_RUN, REPRODUCED, Verdict
from .gather import Evidence

HOLDS, ONLY_IF, NOT, OPEN = "holds", "holds only if", "does not hold", "not decided"
MOST_NAMED = 3  # scenes; of more it is said how many they are


@dataclass(frozen=True)
class Finding:
    """The verdict on a claim in one scene, or over scenes; ``where``: the scene, in words."""

    where: str
    verdict: Verdict

    @property
    def is_test(self) -> bool:
        """Whether the claim is reproduced without a choice of pressures that made it so."""
        return self.verdict.word == REPRODUCED and not self.verdict.calibrated


@dataclass(frozen=True)
class Answer:
    """In which column a claim stands, and ``why``: the scenes and readings that put it there, in words."""

    claim: Claim
    column: str
    why: str


def answer_claims(judged: Sequence[Evidence], lost: Mapping[str, Sequence[str]]) -> list[Answer]:
    """Sort the claims into the columns by the verdicts of some experiments; see the module's rule.

    ``lost``: the readings under which a claim is lost, in words, by its name.
    """
    claims = judged[0].runs[0].config.question.claims.list
    findings = {
        claim.name: [found for evidence in judged for found in find_verdicts(claim, evidence)] for claim in claims
    }
    return [sort_claim(claim, findings[claim.name], list_losing_readings(claim, lost)) for claim in claims]


def list_losing_readings(claim: Claim, lost: Mapping[str, Sequence[str]]) -> list[str]:
    """List the readings under which a claim is lost, or one that it sums up; ``lost``: by the names of claims."""
    names = claim.claims or [claim.name]
    return list(dict.fromkeys(reading for name in names for reading in lost.get(name, ())))


def find_verdicts(claim: Claim, evidence: Evidence) -> list[Finding]:
    """Find the verdicts of an experiment on a claim: of each of its scenes, or the one over all, if it has others."""
    if claim.test == "scenes":
        judged = [verdict for verdict in evidence.over_scenes if verdict.claim == claim.name]
        return [Finding("other scenes", verdict) for verdict in judged if verdict.word != NOT_RUN]
    name = f"{evidence.experiment.figure}, " if evidence.experiment.figure else ""
    return [Finding(f"{name}{scene.name}", scene.verdict(claim.name)) for scene in evidence.scenes]


def sort_claim(claim: Claim, findings: Sequence[Finding], lost: Sequence[str] = ()) -> Answer:
    """Sort a claim into a column by its verdicts, and by the readings under which it is ``lost``, in words."""
    reproduced = [each for each in findings if each.verdict.word == REPRODUCED]
    contradicted = [each for each in findings if each.verdict.word == CONTRADICTED]
    others = [each for each in findings if each not in reproduced and each not in contradicted]
    tests = [each for each in reproduced if each.is_test]
    chosen = [each for each in reproduced if not each.is_test]
    if not reproduced:
        why = _describe([("contradicted on", contradicted), ("open on", others)])
        return Answer(claim, NOT if contradicted else OPEN, why)
    against = _describe([("not on", contradicted), ("open on", others)], lost)
    if not tests:
        first = _describe([("the pressures are chosen for it, as on", chosen)])
    elif against:
        first = _describe([("it is on", reproduced)])
    else:
        first = _describe([("on", tests), ("by choice of the pressures on", chosen)])
    return Answer(claim, ONLY_IF if against or not tests else HOLDS, "; ".join(filter(None, (first, against))))


def _describe(groups: Sequence[tuple[str, Sequence[Finding]]], lost: Sequence[str] = ()) -> str:
    """Describe groups of scenes, each behind its words, and the readings that lose a claim, without what is empty."""
    places = [f"{words} {_list_places(group)}" for words, group in groups if group]
    return "; ".join([*places, *([f"not if the paper is read so: {', or '.join(lost)}"] if lost else [])])


def _list_places(findings: Sequence[Finding]) -> str:
    """List scenes by name, or count them where they are many: each once, also if a figure shows it too."""
    places = list(dict.fromkeys(each.where for each in findings))
    if len(places) <= MOST_NAMED:
        return " and ".join(places)
    return f"{len({place.rpartition(', ')[2] for place in places})} scenes"
