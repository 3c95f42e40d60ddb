"""Indices of sensitivity: how much of what varies in a result follows from one setting.

First order from any runs: the correlation ratio over bins of the setting, Var(E[y | bin]) / Var(y), without what bins
of few runs explain by chance (Kelley 1935); there are only so many bins as can be told from the other settings.  From
Saltelli's design the first order by Saltelli et al. (2010), the total order by Jansen (1999); from Morris's paths the
effects of steps.  ``weights`` count each unit of a design: 1, or how often a bootstrap drew it.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

MOST_BINS = 32
FORMS, MOST_PARTS = 4, 6  # parts of another setting's range, and names, that a result may depend on together
MIXED = 1 / 3  # of what another setting does that bins may have: beyond it the two are not told apart
DRAWS, SEED = 400, 0  # of the bootstrap
SPREADS = 1.96  # standard deviations to each side: 95 %


def make_bins(values: np.ndarray, most: int | None = None) -> np.ndarray:
    """Number the bin of each value (n,): names and few numbers are bins of their own, many numbers equally filled ones.

    ``most``: bins; by default the root of n, up to MOST_BINS.
    """
    most = most or max(2, min(MOST_BINS, int(np.sqrt(len(values)))))
    different, codes = np.unique(values, return_inverse=True)
    if values.dtype.kind not in "iuf" or len(different) <= most:
        return codes
    rank = np.searchsorted(np.sort(values), values)  # equal values share a bin
    return np.unique(rank * most // len(values), return_inverse=True)[1]


def make_separate_bins(values: np.ndarray, forms: np.ndarray) -> tuple[np.ndarray, list[int]]:
    """Number the bins of a setting (n,), few enough to tell it from ``forms``; and those that it is not told from.

    ``forms`` (k, n): what a result may depend on of other settings, see ``list_forms``.  The points of a Sobol sequence
    fill the square of two settings evenly in coarse parts only: of 64 points in 17 settings 8 bins of one often decide
    in which half another one is, and would be given what that one does.
    """
    most = len(np.unique(make_bins(values)))
    while True:
        bins = make_bins(values, most)
        mixed = np.flatnonzero(_explain(bins, forms) > MIXED).tolist()
        if not mixed or most <= 2 or values.dtype.kind not in "iuf":
            return bins, mixed
        most //= 2


def list_forms(values: np.ndarray) -> np.ndarray:
    """List what a result may depend on of a setting (k, n): a number itself, and sets of its parts or names."""
    is_number = values.dtype.kind in "iuf"
    parts = make_bins(values, FORMS) if is_number else make_bins(values)
    count = min(int(parts.max()) + 1, MOST_PARTS)
    chosen = range(1, 2 ** (count - 1))  # sets of parts, each once and without what is left of it
    together = [np.isin(parts, [part for part in range(count) if choice >> part & 1]) for choice in chosen]
    return np.array([*together, *([values] if is_number else [])], dtype=float)


def pair_halves(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return where two settings are in unlike halves of their ranges or names: what they may do together, (n,)."""
    halves = [make_bins(values, 2) if values.dtype.kind in "iuf" else make_bins(values) % 2 for values in (one, other)]
    return (halves[0] != halves[1]).astype(float)


def _explain(bins: np.ndarray, forms: np.ndarray) -> np.ndarray:
    """Return the part of the variance of each of ``forms`` (k, n) that is between bins, as first order: (k,)."""
    is_in = (bins == np.unique(bins)[:, None]).astype(float)  # (bin, n)
    counts, total = is_in.sum(axis=1), len(bins)
    variances = forms.var(axis=1)
    if len(counts) < 2 or total - len(counts) < 2:
        return np.zeros(len(forms))
    means = forms @ is_in.T / counts
    between = ((means - forms.mean(axis=1, keepdims=True)) ** 2) @ counts / total
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.nan_to_num(_leave_out_chance(between / variances, total, len(counts)), nan=0.0)


def _leave_out_chance(share: Any, total: float, bins: int) -> Any:
    """Return the part of a variance that is between bins without what so many of them explain by chance."""
    return 1.0 - (1.0 - share) * (total - 1) / (total - bins)


def measure_first_order(bins: np.ndarray, y: np.ndarray, weights: np.ndarray) -> float:
    """Return the part of the variance of ``y`` (n,) that the means of its bins have; NaN where that says nothing."""
    weight = np.bincount(bins, weights)
    is_filled, total = weight > 0, weights.sum()
    filled, variance = int(is_filled.sum()), measure_variance(y, weights)
    if filled < 2 or total - filled < 2 or variance == 0:
        return np.nan
    means = np.bincount(bins, weights * y)[is_filled] / weight[is_filled]
    between = measure_variance(means, weight[is_filled])
    return float(_leave_out_chance(between / variance, total, filled))


def measure_variance(y: np.ndarray, weights: np.ndarray) -> float:
    """Return the variance of ``y`` (n,), each as often as its weight says."""
    return float(np.average((y - np.average(y, weights=weights)) ** 2, weights=weights))


def measure_blocks(blocks: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of first and of total order of Saltelli's blocks (n, k + 2): each (k,)."""
    ends, twice = blocks[:, [0, -1]].T.ravel(), np.tile(weights, 2)
    centred, variance = blocks - np.average(ends, weights=twice), measure_variance(ends, twice)
    a, mixed, b = centred[:, :1], centred[:, 1:-1], centred[:, -1:]
    if variance == 0:
        return np.full(mixed.shape[1], np.nan), np.full(mixed.shape[1], np.nan)
    first = np.average(b * (mixed - a), axis=0, weights=weights) / variance
    return first, np.average((mixed - a) ** 2, axis=0, weights=weights) / variance / 2.0


def measure_effects(effects: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return mean size and standard deviation of effects (paths, k) over a whole range; NaN are left out: each (k,)."""
    weight = np.where(np.isnan(effects), 0.0, weights[:, None])
    count, known = weight.sum(axis=0), np.nan_to_num(effects)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = (weight * known).sum(axis=0) / count
        spread = np.sqrt((weight * (known - mean) ** 2).sum(axis=0) / (count - 1))
        return (weight * abs(known)).sum(axis=0) / count, spread


def estimate(index: Callable[[np.ndarray], float | np.ndarray], units: int) -> tuple[np.ndarray, np.ndarray]:
    """Estimate an index and half of its interval of 95 %, by drawing the ``units`` of a design anew.

    The interval is symmetric, from the standard deviation of what the draws give: a draw has some units twice, which
    shifts all indices, so that its quantiles would lie beside the estimate.
    """
    rng = np.random.default_rng(SEED)
    draws = (np.bincount(rng.integers(units, size=units), minlength=units) for _ in range(DRAWS))
    drawn = np.array([index(weights) for weights in draws])
    return np.asarray(index(np.ones(units))), SPREADS * np.nanstd(drawn, axis=0, ddof=1)
