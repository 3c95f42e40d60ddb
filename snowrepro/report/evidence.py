"""What a report is drawn from."""

import os
import shlex
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd
import xarray as xr

from ..analysis import claims
from ..analysis.calibration import Crossing, half_pressure
from ..analysis.summary import of_runs
from ..config import Config, Experiment
from ..store import manifest, runs

FOLDERS = ("store=", "reports=")  # of whoever made the report, and nothing to redo it by


@dataclass(frozen=True)
class Evidence:
    """The runs of an experiment, one row of numbers for each that is done, and the report's folder."""

    experiment: Experiment
    configs: Sequence[Config]
    table: pd.DataFrame
    folder: Path
    missing: frozenset[str] = field(default_factory=frozenset)  # ids

    @cached_property
    def scenes(self) -> list[claims.Scene]:
        """Every scene that was asked for, in order, with the verdicts on its runs."""
        return [self._scene(*at) for at in dict.fromkeys((c.shape.name, c.floor.name) for c in self.configs)]

    @cached_property
    def over_scenes(self) -> list[claims.Verdict]:
        """The verdicts on claims about other scenes."""
        return claims.judge_scenes(self.configs[0].claims, self.scenes)

    @cached_property
    def halves(self) -> dict[str, Crossing]:
        """P50 of each scene, the pressure at which half of the sintered mass is in lumps, by the scene's name."""
        return {scene.name: _half(scene, self.configs[0].claims.alpha) for scene in self.scenes}

    def row(self, run_id: str) -> dict[str, Any]:
        """The numbers of a run; empty without a result."""
        return self._rows.get(run_id, {})

    @cached_property
    def _rows(self) -> dict[str, dict[str, Any]]:
        return {row["run_id"]: row for row in self.table.to_dict("records")}

    def changes(self, config: Config) -> list[str]:
        """The settings of a run that differ from the first's, as "key before -> now"."""
        return manifest.differences(self._first, runs.plain(config))

    @cached_property
    def _first(self) -> dict[str, Any]:
        return runs.plain(self.configs[0])

    def seen_from(self, folder: Path) -> str:
        """The way from ``folder`` to the folder of pictures and tables; empty if they are the same."""
        return "" if folder == self.folder else os.path.relpath(self.folder, folder)

    @property
    def seeds(self) -> list[int]:
        """The seeds that were asked for."""
        return sorted({config.seed for config in self.configs})

    @property
    def of_first_seed(self) -> list[Config]:
        """A run of each kind, for pictures of one run each."""
        return [config for config in self.configs if config.seed == self.seeds[0]]

    def _scene(self, shape: str, floor: str) -> claims.Scene:
        table = self.table
        if len(table):
            table = table[(table["shape"] == shape) & (table["floor"] == floor)]
        calibrated = self.experiment.calibrated_on == (shape, floor)
        lost = self.lost(c for c in self.configs if (c.shape.name, c.floor.name) == (shape, floor))
        verdicts = claims.judge(self.configs[0].claims, table, calibrated, lost)
        return claims.Scene(shape, floor, table, calibrated, verdicts, lost)

    def lost(self, configs: Iterable[Config]) -> list[tuple[str, float]]:
        """Sintering and pressure of those of ``configs`` that have no result."""
        return [(c.sintering.name, c.pressure) for c in configs if not self.is_done(c)]

    def is_done(self, config: Config) -> bool:
        """Whether there is a result to draw."""
        return runs.identify(config) not in self.missing


def gathered(configs: Sequence[Config], folder: Path) -> Evidence:
    """What the store holds of an experiment's runs."""
    experiment = configs[0].experiment
    assert experiment is not None, "only an experiment has a report"
    done = [config for config in configs if experiment.needs_runs and runs.is_done(config)]
    missing = frozenset(runs.identify(config) for config in configs if config not in done)
    return Evidence(experiment, configs, of_runs(done), folder, missing)


def _half(scene: claims.Scene, alpha: float) -> Crossing:
    """P50 of the sintered runs, by the seeds that have every pressure."""
    lost = sorted({p for sintering, p in scene.missing if sintering != "none"})
    if lost:
        return Crossing(note=f"no result at {', '.join(f'{p:g}' for p in lost)}")
    return half_pressure(claims.arm_of(scene.table, "sintered", "lump_fraction").dropna(), alpha)


def made_by(config: Config) -> tuple[str, str, str]:
    """Versions, code and machine that made a finished run, as its manifest says."""
    said = manifest.read(runs.run_dir(config))
    return tuple(str(said.get(key, "unknown")) for key in ("versions", "git_state", "machine"))


@contextmanager
def opened(config: Config) -> Iterator[xr.Dataset]:
    """A finished run's result; what is read of it is loaded, what is not stays on disk."""
    with runs.open_run(runs.result_path(config)) as dataset:
        yield dataset


def redo(overrides: Sequence[str]) -> str:
    """The command that makes runs and report again, wherever they are kept."""
    return shlex.join(["snowrepro", "run", *(o for o in overrides if not o.startswith(FOLDERS))])


def in_paper_order(configs: Sequence[Config]) -> list[Config]:
    """Sintered rows first, pressure rising."""
    return sorted(configs, key=lambda c: (not c.sintering.enabled, c.pressure, c.seed))


def name_of(config: Config) -> str:
    """A run of an experiment in a few words."""
    scene = f"{config.shape.name} on {config.floor.name}"
    test = ", indented" if config.indenter else ""
    return f"{scene}, {config.pressure:g}, {config.sintering.name}, seed {config.seed}{test}"
