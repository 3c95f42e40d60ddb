"""What measures do as the grid is refined: their steps, the order of these, and where they seem to go.

The rule is Roache's for three grids (P. J. Roache, Verification and Validation in Computational Science and
Engineering, 1998): steps that shrink by a constant factor have an order, by which the value at no spacing is
extrapolated; its band is a safety factor times the way from the finest grid to there.  Steps that do not shrink have
neither.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from ..settings.case import ARMS
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


@dataclass(frozen=True)
class Trend:
    """A measure over grids that are finer and finer.

    ``spacings``: of the grids, falling; ``values``: the mean over seeds on each, NaN without a result; ``spread``: the
    most that seeds differ by on a grid; ``least``: a step up to which is none.
    """

    spacings: tuple[float, ...]
    values: tuple[float, ...]
    spread: float = 0.0
    least: float = LEAST_STEP

    @property
    def steps(self) -> tuple[float, ...]:
        """By how much the value changes from each grid to the next finer one."""
        return tuple(float(step) for step in np.diff(self.values))

    @property
    def moves(self) -> bool:
        """Whether one of the last two steps is more than seeds differ by, and more than none."""
        return max((abs(step) for step in self.steps[-2:]), default=0.0) > max(self.spread, self.least)

    @property
    def order(self) -> float:
        """The order at which the last two steps shrink; NaN where they hardly do, or the grids are uneven."""
        if len(self.steps) < 2 or not self.moves:
            return math.nan
        before, last = self.steps[-2:]
        ratios = [wide / narrow for wide, narrow in zip(self.spacings[-3:-1], self.spacings[-2:], strict=True)]
        if not math.isclose(*ratios) or before * last <= 0:
            return math.nan
        order = math.log(before / last) / math.log(ratios[0])
        return order if order >= LEAST_ORDER else math.nan

    @property
    def limit(self) -> tuple[float, float]:
        """The value extrapolated to no spacing, and the band to either side of it; NaN without an order."""
        ratio = self.spacings[-2] / self.spacings[-1] if len(self.spacings) > 1 else math.nan
        way = self.steps[-1] / (ratio**self.order - 1) if self.steps else math.nan
        return self.values[-1] + way, SAFETY * abs(way)

    @property
    def words(self) -> str:
        """What the steps say."""
        if np.isnan(self.values).any() or len(self.values) < 3:
            return "not run on three grids"
        if not self.moves:
            return "moves by no more than seeds differ"
        if math.isnan(self.order):
            before, last = self.steps[-2:]
            if before * last <= 0:
                return "does not converge: it goes to and fro"
            return f"does not converge: steps {'hardly' if abs(last) < abs(before) else 'do not'} shrink"
        limit, band = self.limit
        return f"order {self.order:.1f}, towards {limit:.2f} ± {band:.2f}"


@dataclass(frozen=True)
class Refinement:
    """One set of choices on grids that are finer and finer.

    ``changes``: of the choices, value by key, without grid and seed; ``trends``: by arm, pressure and measure;
    ``halves``: by spacing, the bracket of the pressure at which half is in lumps.
    """

    changes: Mapping[str, object]
    trends: Mapping[tuple[str, float, str], Trend]
    halves: Mapping[float, Crossing] = field(default_factory=dict)


def follow_grids(evidence: Evidence) -> list[Refinement]:
    """Follow the measures of an experiment's runs over its grids, apart for each set of other choices."""
    base = evidence.runs[0].case.fidelity.dx
    choices: dict[tuple, list[Variant]] = {}
    for variant in compare_variants(evidence).variants:
        others = {key: value for key, value in variant.changes.items() if key not in (SPACING, SEED)}
        choices.setdefault(tuple(others.items()), []).append(variant)
    return [_follow_choice(dict(others), variants, base) for others, variants in choices.items()]


def _follow_choice(changes: Mapping[str, object], variants: Sequence[Variant], base: float) -> Refinement:
    """Follow the measures of the variants that differ in grid and seed alone; ``base``: spacing where none is said."""
    spacings = sorted({float(variant.changes.get(SPACING, base)) for variant in variants}, reverse=True)
    tables = {dx: _join_rows(variants, dx, base) for dx in spacings}
    pressures = sorted({pressure for variant in variants for pressure in variant.pressures})
    trends = {
        (arm, pressure, measure): _make_trend(
            {dx: select_arm(table, arm, measure) for dx, table in tables.items()}, pressure, measure
        )
        for arm in ARMS
        for pressure in pressures
        for measure in MEASURES
    }
    halves = {dx: bracket_half(select_arm(table, ARMS[0], "lump_fraction").dropna()) for dx, table in tables.items()}
    return Refinement(changes, trends, halves)


def _join_rows(variants: Sequence[Variant], spacing: float, base: float) -> pd.DataFrame:
    """Join the rows of the variants on the grid of one spacing; there the seeds differ."""
    tables = [variant.table for variant in variants if float(variant.changes.get(SPACING, base)) == spacing]
    return pd.concat(tables)


def _make_trend(grids: Mapping[float, pd.DataFrame], pressure: float, measure: str) -> Trend:
    """Make the trend of a measure at one pressure; ``grids``: its values (seeds, pressures) by spacing, falling."""
    columns = [values.get(pressure, pd.Series(dtype=float)).dropna() for values in grids.values()]
    spread = max((float(np.ptp(column)) for column in columns if len(column)), default=0.0)
    means = tuple(float(column.mean()) for column in columns)
    least = LEAST_STEP if measure in PARTS else LEAST_STEP * max(map(abs, means), default=0.0)
    return Trend(tuple(grids), means, spread, least)
