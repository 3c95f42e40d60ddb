"""Comparisons with theory that end in a table: test, theory, measured, tolerance, pass."""

import math
from pathlib import Path

import pytest

HEAD = ("test", "theory", "measured", "tolerance", "pass")
ROWS: list[tuple[str, str, str, str, str]] = []


@pytest.fixture
def compare():
    """A function that checks a measured value against theory and puts both into the table at the end."""

    def check(what: str, measured: float, theory: float, rel: float = 0.0, abs: float = 0.0) -> None:
        passed = math.isclose(measured, theory, rel_tol=0, abs_tol=rel * math.fabs(theory) + abs)
        tolerance = f"{rel:.1%}" if rel >= 1e-3 else f"{rel:.0e}" if rel else f"{abs:.3g} abs"
        ROWS.append((what, f"{theory:.6g}", f"{measured:.6g}", tolerance, "yes" if passed else "NO"))
        assert passed, f"{what}: measured {measured!r}, theory {theory!r}, tolerance {tolerance}"

    return check


def pytest_terminal_summary(terminalreporter, config) -> None:
    """Print the table, and write it where --validation-page says."""
    if not ROWS:
        return
    table = [HEAD, *ROWS]
    widths = [max(len(row[i]) for row in table) for i in range(5)]
    terminalreporter.section("validation against theory")
    for row in table:
        first, *others = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        terminalreporter.write_line("  ".join((first, *others)).rstrip())
    page = config.getoption("--validation-page")
    if page:
        write_page(Path(page))
        terminalreporter.write_line(f"page: {page}")


def write_page(path: Path) -> None:
    """The table in Markdown, with what it comes to in front."""
    failed = sum(row[-1] != "yes" for row in ROWS)
    lines = [
        "# The solver beside theory",
        "",
        f"**{len(ROWS) - failed} of {len(ROWS)} comparisons are within their tolerance.**",
        "",
        "`make validate` writes this page. What each row means, and why its tolerance is what it is, is said in the "
        "test of the same subject in `tests/validation/`.",
        "",
        *("| " + " | ".join(row) + " |" for row in (HEAD, ("---",) * len(HEAD), *ROWS)),
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
