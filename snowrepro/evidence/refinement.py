"""What measures do as grid or time step is refined: their steps, the order of these, and where they seem to go.

The rule is Roache's for three grids (P. J. Roache, Verification and Validation in Computational Science and
Engineering, 1998): steps that shrink by a constant factor have an order, by which the value at no spacing is
extrapolated; its band is a safety factor times the way from the finest grid to there.  Steps that do not shrink have
neither.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any, Literal

import numpy as np
import pandas as pd

from ..settings.case import ARMS, Case
from .calibration import Crossing, bracket_half
from .claims import select_arm
from .gather import Evidence
from .variants import Variant, compare_variants

SPACING, SEED = "fidelity.dx", "seed"
SAFETY = 1.25  # Roache's, for three grids
LEAST_ORDER = 0.5  # of steps that count as shrinking: with less the value extrapolated is far from all that was run
LEAST_STEP = 0.005  # of a share, as for variants: less is no step
# What is followed, in words.
MEASURES = {
    "lump_fraction": "lumps",
    "crushed_fraction": "crushed",
    "loose_fraction": "loose",
    "flattening_end": "height lost",
    "hardening_at_release": "hardening at release",
}
SHARES = ("lump_fraction", "crushed_fraction", "loose_fraction")  # of the mass
PARTS = (*SHARES, "flattening_end")  # from 0 to 1, and drawn
Outcome = Literal["not run", "none", "shrink", "do not shrink"]  # what becomes of steps


@dataclass(frozen=True)
class Trend:
    """A measure over grids that are finer and finer, or over time steps.

    ``levels``: spacings of the grids, or CFL numbers, falling; ``values``: the mean over seeds at each, NaN without a
    result; ``spread``: the most that seeds differ by at a level, NaN with one seed at each; ``least``: a step up to
    which is none.
    """

    levels: tuple[float, ...]
    values: tuple[float, ...]
    spread: float = 0.0
    least: float = LEAST_STEP

    def items(self) -> Iterator[tuple[float, float]]:
        """Each level with its value."""
        return zip(self.levels, self.values, strict=True)

    @property
    def steps(self) -> tuple[float, ...]:
        """By how much the value changes from each level to the next finer one."""
        return tuple(float(step) for step in np.diff(self.values))

    @property
    def moves(self) -> bool:
        """Whether one of the last two steps is more than seeds differ by, and more than none."""
        return max((abs(step) for step in self.steps[-2:]), default=0.0) > float(np.nanmax([self.spread, self.least]))

    @property
    def order(self) -> float:
        """The order at which the last two steps shrink; NaN where they hardly do, or the levels are uneven."""
        if len(self.steps) < 2 or not self.moves:
            return math.nan
        before, last = self.steps[-2:]
        ratios = [wide / narrow for wide, narrow in zip(self.levels[-3:-1], self.levels[-2:], strict=True)]
        if not math.isclose(*ratios) or before * last <= 0:
            return math.nan
        order = math.log(before / last) / math.log(ratios[0])
        return order if order >= LEAST_ORDER else math.nan

    @property
    def limit(self) -> tuple[float, float]:
        """The value extrapolated to level 0, and the band to either side of it; NaN without an order."""
        ratio = self.levels[-2] / self.levels[-1] if len(self.levels) > 1 else math.nan
        way = self.steps[-1] / (ratio**self.order - 1) if self.steps else math.nan
        return self.values[-1] + way, SAFETY * abs(way)

    @property
    def outcome(self) -> Outcome:
        """What becomes of the last two steps."""
        if np.isnan(self.values[-3:]).any() or len(self.values) < 3:
            return "not run"
        if not self.moves:
            return "none"
        return "do not shrink" if math.isnan(self.order) else "shrink"

    @property
    def words(self) -> str:
        """What the steps say."""
        if self.outcome == "not run":
            return "not all were run"
        if self.outcome == "none":
            return "hardly moves" if math.isnan(self.spread) else "moves by no more than seeds differ"
        if self.outcome == "do not shrink":
            before, last = self.steps[-2:]
            if before * last <= 0:
                return "does not converge: it goes to and fro"
            return f"does not converge: steps {'hardly' if abs(last) < abs(before) else 'do not'} shrink"
        limit, band = self.limit
        return f"order {self.order:.1f}, towards {limit:.2f} ± {band:.2f}"


@dataclass(frozen=True)
class Refinement:
    """One set of choices with a setting that is finer and finer.

    ``changes``: of the choices, value by key, without that setting and the seed; ``trends``: by arm, pressure and
    measure; ``halves``: by level of the setting, the bracket of the pressure at which half is in lumps.
    """

    changes: Mapping[str, Any]
    trends: Mapping[tuple[str, float, str], Trend]
    halves: Mapping[float, Crossing] = field(default_factory=dict)


def follow_setting(evidence: Evidence, key: str = SPACING, measures: Iterable[str] = MEASURES) -> list[Refinement]:
    """Follow measures of an experiment's runs as the setting ``key`` falls, apart for each set of other choices.

    Every set has all levels of the setting that any of them has, with NaN where it was not run.
    """
    base = read_setting(evidence.runs[0].case, key)
    levels = sorted({read_setting(run.case, key) for run in evidence.runs}, reverse=True)
    choices: dict[tuple, dict[float, list[Variant]]] = {}
    for variant in compare_variants(evidence).variants:
        others = {name: value for name, value in variant.changes.items() if name not in (key, SEED)}
        by_level = choices.setdefault(tuple(others.items()), {level: [] for level in levels})
        by_level[float(variant.changes.get(key, base))].append(variant)
    return [_follow_choice(dict(others), by_level, list(measures)) for others, by_level in choices.items()]


def read_setting(case: Case, key: str) -> float:
    """Read a setting of a case that is a number, by its key."""
    return float(attrgetter(key)(case))


def _follow_choice(
    changes: Mapping[str, Any], by_level: Mapping[float, Sequence[Variant]], measures: Sequence[str]
) -> Refinement:
    """Follow measures of variants that differ in one setting and the seed alone; ``by_level``: of it, falling."""
    tables = {level: _join_rows(variants) for level, variants in by_level.items()}
    pressures = sorted({pressure for variants in by_level.values() for its in variants for pressure in its.pressures})
    trends = {
        (arm, pressure, measure): _make_trend(
            {level: select_arm(table, arm, measure) for level, table in tables.items()}, pressure, measure
        )
        for arm in ARMS
        for pressure in pressures
        for measure in measures
    }
    lumps = {level: select_arm(table, ARMS[0], "lump_fraction").dropna() for level, table in tables.items()}
    return Refinement(changes, trends, {level: bracket_half(values) for level, values in lumps.items()})


def _join_rows(variants: Sequence[Variant]) -> pd.DataFrame:
    """Join the rows of variants that differ in the seed alone."""
    return pd.concat([variant.table for variant in variants]) if variants else pd.DataFrame()


def _make_trend(levels: Mapping[float, pd.DataFrame], pressure: float, measure: str) -> Trend:
    """Make the trend of a measure at one pressure; ``levels``: its values (seeds, pressures) by level, falling."""
    columns = [values.get(pressure, pd.Series(dtype=float)).dropna() for values in levels.values()]
    spread = max((float(np.ptp(column)) for column in columns if len(column) > 1), default=math.nan)
    means = tuple(float(column.mean()) for column in columns)
    least = LEAST_STEP if measure in PARTS else LEAST_STEP * float(np.nanmax(np.abs([0.0, *means])))
    return Trend(tuple(levels), means, spread, least)
