"""Comparisons with theory that end in a table: test, theory, measured, tolerance, pass."""

import math
from pathlib import Path

import pytest

HEAD = ("test", "theory", "measured", "tolerance", "pass")
KEY = "beside theory"


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


def pytest_terminal_summary(terminalreporter, config) -> None:
    """Print the table, and write it where --validation-page says."""
    reports = [r for group in terminalreporter.stats.values() for r in group if getattr(r, "when", "") == "call"]
    reports.sort(key=lambda report: report.nodeid)
    rows = [tuple(row) for report in reports for key, row in report.user_properties if key == KEY]
    if not rows:
        return
    table = [HEAD, *rows]
    widths = [max(len(row[i]) for row in table) for i in range(5)]
    terminalreporter.section("validation against theory")
    for row in table:
        first, *others = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        terminalreporter.write_line("  ".join((first, *others)).rstrip())
    page = config.getoption("--validation-page")
    if page:
        write_page(Path(page), rows)
        terminalreporter.write_line(f"page: {page}")


def write_page(path: Path, rows: list[tuple[str, ...]]) -> None:
    """The table in Markdown, with what it comes to in front."""
    failed = sum(row[-1] != "yes" for row in rows)
    lines = [
        "# The solver beside theory",
        "",
        f"**{len(rows) - failed} of {len(rows)} comparisons are within their tolerance.**",
        "",
        "`make validate` writes this page. What each row means, and why its tolerance is what it is, is said in the "
        "test of the same subject in `tests/validation/`.",
        "",
        *("| " + " | ".join(row) + " |" for row in (HEAD, ("---",) * len(HEAD), *rows)),
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
