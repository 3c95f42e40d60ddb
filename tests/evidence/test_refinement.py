"""What measures do on finer grids: the order of their steps, and what does not converge."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from snowrepro.evidence.refinement import Trend

GRIDS = (2.0, 1.0, 0.5)


@given(st.floats(0.51, 3.0), st.floats(-1.0, 1.0), st.sampled_from([-0.1, 0.07, 0.2]))
def test_a_known_order_and_limit_are_found(order, limit, slope):
    trend = Trend(GRIDS, tuple(limit + slope * dx**order for dx in GRIDS))
    assert trend.order == pytest.approx(order, rel=1e-6)
    found, band = trend.limit
    assert found == pytest.approx(limit, abs=1e-9)
    assert band == pytest.approx(1.25 * abs(slope) * 0.5**order)
    assert trend.words.startswith("order ")


@pytest.mark.parametrize(
    ("values", "spread", "words"),
    [
        ((0.0, 0.25, 0.5), 0.0, "does not converge: steps do not shrink"),
        ((0.1, 0.2, 0.29), 0.0, "does not converge: steps hardly shrink"),
        ((0.1, 0.2, 0.4), 0.05, "does not converge: steps do not shrink"),
        ((0.1, 0.3, 0.2), 0.0, "does not converge: it goes to and fro"),
        ((0.1, 0.3, 0.2), 0.25, "moves by no more than seeds differ"),
        ((0.1, 0.102, 0.104), 0.0, "moves by no more than seeds differ"),
        ((0.1, 0.2, 0.4), math.nan, "does not converge: steps do not shrink"),
        ((0.1, 0.102, 0.104), math.nan, "hardly moves"),
        ((0.1, 0.2, math.nan), 0.0, "not all were run"),
        ((0.1, 0.2), 0.0, "not all were run"),
    ],
)
def test_what_has_no_order_gets_no_limit(values, spread, words):
    trend = Trend(GRIDS[: len(values)], values, spread)
    assert trend.words == words
    assert math.isnan(trend.order)
    assert all(math.isnan(number) for number in trend.limit)


def test_grids_that_are_not_refined_evenly_have_no_order():
    assert math.isnan(Trend((2.0, 1.0, 0.8), (0.4, 0.2, 0.1)).order)
