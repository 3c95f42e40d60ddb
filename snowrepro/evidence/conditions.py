"""One condition of the snow beside another, such as its material or temperature: what holds under each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress

from ..settings.case import ARMS
from .claims import REPRODUCED
from .collect import NOT_FURTHER, CollectedSweep
from .gather import Evidence

NO_CONDITIONS = (*NOT_FURTHER, "variant")  # where, how hard and from which random places: each condition has all


@dataclass(frozen=True)
class Condition:
    """The runs of one condition.  ``values``: of the settings that make it, by their names; ``evidence``: of its runs.

    The pressures were chosen with the first condition, so only there can a claim hold by calibration.
    """

    values: Mapping[str, object]
    evidence: Evidence


@dataclass(frozen=True)
class Standing:
    """Under which conditions a claim is reproduced (``holding``), is not (``against``), and could not be judged."""

    holding: Sequence[Condition]
    against: Sequence[Condition]
    unjudged: Sequence[Condition]


def split_conditions(evidence: Evidence) -> list[Condition]:
    """Split runs by the settings in which they differ but for scene, sintering, pressure and seed; in their order.

    Where they differ in nothing else there is one condition, without values.
    """
    sweep = evidence.sweep
    names = [name for name in sweep.varied if name not in NO_CONDITIONS]
    groups: dict[tuple, list[int]] = {}
    for number, row in enumerate(sweep.table.to_dict("records")):
        groups.setdefault(tuple(row[name] for name in names), []).append(number)
    return [
        Condition(dict(zip(names, values, strict=True)), _select_runs(evidence, sweep, rows, is_first=not number))
        for number, (values, rows) in enumerate(groups.items())
    ]


def _select_runs(evidence: Evidence, sweep: CollectedSweep, rows: Sequence[int], is_first: bool) -> Evidence:
    """Select the runs of some rows of a sweep with what they gave."""
    runs = [sweep.runs[row] for row in rows]
    table = evidence.table
    if len(table):
        table = table[table["run_id"].isin([run.id for run in runs])]
    experiment = evidence.experiment if is_first else evidence.experiment.model_copy(update={"calibrated_on": None})
    return replace(evidence, experiment=experiment, runs=runs, table=table)


def find_where_claims_hold(conditions: Sequence[Condition]) -> dict[str, dict[str, Standing]]:
    """Find by scene and claim how the claim stands; no claim that could be judged under no condition.

    A claim that holds by calibration under a condition has a star behind its name.
    """
    standings: dict[str, dict[str, Standing]] = {}
    for number, scene in enumerate(conditions[0].evidence.scenes):
        for place, first in enumerate(scene.verdicts):
            verdicts = [each.evidence.scenes[number].verdicts[place] for each in conditions]
            holds = [verdict.word == REPRODUCED for verdict in verdicts]
            is_unjudged = [verdict.agrees is None for verdict in verdicts]
            is_against = [not (one or other) for one, other in zip(holds, is_unjudged, strict=True)]
            if all(is_unjudged):
                continue
            is_chosen = any(verdict.calibrated for verdict in compress(verdicts, holds))
            standings.setdefault(scene.name, {})[first.claim + "*" * is_chosen] = Standing(
                *(list(compress(conditions, chosen)) for chosen in (holds, is_against, is_unjudged))
            )
    return standings


def is_mostly_settled(condition: Condition) -> bool:
    """Whether the snow had settled at the end of half or more of the runs that have a result; also if none has."""
    table = condition.evidence.table
    return not len(table) or float(table["settled"].astype(float).mean()) >= 0.5


def list_arms(conditions: Sequence[Condition]) -> list[str]:
    """List the arms that were asked for: sintered, unsintered."""
    arms = {run.case.arm for condition in conditions for run in condition.evidence.runs}
    return [arm for arm in ARMS if arm in arms]
