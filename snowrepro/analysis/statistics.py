"""The statistics that the claims are judged by, on values by seed."""

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

ROUND_OFF = 1e-12  # values that differ by less are equal
NO_LIMITS = (-np.inf, np.inf)


@dataclass(frozen=True)
class Estimate:
    """A mean of ``count`` values with its interval from ``low`` to ``high``; one value alone has no interval."""

    mean: float
    low: float | None = None
    high: float | None = None
    count: int = 1

    @property
    def is_of_equals(self) -> bool:
        """Whether it is of several values that are all equal: its interval has no length and says nothing."""
        return self.low is not None and self.low == self.high

    def is_above(self, threshold: float) -> bool:
        """Whether the whole interval lies above a threshold, by more than round-off."""
        return self.low is not None and self.low > threshold + ROUND_OFF

    def is_below(self, threshold: float) -> bool:
        """Whether the whole interval lies below a threshold, by more than round-off."""
        return self.high is not None and self.high < threshold - ROUND_OFF


def estimate_mean(values: np.ndarray, alpha: float, limits: tuple[float, float] = NO_LIMITS) -> Estimate:
    """Estimate the mean of ``values`` (n,), with Student's interval at 1 - 2 ``alpha``.

    So each of its ends alone is wrong with probability ``alpha``, and that it lies above a threshold is a one-sided
    test at ``alpha``.  ``limits``: of the values; the interval is cut there, which changes no test against a threshold
    between them.  Equal values have an interval of length 0.
    """
    values = np.asarray(values, dtype=float)
    mean, count = float(values.mean()), len(values)
    if count < 2:
        return Estimate(mean)
    if np.ptp(values) <= ROUND_OFF:
        return Estimate(mean, mean, mean, count)
    half = float(stdtrit(count - 1, 1.0 - alpha) * values.std(ddof=1) / np.sqrt(count))
    return Estimate(mean, max(mean - half, limits[0]), min(mean + half, limits[1]), count)
