"""What a report is drawn from, and what a picture contributes to it."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd
import xarray as xr

from ..config import Config, Experiment
from ..store import runs


@dataclass(frozen=True)
class Evidence:
    """The runs of an experiment, one row of numbers for each that is done, and the report's folder."""

    experiment: Experiment
    configs: Sequence[Config]
    table: pd.DataFrame
    folder: Path
    missing: frozenset[str] = field(default_factory=frozenset)  # ids

    def lost(self, configs: Iterable[Config]) -> list[tuple[str, float]]:
        """Sintering and pressure of those of ``configs`` that have no result."""
        return [(c.sintering.name, c.pressure) for c in configs if not self.is_done(c)]

    def is_done(self, config: Config) -> bool:
        """Whether there is a result to draw."""
        return runs.identify(config) not in self.missing


@dataclass(frozen=True)
class Findings:
    """The body of a report in Markdown, its verdict first, and the verdict alone for the screen."""

    lines: list[str]
    verdict: str


@contextmanager
def opened(config: Config) -> Iterator[xr.Dataset]:
    """A finished run's result; what is read of it is loaded, what is not stays on disk."""
    with runs.open_run(runs.result_path(config)) as dataset:
        yield dataset


def in_paper_order(configs: Sequence[Config]) -> list[Config]:
    """Sintered rows first, pressure rising."""
    return sorted(configs, key=lambda c: (not c.sintering.enabled, c.pressure, c.seed))


def name_of(config: Config) -> str:
    """A run of an experiment in a few words."""
    scene = f"{config.shape.name} on {config.floor.name}"
    test = ", indented" if config.indenter else ""
    return f"{scene}, {config.pressure:g}, {config.sintering.name}, seed {config.seed}{test}"


def markdown(table: pd.DataFrame) -> list[str]:
    """A Markdown table; floats with three significant digits, or whole from 1000 on; a dash for what is not there."""

    def show(value: object) -> str:
        if not isinstance(value, float):
            return str(value)
        if value != value:
            return "-"
        return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"

    header = [str(column) for column in table.columns]
    rows = [[show(value) for value in row] for row in table.itertuples(index=False)]
    return ["| " + " | ".join(cells) + " |" for cells in (header, ["---"] * len(header), *rows)]
