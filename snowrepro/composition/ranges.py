"""Ranges to be sampled: ``log(1,100)`` and ``whole(0,20)`` in overrides, beside Hydra's ``interval`` and ``choice``."""

import math

Number = int | float
INTERVAL, LOG, WHOLE, CHOICE = "interval", "log", "whole", "choice"
EXAMPLE = "'reading.gravity=log(1,100)', interval(0,1), whole(0,20) or choice(legacy,coulomb)"


def check_log(start: Number, stop: Number) -> tuple[float, float]:
    """Return the ends of a range whose equal ratios are equally likely.  Raises ValueError where they are none."""
    if not min(start, stop) > 0:
        raise ValueError(f"start and stop should be above 0 (got {start} and {stop})")
    return _check_ends(start, stop)


def check_whole(start: int, stop: int) -> tuple[float, float]:
    """Return the ends of a range of whole numbers, which are among them.  Raises ValueError where they are none."""
    return _check_ends(start, stop)


def _check_ends(start: Number, stop: Number) -> tuple[float, float]:
    """Return the ends of a range.  Raises ValueError if they are not finite, or do not rise."""
    if not (math.isfinite(start) and math.isfinite(stop) and start < stop):
        raise ValueError(f"start and stop should be finite, and start the lower one (got {start} and {stop})")
    return float(start), float(stop)
