"""What a report is drawn from, and what a picture contributes to it."""

import shlex
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd
import xarray as xr

from ..analysis import claims
from ..analysis.summary import of_runs
from ..config import Config, Experiment
from ..store import runs

FOLDERS = ("store=", "reports=")  # of whoever made the report, and nothing to redo it by


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


def gathered(configs: Sequence[Config], folder: Path) -> Evidence:
    """What the store holds of an experiment's runs."""
    experiment = configs[0].experiment
    assert experiment is not None, "only an experiment has a report"
    done = [config for config in configs if experiment.needs_runs and runs.is_done(config)]
    missing = frozenset(runs.identify(config) for config in configs if config not in done)
    return Evidence(experiment, configs, of_runs(done), folder, missing)


def judged_scenes(evidence: Evidence) -> list[claims.Scene]:
    """Every scene that was asked for, in order, with the verdicts on its runs."""
    found = []
    for shape, floor in dict.fromkeys((c.shape.name, c.floor.name) for c in evidence.configs):
        table = evidence.table
        if len(table):
            table = table[(table["shape"] == shape) & (table["floor"] == floor)]
        calibrated = evidence.experiment.calibrated_on == (shape, floor)
        lost = evidence.lost(c for c in evidence.configs if (c.shape.name, c.floor.name) == (shape, floor))
        verdicts = claims.judge(evidence.configs[0].claims, table, calibrated, lost)
        found.append(claims.Scene(shape, floor, table, calibrated, verdicts, lost))
    return found


@contextmanager
def opened(config: Config) -> Iterator[xr.Dataset]:
    """A finished run's result; what is read of it is loaded, what is not stays on disk."""
    with runs.open_run(runs.result_path(config)) as dataset:
        yield dataset


def origin(evidence: Evidence, command: str, overrides: Sequence[str]) -> list[str]:
    """How to redo a report, and what made the first of its runs."""
    redo = shlex.join(o for o in overrides if not o.startswith(FOLDERS))
    lines = ["## Where this comes from", "", f"Redo: `snowrepro {command} {redo}`", ""]
    done = [config for config in evidence.configs if evidence.is_done(config)]
    if done:
        with opened(done[0]) as dataset:
            lines += [f"- {key}: {dataset.attrs[key]}" for key in ("versions", "git_state", "machine", "created")]
    return lines


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
