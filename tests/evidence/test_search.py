"""Searches along one setting: what is asked for next, and what was found, for curves whose answer is known."""

import math
from collections.abc import Callable

import pytest

from snowrepro.errors import ConfigError
from snowrepro.evidence.search import Search, ask_next, make_search, read_answer
from snowrepro.sweep.factors import Factor

PRESSURE = Factor("pressure", "log", 200, 6000)


def follow(search: Search, curve: Callable[[float], float], known: dict[float, float] | None = None) -> list[float]:
    """Ask and tell to the end; returns the values in the order in which they were asked for."""
    known, path = {} if known is None else known, []
    while asked := ask_next(search, known):
        path += asked
        known |= {value: curve(value) for value in asked}
    return path


def rise(half: float, steepness: float) -> Callable[[float], float]:
    """A curve that rises from 0 to 1 over the logarithm, and is one half at ``half``."""
    return lambda value: 1 / (1 + (half / value) ** steepness)


@pytest.mark.parametrize("half", [230, 740, 3000, 5500])
@pytest.mark.parametrize("steepness", [1, 4, 20, 200])
def test_half_is_found_in_ten_values(half, steepness):
    """Of gentle curves and of steps, anywhere in the range: within the bracket, which is as narrow as asked for."""
    known: dict[float, float] = {}
    path = follow(Search(PRESSURE, 0.5), rise(half, steepness), known)
    answer = read_answer(Search(PRESSURE, 0.5), known)
    assert len(path) <= 10 and path[:2] == [200, 6000]
    assert answer.value == pytest.approx(half, rel=0.05) and answer.low <= half <= answer.high <= 1.05 * answer.low
    assert answer.note == ""


def test_a_search_goes_on_where_it_was():
    """After any number of values, what is asked for is what would have been."""
    search, curve = Search(PRESSURE, 0.5), rise(740, 4)
    whole = follow(search, curve)
    for number in range(2, len(whole)):
        known = {value: curve(value) for value in whole[:number]}
        assert follow(search, curve, known) == whole[number:]


def test_what_is_not_crossed_is_not_found():
    known: dict[float, float] = {}
    assert follow(Search(PRESSURE, 0.5), lambda value: 0.1, known) == [200, 6000]
    answer = read_answer(Search(PRESSURE, 0.5), known)
    assert math.isnan(answer.value) and answer.note == "not reached: 0.1 to 0.1 along the range"


@pytest.mark.parametrize(("target", "where"), [(0.9, 6000), (0.1, 200)])
def test_an_end_that_is_just_the_target_is_the_answer(target, where):
    known: dict[float, float] = {}
    curve = {200: 0.1, 6000: 0.9}.__getitem__
    assert follow(Search(PRESSURE, target), curve, known) == [200, 6000]
    answer = read_answer(Search(PRESSURE, target), known)
    assert (answer.value, answer.low, answer.high, answer.note) == (where, where, where, "")


def test_a_value_without_result_ends_a_search():
    """And is told; what is bracketed without it, is."""
    known: dict[float, float] = {}
    curve = rise(740, 4)
    path = follow(Search(PRESSURE, 0.5), lambda value: math.nan if 201 < value < 5999 else curve(value), known)
    assert len(path) == 3
    answer = read_answer(Search(PRESSURE, 0.5), known)
    assert (answer.low, answer.high) == (200, 6000) and answer.note == f"no result at {path[2]:g}"


def test_too_few_values_say_so():
    known: dict[float, float] = {}
    follow(Search(PRESSURE, 0.5, points=3), rise(740, 200), known)
    assert len(known) == 3 and "more points are needed" in read_answer(Search(PRESSURE, 0.5), known).note


def test_a_curve_that_crosses_thrice_says_so():
    known = {200.0: 0.1, 400.0: 0.9, 1000.0: 0.2, 6000.0: 0.8}
    answer = read_answer(Search(PRESSURE, 0.5), known)
    assert answer.note == "crossed 3 times; this is the narrowest" and (answer.low, answer.high) == (200, 400)


def test_whole_numbers_end_at_neighbours():
    """A bracket of one step cannot be narrower."""
    known: dict[float, float] = {}
    search = Search(Factor("reading.press_ramp", "whole", 0, 20), 0.5, within=0.01)
    follow(search, lambda value: float(value >= 7), known)
    answer = read_answer(search, known)
    assert (answer.low, answer.high) == (6, 7) and len(known) <= 10


@pytest.mark.parametrize(("target", "sign"), [("most", 1), ("least", -1)])
def test_the_best_value_is_found(target, sign):
    known: dict[float, float] = {}
    search = Search(PRESSURE, target)
    follow(search, lambda value: -sign * math.log(value / 900) ** 2, known)
    answer = read_answer(search, known)
    assert len(known) <= 10 and answer.value == pytest.approx(900, rel=0.05) and answer.low <= 900 <= answer.high


def test_what_is_wrong_is_said():
    with pytest.raises(ConfigError, match="target: should be a number, most or least"):
        make_search(PRESSURE, "half", 0.05, 10)
    with pytest.raises(ConfigError, match="a search goes along numbers"):
        make_search(Factor("shape", "choice", choices=("ball", "star")), "0.5", 0.05, 10)
    with pytest.raises(ConfigError, match=r"3 points or more, and --within 0 to 1 \(got 2 and 0\.05\)"):
        make_search(PRESSURE, "0.5", 0.05, 2)
