"""Pressures read off a rising curve: the three that the paper does not print, and that at which half is in lumps."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.optimize import isotonic_regression

from ..analysis.statistics import draw_resamples
from ..settings.case import ARMS
from ..summary.row import ARM

HALF = 0.5
BELOW, BEYOND = 0.0, np.inf  # for a target below the lowest, or beyond the highest pressure that was run


@dataclass(frozen=True)
class Crossing:
    """The pressure P50 at which half of the mass is in lumps, with its interval; None where there is none.

    An end of the interval that is 0 or infinity lies outside the pressures that were run.  ``note`` says why there is
    no pressure.
    """

    pressure: float | None = None
    low: float | None = None
    high: float | None = None
    seeds: int = 0
    note: str = ""


def calibrate_pressures(table: pd.DataFrame, targets: Sequence[float]) -> list[float | None]:
    """Find the pressures at which the lump fraction of sintered snow first reaches each target.

    ``table``: rows of runs.  A rising curve is fitted to lump fraction over log pressure (isotonic regression; seeds
    are averaged) and read by linear interpolation; two significant digits.  None where the curve does not cross a
    target.
    """
    sintered = table[table[ARM] == ARMS[0]]
    curve = fit_rising_curve(sintered.groupby("pressure")["lump_fraction"].mean().sort_index())
    pressures = [_find_crossing(curve, target) for target in targets]
    return [float(f"{pressure:.2g}") if BELOW < pressure < BEYOND else None for pressure in pressures]


def fit_rising_curve(means: pd.Series) -> pd.Series:
    """Fit the rising curve nearest to means by pressure; pressure 0 has no logarithm and is left out."""
    means = means[means.index > 0]
    return pd.Series(isotonic_regression(means.to_numpy()).x, means.index) if len(means) else means


def find_half_pressure(blocks: pd.DataFrame, alpha: float) -> Crossing:
    """Find P50 of the lump fractions (seeds, pressures) of one arm, with an interval by a bootstrap over seeds.

    There is none where the curve does not cross 1/2 between two pressures, or is 1/2 at several.
    """
    if blocks.empty:
        return Crossing(note="no runs")
    curve, seeds = fit_rising_curve(blocks.mean()), len(blocks)
    if np.isclose(curve, HALF).sum() > 1:
        return Crossing(seeds=seeds, note="ambiguous: 1/2 at several pressures")
    pressure = _find_crossing(curve, HALF)
    if not BELOW < pressure < BEYOND:
        side = "half or more" if pressure == BELOW else "less than half"
        return Crossing(seeds=seeds, note=f"not crossed: {side} in lumps at every pressure")
    if seeds < 2:
        return Crossing(pressure, seeds=seeds)
    rows = blocks.to_numpy()[np.lexsort(blocks.to_numpy().T)]  # the order of the seeds does not matter
    means = rows[draw_resamples(seeds)].mean(axis=1)
    different_means, times = np.unique(means, axis=0, return_counts=True)
    ends = [_find_crossing(fit_rising_curve(pd.Series(mean, blocks.columns)), HALF) for mean in different_means]
    low, high = np.quantile(np.repeat(ends, times), [alpha / 2, 1 - alpha / 2], method="inverted_cdf")
    return Crossing(pressure, float(low), float(high), seeds)


def _find_crossing(curve: pd.Series, target: float) -> float:
    """Find the pressure at which a rising curve first reaches a target; BELOW or BEYOND where the curve does not."""
    values, logs = curve.to_numpy(), np.log(curve.index.to_numpy(dtype=float))
    above = np.flatnonzero(values >= target)
    if len(above) == 0:
        return BEYOND
    i = above[0]
    if i == 0:
        return BELOW
    share = (target - values[i - 1]) / (values[i] - values[i - 1])
    return float(np.exp(logs[i - 1] + share * (logs[i] - logs[i - 1])))
