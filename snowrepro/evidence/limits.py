"""Which measures have a limit as grid and time step get finer, and with which other choices their steps shrink.

A sequence is one measure at one pressure as one of the two gets finer, with all else held.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from ..settings.case import ARMS
from .gather import Evidence
from .refinement import SPACING, Outcome, Trend, follow_setting, read_setting

STEP = "solver.cfl"  # the time step is in proportion to it
REFINED = {SPACING: STEP, STEP: SPACING}  # what gets finer, and what is held meanwhile
# What is followed, in words.
MEASURES = {
    "strain_at_gauge": "strain at the gauge",
    "hardening_at_release": "hardening at release",
    "flattening_end": "height lost",
    "lump_fraction": "lumps",
}
Choice = tuple[tuple[str, object], ...]  # changes of other settings, key and value; empty: as in the first run


@dataclass(frozen=True)
class Descent:
    """A sequence of sintered snow: ``measure`` at ``pressure`` as the setting ``along`` falls.

    ``held``: the value of the other setting that is refined; ``choice``: of all others; ``trend``: what it does.
    """

    along: str
    held: float
    choice: Choice
    pressure: float
    measure: str
    trend: Trend

    @property
    def question(self) -> tuple[str, float, float, str]:
        """What it has in common with the sequences of other choices."""
        return self.along, self.held, self.pressure, self.measure


def list_descents(evidence: Evidence) -> list[Descent]:
    """List the sequences of an experiment's sintered runs, over cells first, and over time steps."""
    first = evidence.runs[0].case
    return [
        Descent(
            along,
            float(refinement.changes.get(held, read_setting(first, held))),
            tuple((key, value) for key, value in refinement.changes.items() if key != held),
            pressure,
            measure,
            trend,
        )
        for along, held in REFINED.items()
        for refinement in follow_setting(evidence, along, MEASURES)
        for (arm, pressure, measure), trend in refinement.trends.items()
        if arm == ARMS[0]
    ]


def count_outcomes(descents: Sequence[Descent]) -> Counter[Outcome]:
    """Count what becomes of the steps of sequences."""
    return Counter(descent.trend.outcome for descent in descents)


def list_choices(descents: Sequence[Descent]) -> list[Choice]:
    """List the other choices of sequences, in their order."""
    return list(dict.fromkeys(descent.choice for descent in descents))


def compare_choices(descents: Sequence[Descent]) -> dict[Choice, Counter[Outcome]]:
    """Count what becomes of steps by choice, among the sequences that were run with every choice."""
    choices = list_choices(descents)
    run_with = Counter(descent.question for descent in descents if descent.trend.outcome != "not run")
    common = [descent for descent in descents if run_with[descent.question] == len(choices)]
    return {choice: count_outcomes([its for its in common if its.choice == choice]) for choice in choices}


def measure_reach(descents: Sequence[Descent], choice: Choice, measure: str) -> float:
    """Measure by how much a measure differs with one choice from that with the first, at most, where both were run.

    NaN if they never were.
    """
    usual, own = (
        {(its.question, level): value for its in descents if its.choice == each for level, value in its.trend.items()}
        for each in (list_choices(descents)[0], choice)
    )
    differences = [abs(value - usual[key]) for key, value in own.items() if key in usual and key[0][3] == measure]
    return max(filter(math.isfinite, differences), default=math.nan)
