"""The reference of the numbers of a run, from the descriptions of their columns."""

from collections.abc import Iterator, Mapping

from markdown_text import plain

from snowrepro.cli.meanings import READINGS
from snowrepro.summary.columns import (
    CASE_COLUMNS,
    COMMON_COLUMNS,
    COST_COLUMNS,
    FALL_COLUMNS,
    SCALE_COLUMNS,
    TEST_COLUMNS,
    Column,
)

GROUPS = {
    "What was simulated": CASE_COLUMNS,
    "Numbers without units": SCALE_COLUMNS,
    "Every run": COMMON_COLUMNS,
    "Runs that fall": FALL_COLUMNS,
    "Hardness tests": TEST_COLUMNS,
    "Cost": COST_COLUMNS,
}


def page() -> str:
    """All columns as Markdown, group by group."""
    return "\n".join(line for name, columns in GROUPS.items() for line in _group(name, columns)) + "\n"


def _group(name: str, columns: Mapping[str, Column]) -> Iterator[str]:
    """A group of columns: what each means, and its unit in each reading."""
    yield from ["", f"## {name}", ""]
    yield f"| column | meaning | {' | '.join(f'unit, `{reading}`' for reading in READINGS)} |"
    yield "|---|---|" + "---|" * len(READINGS)
    for column, about in columns.items():
        units = (_unit(about, length) for length in READINGS.values())
        meaning = plain(": ".join(filter(None, (about.long_name, about.note)))).replace(" xi ", " ξ ")
        yield f"| `{column}` | {meaning} | {' | '.join(units)} |"


def _unit(column: Column, length_unit: str) -> str:
    """A unit, or what stands in its place."""
    return "text" if column.is_text else column.format_unit([length_unit]) or "-"
