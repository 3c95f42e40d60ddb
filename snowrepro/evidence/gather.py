"""The runs of an experiment with their numbers and verdicts: what a report is made of."""

import os
import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from ..settings.case import ARMS
from ..settings.question import Experiment
from ..store import manifest
from ..store.run import BrokenResult, Run
from ..summary.columns import CASE_COLUMNS
from ..summary.row import read_row, tabulate_runs
from ..sweep.plan import Plan
from . import claims
from .calibration import Crossing, bracket_half
from .collect import CollectedSweep, collect_sweep, list_varied_keys
from .scenes import judge_scenes

FOLDERS = ("store=", "reports=")  # where files are kept: no part of the command that repeats the runs
OF_ANY_SWEEP = "sweep"  # the picture of runs that were made for no experiment


@dataclass(frozen=True)
class Evidence:
    """The runs of an experiment and what they gave.

    ``table``: a row of numbers for each run that is done; ``folder``: of the report; ``missing``: ids of runs without
    a result; ``plan``: what asked for the runs, where that is known.
    """

    experiment: Experiment
    runs: Sequence[Run]
    table: pd.DataFrame
    folder: Path
    missing: frozenset[str] = field(default_factory=frozenset)
    plan: Plan | None = None

    @cached_property
    def sweep(self) -> CollectedSweep:
        """The table of all runs and what varies in them, as ``sweep_table`` has it."""
        assert self.plan is not None, "what varies is only known of runs that were planned together"
        return collect_sweep(self.plan)

    @cached_property
    def scenes(self) -> list[claims.JudgedScene]:
        """The scenes of the runs, in order, with the verdicts on each."""
        names = dict.fromkeys((run.case.shape.name, run.case.floor.name) for run in self.runs)
        return [self._judge_scene(*name) for name in names]

    @cached_property
    def over_scenes(self) -> list[claims.Verdict]:
        """The verdicts on claims that count other claims over scenes."""
        return judge_scenes(self.runs[0].config.question.claims, self.scenes)

    @cached_property
    def half_pressures(self) -> dict[str, Crossing]:
        """The bracket of P50, the pressure at which half of the sintered mass is in lumps, by scene."""
        return {scene.name: _bracket_half_pressure(scene) for scene in self.scenes}

    def row(self, run_id: str) -> dict[str, Any]:
        """Return the row of numbers of a run; empty without a result."""
        return self._rows.get(run_id, {})

    @cached_property
    def _rows(self) -> dict[str, dict[str, Any]]:
        """The rows of numbers by the run's id."""
        return {row["run_id"]: row for row in self.table.to_dict("records")}

    def list_changes(self, run: Run) -> list[str]:
        """List the settings of a run that differ from those of the first, each as "key before -> now"."""
        return manifest.differences(self._first, run.config.record())

    @cached_property
    def _first(self) -> dict[str, Any]:
        """The settings of the first run."""
        return self.runs[0].config.record()

    def path_from(self, folder: Path) -> str:
        """Return the relative path from ``folder`` to the report's own folder; empty if they are the same."""
        return "" if folder == self.folder else os.path.relpath(self.folder, folder)

    @property
    def seeds(self) -> list[int]:
        """The seeds of the runs, rising."""
        return sorted({run.case.seed for run in self.runs})

    @property
    def first_seed_runs(self) -> list[Run]:
        """The runs with the lowest seed: one of each kind, for pictures of one run."""
        return [run for run in self.runs if run.case.seed == self.seeds[0]]

    @property
    def pressure_unit(self) -> str:
        """The unit of the runs' pressures, for people; with an "or" where their readings have several."""
        return CASE_COLUMNS["pressure"].format_unit(self.length_units)

    @property
    def length_units(self) -> list[str]:
        """The units of length of the runs' readings, as files have them."""
        return [run.case.reading.length_unit for run in self.runs]

    def _judge_scene(self, shape: str, floor: str) -> claims.JudgedScene:
        """Judge the claims by the runs of one scene."""
        table = self.table
        if len(table):
            table = table[(table["shape"] == shape) & (table["floor"] == floor)]
        calibrated = self.experiment.calibrated_on == (shape, floor)
        missing = self.list_missing(c for c in self.runs if (c.case.shape.name, c.case.floor.name) == (shape, floor))
        verdicts = claims.judge_claims(self.runs[0].config.question.claims, table, calibrated, missing)
        return claims.JudgedScene(shape, floor, table, calibrated, verdicts, missing)

    def list_missing(self, runs: Iterable[Run]) -> list[tuple[str, float]]:
        """List arm and pressure of those of ``runs`` that have no result."""
        return [(run.case.arm, run.case.pressure) for run in runs if not self.is_done(run)]

    def is_done(self, run: Run) -> bool:
        """Return whether a run has a result."""
        return run.id not in self.missing


def gather_evidence(runs: Sequence[Run], folder: Path, with_results: bool = True, plan: Plan | None = None) -> Evidence:
    """Gather from the store what the runs of an experiment, or of any sweep, gave.

    ``with_results``: false where a report only shows what would be simulated; ``plan``: what asked for the runs.
    """
    experiment = find_experiment(runs, plan)
    done = [run for run in runs if with_results and run.is_done() and _has_row(run)]
    missing = {run.id for run in runs} - {run.id for run in done}
    return Evidence(experiment, runs, tabulate_runs(done), folder, frozenset(missing), plan)


def find_experiment(runs: Sequence[Run], plan: Plan | None = None) -> Experiment:
    """Return the experiment of runs, or one that shows any sweep; its title says what varies in their ``plan``."""
    varied = list_varied_keys(plan) if plan else []
    title = f"Sweep over {', '.join(varied)}" if varied else "Sweep"
    return runs[0].config.question.experiment or Experiment(name=OF_ANY_SWEEP, title=title, picture=OF_ANY_SWEEP)


def _has_row(run: Run) -> bool:
    """Whether the numbers of a run that looks done can be read; if not, it stands as broken from now on."""
    try:
        read_row(run)
    except BrokenResult:
        return False
    return True


def _bracket_half_pressure(scene: claims.JudgedScene) -> Crossing:
    """Bracket P50 of the sintered runs of a scene, by the seeds that have every pressure."""
    missing = sorted({pressure for arm, pressure in scene.missing if arm == ARMS[0]})
    if missing:
        return Crossing(note=f"no result at {', '.join(f'{p:g}' for p in missing)}")
    return bracket_half(claims.select_arm(scene.table, ARMS[0], "lump_fraction").dropna())


def read_origin(run: Run) -> tuple[str, str, str]:
    """Read versions, state of the code and machine that made a finished run from its manifest."""
    content = run.manifest()
    versions, code, machine = (str(content.get(key, "unknown")) for key in ("versions", "git_state", "machine"))
    return versions, code, machine


def command_to_repeat(overrides: Sequence[str]) -> str:
    """Write the command that repeats runs and report, wherever they are kept."""
    is_experiment = any(override.startswith("experiment=") for override in overrides)
    words = [override for override in overrides if not override.startswith(FOLDERS)]
    return shlex.join(["snowrepro", "run", *([] if is_experiment else ["-m"]), *words])


def sort_as_in_paper(runs: Sequence[Run]) -> list[Run]:
    """Sort runs as in the paper: sintered first, then by rising pressure and seed."""
    return sorted(runs, key=lambda run: (run.case.arm, run.case.pressure, run.case.seed))


def describe_run(run: Run) -> str:
    """Describe a run in a few words: scene, pressure, sintering, seed."""
    scene = f"{run.case.shape.name} on {run.case.floor.name}"
    test = ", indented" if run.case.indenter else ""
    return f"{scene}, {run.case.pressure:g}, {run.case.sintering.name}, seed {run.case.seed}{test}"
