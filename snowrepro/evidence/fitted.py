"""Which reading?  Each with pressures of its own: how many sentences of the paper it can keep, and which one wins.

The rule is that of experiments/fitted.yaml, written down before any of its runs.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import pandas as pd

from ..settings.case import ARMS
from ..settings.question import Claim, Claims
from .calibration import Crossing, bracket_half_of_runs
from .choices import BY_LUMPS, CHOICE, LUMPS, judge_choices, list_judged
from .gather import Evidence
from .variants import Changes, list_changes

READING = "reading"
# The mass in lumps by each definition of a lump: that of the run, and the others that each row has.
DEFINITIONS = {
    "strain": LUMPS,
    "bonds": "lumps_by_bonds",
    "proximity": "lumps_by_proximity",
    "grid": "lumps_by_grid",
    "damage": "lumps_by_damage",
}


@dataclass(frozen=True)
class FittedReading:
    """What a reading keeps of the paper at the best of its pressures.

    ``changes``: of the base, value by key; ``kept``: sentences that hold together at the ``best`` three pressures, the
    first of them; ``reach`` and ``known``: how many threes keep as many, and how many have all runs; ``definitions``:
    of a lump, by which C1 to C5 hold at some three; ``half``: P50 with sintering; ``never``: claims that hold at none.
    """

    changes: Changes
    kept: int
    best: tuple[float, ...]
    reach: int
    known: int
    definitions: tuple[str, ...]
    half: Crossing
    never: tuple[str, ...]

    @property
    def share(self) -> float:
        """The part of the threes that keep as many sentences as the best; 0 without any that is known."""
        return self.reach / self.known if self.known else 0.0


@dataclass(frozen=True)
class Fitting:
    """The readings of an experiment, the base first.

    ``table``: a row for each run, with its reading (a number: which of ``readings``), arm, pressure, state and the
    claims' measures, NaN without a result; ``sentences``: how many the paper has.
    """

    table: pd.DataFrame
    readings: Sequence[FittedReading]
    sentences: int

    @property
    def pressures(self) -> list[float]:
        """The pressures, rising."""
        return sorted(self.table["pressure"].unique())

    def rank(self) -> list[FittedReading]:
        """Rank the readings that have any three with all runs: the one that the rule chooses first."""
        known = [each for each in self.readings if each.known]
        return sorted(known, key=lambda each: (-each.kept, -len(each.definitions), -each.share))  # stable: base first

    def list_lost(self) -> dict[str, list[Changes]]:
        """List the readings under which a claim is lost, by the name of the claim: no three pressures agree with it."""
        names = dict.fromkeys(name for each in self.readings for name in each.never)
        return {name: [each.changes for each in self.readings if name in each.never] for name in names}

    def measure_moves(self) -> pd.Series:
        """Measure by how much each reading moves the mass in lumps of sintered snow from that of the base.

        Without sign, the mean over the pressures at which both have a result; NaN without any.  The larger, the more a
        reader who wants the same snow has to know it.
        """
        lumps = self.spread(ARMS[0], LUMPS)
        return (lumps - lumps.loc[0]).abs().mean(axis=1)

    def spread(self, arm: str, measure: str) -> pd.DataFrame:
        """Spread a measure of an arm over (reading, pressure), both in order; NaN without a result."""
        own = self.table[self.table["arm"] == arm].astype({measure: float})
        spread = own.pivot_table(index=READING, columns="pressure", values=measure)
        return spread.reindex(index=range(len(self.readings)), columns=self.pressures)


def fit_readings(evidence: Evidence) -> Fitting:
    """Fit pressures to each reading of an experiment: see the module's first lines."""
    claims = evidence.runs[0].config.question.claims
    changes = [tuple(list_changes(run, evidence.runs[0]).items()) for run in evidence.sweep.runs]
    readings = list(dict.fromkeys(changes))
    numbers = [readings.index(each) for each in changes]
    arms = [run.case.arm for run in evidence.sweep.runs]
    table = evidence.sweep.table.reindex(columns=_list_columns(claims)).assign(**{READING: numbers, "arm": arms})
    return fit_table(claims, table, [dict(each) for each in readings])


def fit_table(claims: Claims, table: pd.DataFrame, readings: Sequence[Changes]) -> Fitting:
    """Fit pressures to readings by the rows of their runs; ``table``: as ``Fitting`` has it."""
    choices = judge_choices(claims, table, [READING])
    lumpy = {name: _find_lumpy(claims, table, column) for name, column in DEFINITIONS.items()}
    fitted = [
        _fit_reading(
            changes,
            choices[choices[READING] == number],
            claims,
            [name for name, found in lumpy.items() if number in found],
            table[table[READING] == number],
        )
        for number, changes in enumerate(readings)
    ]
    return Fitting(table, fitted, len(group_sentences(claims)))


def _list_columns(claims: Claims) -> list[str]:
    """List the columns of a run's row that readings are judged by."""
    measures = {claim.measure: None for claim in list_judged(claims)}
    return [*dict.fromkeys(["run_id", "state", "pressure", "seed", *measures, *DEFINITIONS.values()])]


def group_sentences(claims: Claims) -> list[list[Claim]]:
    """Group the claims of one scene by the sentence of the paper that they are about."""
    groups: dict[str, list[Claim]] = {}
    for claim in list_judged(claims):
        groups.setdefault(claim.paper, []).append(claim)
    return list(groups.values())


def _find_lumpy(claims: Claims, table: pd.DataFrame, column: str) -> set[int]:
    """Find the readings for which all claims on lumps hold at some three pressures, with lumps as a column has them."""
    if table[column].isna().all():
        return set()
    judged = judge_choices(claims, table.assign(**{LUMPS: table[column]}), [READING])
    return set(judged.loc[judged[BY_LUMPS].fillna(False), READING])


def _fit_reading(
    changes: Changes, choices: pd.DataFrame, claims: Claims, definitions: Iterable[str], table: pd.DataFrame
) -> FittedReading:
    """Find what a reading keeps.  ``choices``: its threes, judged; ``table``: its runs."""
    names = [claim.name for claim in list_judged(claims)]
    whole = choices[choices[names].notna().all(axis=1)]
    kept = sum(
        (whole[[claim.name for claim in group]].eq(True).all(axis=1).astype(int) for group in group_sentences(claims)),
        pd.Series(0, whole.index),
    )
    best = whole[kept == kept.max()]
    return FittedReading(
        changes=changes,
        kept=int(kept.max()) if len(whole) else 0,
        best=tuple(best[list(CHOICE)].iloc[0]) if len(best) else (),
        reach=len(best),
        known=len(whole),
        definitions=tuple(definitions),
        half=bracket_half_of_runs(table[table["arm"] == ARMS[0]]),
        never=tuple(name for name in names if len(whole) and not whole[name].eq(True).any()),
    )
