"""Comparisons with theory that end in a table: test, theory, measured, tolerance, pass."""

import math

import pytest

ROWS: list[tuple[str, str, str, str, str]] = []


@pytest.fixture
def compare():
    """A function that checks a measured value against theory and puts both into the table at the end."""

    def check(what: str, measured: float, theory: float, rel: float = 0.0, abs: float = 0.0) -> None:
        passed = math.isclose(measured, theory, rel_tol=0, abs_tol=rel * math.fabs(theory) + abs)
        tolerance = f"{rel:.1%}" if rel >= 1e-3 else f"{rel:.0e}" if rel else f"{abs:.0e} abs"
        ROWS.append((what, f"{theory:.6g}", f"{measured:.6g}", tolerance, "yes" if passed else "NO"))
        assert passed, f"{what}: measured {measured!r}, theory {theory!r}, tolerance {tolerance}"

    return check


def pytest_terminal_summary(terminalreporter) -> None:
    """Print the table."""
    if not ROWS:
        return
    table = [("test", "theory", "measured", "tolerance", "pass"), *ROWS]
    widths = [max(len(row[i]) for row in table) for i in range(5)]
    terminalreporter.section("validation against theory")
    for row in table:
        first, *others = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        terminalreporter.write_line("  ".join((first, *others)).rstrip())
