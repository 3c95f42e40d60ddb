"""The statistics that the claims are judged by, on values by seed (rows) and pressure (columns)."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

RESAMPLES = 2000  # of a bootstrap
RNG_SEED = 2024  # of a bootstrap: the same numbers give the same interval


@dataclass(frozen=True)
class Estimate:
    """A mean with its interval from ``low`` to ``high``; one value alone has no interval."""

    mean: float
    low: float | None = None
    high: float | None = None

    def is_above(self, threshold: float) -> bool:
        """Whether the whole interval lies above a threshold."""
        return self.low is not None and self.low > threshold

    def is_below(self, threshold: float) -> bool:
        """Whether the whole interval lies below a threshold."""
        return self.high is not None and self.high < threshold


def estimate_mean(values: np.ndarray, alpha: float) -> Estimate:
    """Estimate the mean of ``values`` (n,), with Student's two-sided interval at 1 - ``alpha``.

    Equal values have an interval of length 0.
    """
    values = np.asarray(values, dtype=float)
    mean = float(values.mean())
    if len(values) < 2:
        return Estimate(mean)
    half = float(stats.t.ppf(1.0 - alpha / 2.0, len(values) - 1) * stats.sem(values))
    return Estimate(mean, mean - half, mean + half)


def run_page_test(blocks: np.ndarray) -> float | None:
    """Page's trend test: the p value of values (seeds, places) that rise from place to place; None without two of each.

    Exact without ties and up to 8 places and 12 seeds (20 at three places), SciPy's normal approximation
    beyond; ties make it larger.  At two places L is the number of seeds that rise: the exact sign test.
    """
    seeds, places = blocks.shape
    if seeds < 2 or places < 2:
        return None
    if places == 2:
        return float(stats.binomtest(int((blocks[:, 1] > blocks[:, 0]).sum()), seeds, alternative="greater").pvalue)
    return float(stats.page_trend_test(blocks).pvalue)


def estimate_kendall_tau(blocks: np.ndarray, alpha: float) -> Estimate:
    """Estimate Kendall's tau between place and value within a seed, mean over seeds, for values (seeds, places).

    The interval is a bootstrap over seeds as clusters.  A seed whose values are all equal has tau 0.
    """
    places = np.arange(blocks.shape[1])
    taus = np.sort(np.nan_to_num([stats.kendalltau(places, row).statistic for row in blocks]))
    if len(taus) < 2:
        return Estimate(float(taus.mean()))
    means = taus[draw_resamples(len(taus))].mean(axis=1)
    low, high = np.quantile(means, [alpha / 2.0, 1.0 - alpha / 2.0])
    return Estimate(float(taus.mean()), float(low), float(high))


def draw_resamples(seeds: int) -> np.ndarray:
    """Draw the rows of a bootstrap: indices of seeds, with replacement (RESAMPLES, seeds); always the same."""
    return np.random.default_rng(RNG_SEED).integers(seeds, size=(RESAMPLES, seeds))


def adjust_by_holm(p: np.ndarray) -> np.ndarray:
    """Adjust p values (n,) for their number, by Holm's method."""
    order = np.argsort(p)
    stepped = np.maximum.accumulate(np.asarray(p)[order] * np.arange(len(p), 0, -1))
    adjusted = np.empty(len(p))
    adjusted[order] = np.minimum(stepped, 1.0)
    return adjusted
