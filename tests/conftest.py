"""Shared fixtures: Taichi started afresh, and a small run that several tests look at."""

import subprocess
from pathlib import Path

import pytest
import xarray as xr

from snowrepro.composition.compose import compose
from snowrepro.run import simulate
from snowrepro.settings.config import Config
from tests import command_line
from tests.validation import table

# A run that ends in seconds: coarse, short, and with all that a long one has.
SMALL = [
    "fidelity=preview",
    "loading.press_frames=20",
    "loading.frames=60",
    "reading.drop_height=6",
    "reading.gravity=40",  # lands near frame 47
]
# A hardness test on the small body; its speed is for tests of bits and books, not of hardness.
QUICK = [
    *(*SMALL, "pressure=3000", "indenter=disc", "indenter.speed=4", "indenter.depth=3"),
    *("indenter.rest_frames=10", "indenter.every=20"),
]


def pytest_addoption(parser) -> None:
    parser.addoption("--validation-page", metavar="FILE", help="write the table beside theory as Markdown")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Slow tests come first, so that at the end no process waits for one."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)


def pytest_terminal_summary(terminalreporter, config) -> None:
    """The table beside theory, once: not in the processes that the tests are spread over."""
    rows = table.rows_of(report for group in terminalreporter.stats.values() for report in group)
    if not rows or hasattr(config, "workerinput"):
        return
    terminalreporter.section("validation against theory")
    for line in table.as_text(rows):
        terminalreporter.write_line(line)
    page = config.getoption("--validation-page")
    if page:
        table.write_page(Path(page), rows)
        terminalreporter.write_line(f"page: {page}")


@pytest.fixture
def taichi() -> None:
    """Taichi as a run starts it."""
    from snowrepro.mpm.solver import start_taichi

    start_taichi(compose().case.solver, threads=1)


@pytest.fixture(scope="session")
def small_config() -> Config:
    """The configuration of the small run."""
    return compose([*SMALL, "pressure=3000"])


@pytest.fixture(scope="session")
def small_run(small_config: Config) -> xr.Dataset:
    """The small run, simulated once."""
    return simulate(small_config)


@pytest.fixture(scope="session")
def indented_run() -> xr.Dataset:
    """The small body, indented at its release."""
    return simulate(compose(QUICK))


@pytest.fixture
def snowrepro(tmp_path: Path):
    """Run the command line in an empty folder; returns a function of its arguments."""

    def call(*arguments: str, **options) -> subprocess.CompletedProcess:
        return command_line.run(*arguments, cwd=tmp_path, **options)

    return call
