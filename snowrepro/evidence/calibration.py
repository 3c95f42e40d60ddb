"""Pressures from lump fractions: the three that the paper does not print, and between which half is in lumps."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile

import numpy as np
import pandas as pd
from scipy.optimize import isotonic_regression

from ..settings.case import ARMS
from ..summary.row import ARM

HALF = 0.5


@dataclass(frozen=True)
class Crossing:
    """Where half of the mass is in lumps: between the pressures ``low`` and ``high``, both run, in every seed.

    ``low``: at it and at every lower pressure all seeds have less than half in lumps; ``high``: at it and at every
    higher one all have more.  None where there is no such pressure.  ``note`` says why nothing is known.
    """

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
    return [None if pressure is None else float(f"{pressure:.2g}") for pressure in pressures]


def fit_rising_curve(means: pd.Series) -> pd.Series:
    """Fit the rising curve nearest to means by pressure; pressure 0 has no logarithm and is left out."""
    means = means[means.index > 0]
    return pd.Series(isotonic_regression(means.to_numpy()).x, means.index) if len(means) else means


def bracket_half(blocks: pd.DataFrame) -> Crossing:
    """Bracket the pressure P50 at which half is in lumps, by the lump fractions (seeds, rising pressures) of one arm.

    No curve is drawn between two pressures, so nothing narrower than the pressures that were run comes out.
    """
    if blocks.empty:
        return Crossing(note="no runs")
    below = [*takewhile(lambda pressure: (blocks[pressure] < HALF).all(), blocks.columns)]
    above = [*takewhile(lambda pressure: (blocks[pressure] > HALF).all(), reversed(blocks.columns))]
    note = "" if below or above else "not bracketed: seeds lie on both sides of one half"
    return Crossing(below[-1] if below else None, above[-1] if above else None, len(blocks), note)


def bracket_half_of_runs(table: pd.DataFrame) -> Crossing:
    """Bracket P50 by the rows of the runs of one arm: pressure, seed and lump_fraction, NaN without a result."""
    lumps = table.astype({"lump_fraction": float}).pivot_table(
        index="seed", columns="pressure", values="lump_fraction", dropna=False
    )
    return bracket_half(lumps) if lumps.notna().any(axis=None) else Crossing(note="no runs")


def _find_crossing(curve: pd.Series, target: float) -> float | None:
    """Find the pressure at which a rising curve first reaches a target; None where the curve does not cross it."""
    values, logs = curve.to_numpy(), np.log(curve.index.to_numpy(dtype=float))
    above = np.flatnonzero(values >= target)
    if len(above) == 0 or above[0] == 0:
        return None
    i = above[0]
    share = (target - values[i - 1]) / (values[i] - values[i - 1])
    return float(np.exp(logs[i - 1] + share * (logs[i] - logs[i - 1])))
