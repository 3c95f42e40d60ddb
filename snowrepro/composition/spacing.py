"""Numbers at equal steps or equal ratios, for ``linspace(200,4000,8)`` and ``logspace(200,4000,8)`` in overrides."""

import math
from collections.abc import Callable, Sequence

MOST_NUMBERS = 100_000  # as many as runs of a sweep
LONGEST = 1e15  # a whole number below is written without an exponent
DIGITS = 6  # of the numbers between the ends, which are as they were given

Number = int | float


def space_evenly(start: Number, stop: Number, count: int) -> list[Number]:
    """``count`` numbers from ``start`` to ``stop``, both among them, at equal steps.  Raises ValueError."""
    _require_numbers(start, stop, count)
    step = (stop - start) / (count - 1)
    return _round_between(start, stop, [start + step * i for i in range(1, count - 1)])


def space_by_ratio(start: Number, stop: Number, count: int) -> list[Number]:
    """Likewise, each the same number of times the one before.  Raises ValueError."""
    _require_numbers(start, stop, count)
    if min(start, stop) <= 0:
        raise ValueError(f"start and stop should be above 0 (got {start} and {stop})")
    first, step = math.log(start), (math.log(stop) - math.log(start)) / (count - 1)
    return _round_between(start, stop, [math.exp(first + step * i) for i in range(1, count - 1)])


SPACINGS: dict[str, Callable[[Number, Number, int], list[Number]]] = {
    "linspace": space_evenly,
    "logspace": space_by_ratio,
}


def _require_numbers(start: Number, stop: Number, count: int) -> None:
    """Raises ValueError where there are too few or too many numbers, before any of them is there."""
    if not 2 <= count <= MOST_NUMBERS:
        raise ValueError(f"the count should be 2 to {MOST_NUMBERS:,} (got {count:,})")
    if not (math.isfinite(start) and math.isfinite(stop)):
        raise ValueError(f"start and stop should be finite (got {start} and {stop})")


def _round_between(start: Number, stop: Number, between: Sequence[float]) -> list[Number]:
    """The ends as they are, and rounded what is between them.  Raises ValueError if two are the same then."""
    rounded = [float(f"{value:.{DIGITS}g}") for value in between]
    plain = [int(value) if value.is_integer() and abs(value) < LONGEST else value for value in rounded]
    numbers = [start, *plain, stop]
    if len(set(numbers)) < len(numbers):
        raise ValueError(f"some of the {len(numbers):,} numbers are the same in {DIGITS} digits: take fewer")
    return numbers
