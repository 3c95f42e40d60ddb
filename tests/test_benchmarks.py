"""The benchmark runs; how fast it is, is not tested."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))


@pytest.mark.slow
@pytest.mark.parametrize("spline", ["quadratic", "cubic"])
def test_speed_of_a_short_case(spline, monkeypatch):
    """Everything on, with snow that flows, for a moment."""
    import speed

    monkeypatch.setattr(speed, "SECONDS", 0.1)
    assert speed.measure_snowrepro(spline) > 0
