"""Comparisons with theory, which end in a table."""

import math

import pytest

from tests.validation.table import KEY


@pytest.fixture
def compare(record_property):
    """A function that checks a measured value against theory and puts both into the table at the end."""

    def check(what: str, measured: float, theory: float, rel: float = 0.0, abs: float = 0.0) -> None:
        passed = math.isclose(measured, theory, rel_tol=0, abs_tol=rel * math.fabs(theory) + abs)
        tolerance = f"{rel:.1%}" if rel >= 1e-3 else f"{rel:.0e}" if rel else f"{abs:.3g} abs"
        row = (what, f"{theory:.6g}", f"{measured:.6g}", tolerance, "yes" if passed else "NO")
        record_property(KEY, row)  # goes with the test's report, from other processes too
        assert passed, f"{what}: measured {measured!r}, theory {theory!r}, tolerance {tolerance}"

    return check
