"""The table beside theory: from the tests' reports to the terminal and to a page."""

from collections.abc import Iterable
from pathlib import Path

HEAD = ("test", "theory", "measured", "tolerance", "pass")
KEY = "beside theory"  # of the property that carries a row with a test's report
Row = tuple[str, ...]


def rows_of(reports: Iterable) -> list[Row]:
    """All rows that the tests recorded, in the order of the tests' names."""
    done = sorted((r for r in reports if getattr(r, "when", "") == "call"), key=lambda report: report.nodeid)
    return [tuple(row) for report in done for key, row in report.user_properties if key == KEY]


def as_text(rows: list[Row]) -> list[str]:
    """Lines with aligned columns."""
    table = [HEAD, *rows]
    widths = [max(len(row[i]) for row in table) for i in range(len(HEAD))]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table]


def write_page(path: Path, rows: list[Row]) -> None:
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
        *("| " + " | ".join(c.replace("|", "\\|") for c in row) + " |" for row in (HEAD, ("---",) * len(HEAD), *rows)),
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
