"""Where along one setting a measure reaches a target, or is largest or smallest: which value to run next.

Ask and tell by repetition: a method of SciPy's is called afresh with all that is known, and asks for the first value
that it lacks.  So the next value follows from the results alone: whoever stops and starts again takes the same path.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from scipy.optimize import minimize_scalar, toms748

from ..composition.ranges import CHOICE, LOG
from ..errors import ConfigError
from ..sweep.factors import Factor

MOST, LEAST = "most", "least"
MOST_STEPS = 200  # of a method; the number of values is bounded otherwise


class _Asked(Exception):
    """A method asked for a value that is not known."""

    def __init__(self, value: float) -> None:
        self.value = value


@dataclass(frozen=True)
class Search:
    """What is looked for along a setting.

    ``target``: the value of the measure to be reached, or MOST or LEAST; ``within``: how narrow the bracket must be, of
    a log range as part of the value, of others as part of the range; ``points``: values at most.
    """

    factor: Factor
    target: float | str
    within: float = 0.05
    points: int = 10

    def is_narrow(self, low: float, high: float) -> bool:
        """Whether two values are as near as asked for."""
        if self.factor.scale == LOG:
            return high <= low * (1 + self.within)
        return high - low <= self.within * (self.factor.high - self.factor.low)


@dataclass(frozen=True)
class Answer:
    """What a search found: the ``value``, and values ``low`` and ``high`` between which it lies; NaN without one.

    ``note``: what there is to know beside.
    """

    value: float = math.nan
    low: float = math.nan
    high: float = math.nan
    note: str = ""


def make_search(factor: Factor, target: str, within: float, points: int) -> Search:
    """Make a search of what was typed.  Raises ConfigError."""
    if factor.scale == CHOICE:
        raise ConfigError(f"'{factor.key}={factor.describe()}': a search goes along numbers")
    if points < 3 or not 0 < within < 1:
        raise ConfigError(f"a search takes 3 points or more, and --within 0 to 1 (got {points} and {within:g})")
    if target in (MOST, LEAST):
        return Search(factor, target, within, points)
    try:
        number = float(target)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ConfigError(f"target: should be a number, {MOST} or {LEAST} (got {target})")
    return Search(factor, number, within, points)


def ask_next(search: Search, known: Mapping[float, float]) -> list[float]:
    """Return the values that are to be run next; none where the search is at its end.

    ``known``: the measure by value, NaN of a value whose runs gave none, which ends a search.
    """
    ends = [value for value in (search.factor.place(0.0), search.factor.place(1.0)) if value not in known]
    if ends:
        return ends
    if len(known) >= search.points or any(map(math.isnan, known.values())):
        return []
    if isinstance(search.target, float):
        bracket = _find_bracket(search, known)
        if bracket is None or search.is_narrow(*bracket):
            return []
    try:
        _METHODS[search.target if isinstance(search.target, str) else ""](search, known)
    except _Asked as asked:
        return [asked.value]
    return []


def read_answer(search: Search, known: Mapping[float, float]) -> Answer:
    """Read what was found from all that is known: the crossing of the target, or the best value."""
    failed = [value for value, measure in known.items() if math.isnan(measure)]
    note = f"no result at {', '.join(f'{value:g}' for value in sorted(failed))}" if failed else ""
    there = {value: measure for value, measure in sorted(known.items()) if not math.isnan(measure)}
    if isinstance(search.target, str):
        return _read_best(there, search.target, note)
    if exact := [value for value, measure in there.items() if measure == search.target]:
        return Answer(exact[0], exact[0], exact[0], note or (f"and at {len(exact) - 1} more" if exact[1:] else ""))
    crossings = _list_crossings(search, there)
    if not crossings:
        spread = f"{min(there.values()):.3g} to {max(there.values()):.3g}" if there else "no value"
        return Answer(note=note or f"not reached: {spread} along the range")
    low, high = min(crossings, key=lambda pair: _place(search, pair[1]) - _place(search, pair[0]))
    share = (search.target - there[low]) / (there[high] - there[low])
    value = search.factor.place(_place(search, low) + share * (_place(search, high) - _place(search, low)))
    if len(crossings) > 1:
        note = note or f"crossed {len(crossings)} times; this is the narrowest"
    elif not search.is_narrow(low, high):
        note = note or "not as narrow as asked for: more points are needed"
    return Answer(value, low, high, note)


def _read_best(there: Mapping[float, float], target: str, note: str) -> Answer:
    """Read the best of the values that were run, and its neighbours."""
    if not there:
        return Answer(note=note or "no value")
    values = list(there)
    best = (max if target == MOST else min)(values, key=lambda value: there[value])
    at = values.index(best)
    return Answer(best, values[max(at - 1, 0)], values[min(at + 1, len(values) - 1)], note)


def _list_crossings(search: Search, there: Mapping[float, float]) -> Sequence[tuple[float, float]]:
    """List the pairs of neighbouring values between which the measure crosses the target."""
    assert isinstance(search.target, float), "it is to be reached"
    above = {value: measure >= search.target for value, measure in sorted(there.items())}
    return [(low, high) for low, high in pairwise(above) if above[low] != above[high]]


def _find_bracket(search: Search, known: Mapping[float, float]) -> tuple[float, float] | None:
    """Find the narrowest pair of values between which the target is crossed; None if it is not."""
    answer = read_answer(search, known)
    return None if math.isnan(answer.value) else (answer.low, answer.high)


def _place(search: Search, value: float) -> float:
    """Return where a value lies in its range, from 0 to 1, on the scale of the range."""
    low, high = search.factor.low, search.factor.high
    if search.factor.scale == LOG:
        return math.log(value / low) / math.log(high / low)
    return (value - low) / (high - low)


def _measure(search: Search, known: Mapping[float, float]) -> Callable[[float], float]:
    """Make the function of a place from 0 to 1 that a method is to call; it raises _Asked for what is not known."""

    def measure(place: float) -> float:
        """Return the measure at a place."""
        value = search.factor.place(min(max(place, 0.0), 1.0))
        if value not in known:
            raise _Asked(value)
        return known[value]

    return measure


def _find_target(search: Search, known: Mapping[float, float]) -> None:
    """Find where the measure is the target, to well within the bracket that is asked for.

    By the method of Alefeld, Potra and Shi (1995), which asks for fewer values than Brent's where a curve is flat on
    one side, as lumps over pressure are.
    """
    assert isinstance(search.target, float), "it is to be reached"
    measure, target = _measure(search, known), search.target
    width = search.within if search.factor.scale != LOG else math.log1p(search.within) / _log_width(search)
    toms748(lambda place: measure(place) - target, 0.0, 1.0, xtol=width / 4, maxiter=MOST_STEPS, disp=False)


def _find_best(search: Search, known: Mapping[float, float]) -> None:
    """Find where the measure is largest or smallest, by Brent's method between bounds."""
    measure, sign = _measure(search, known), -1.0 if search.target == MOST else 1.0
    width = search.within if search.factor.scale != LOG else math.log1p(search.within) / _log_width(search)
    minimize_scalar(
        lambda place: sign * measure(place), bounds=(0.0, 1.0), method="bounded",
        options={"xatol": width / 2, "maxiter": MOST_STEPS},
    )  # fmt: skip


def _log_width(search: Search) -> float:
    """Return the logarithm of the ratio of the ends of a range."""
    return math.log(search.factor.high / search.factor.low)


_METHODS: dict[str, Callable[[Search, Mapping[float, float]], None]] = {
    "": _find_target,
    MOST: _find_best,
    LEAST: _find_best,
}
