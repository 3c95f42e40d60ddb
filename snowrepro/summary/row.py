"""The row of numbers of a finished run and the strains of its bonds, stored beside its result."""

import functools
import hashlib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import pandas as pd
import xarray as xr

from ..composition.compose import config_of
from ..errors import SnowreproError, StoreError
from ..settings.analysis import Analysis
from ..sources import digest_of
from ..store import cf
from ..store.run import Run
from .classify import read_analysis
from .columns import CASE_COLUMNS, COMMON_COLUMNS, COST_COLUMNS, FALL_COLUMNS, SCALE_COLUMNS, TEST_COLUMNS
from .measure import classify_ends, make_bond_dataset, measure_run
from .scales import measure_scales

CODE = digest_of("summary.measure")  # as this process has loaded it, whatever is written meanwhile
BONDS = {  # arrays that a report draws
    "fragment_mass", "mass", "state", "broken_both", "broken_stretch", "part_lump", "part_crushed", "part_loose",
}  # fmt: skip
ALL_COLUMNS = {
    **CASE_COLUMNS, **SCALE_COLUMNS, **COMMON_COLUMNS, **FALL_COLUMNS, **TEST_COLUMNS, **COST_COLUMNS,
}  # fmt: skip
# What is raised where data does not hold what a run does.
NO_RESULT = (KeyError, ValueError, IndexError, TypeError, AttributeError, ArithmeticError, OSError, RuntimeError)
ARM = "arm"  # a column of ``tabulate_runs`` that no file has: which of ``settings.case.ARMS`` a run belongs to


def summarise(dataset: xr.Dataset, analysis: Analysis | None = None) -> dict[str, Any]:
    """Return the row of a run: what was simulated, what broke, what had to be bounded, what it cost; by column name.

    Raises StoreError if the data is not that of a run.
    """
    try:
        dataset = cf.run_as_read(dataset)
        row = measure_run(dataset, classify_ends(dataset, analysis or read_analysis(dataset)))
        return {**row, **measure_scales(config_of(dataset).case)}
    except SnowreproError:
        raise
    except NO_RESULT as error:
        raise StoreError(f"this is no whole run of snowrepro: {type(error).__name__}: {error}") from error


def read_row(run: Run) -> dict[str, Any]:
    """Return the row of a finished run: as it is stored beside the result, or computed and stored where it is not.

    What the configuration alone says is not stored: it is known of older rows too.
    """
    row = run.row(make_key(run.config.question.analysis))
    measured = _analyse(run)[0] if row is None or not _has_right_types(row) else row
    return {**measured, **measure_scales(run.case)}


def read_bonds(run: Run) -> xr.Dataset:
    """Return the bonds of a finished run with their strains, stored likewise: see ``make_bond_dataset``."""
    bonds = run.analysis(make_key(run.config.question.analysis))
    return _analyse(run)[1] if bonds is None or not {*bonds.variables} >= BONDS else bonds


def _has_right_types(row: Mapping[str, Any]) -> bool:
    """Whether a row holds text in columns of text, and numbers in the others."""
    return all(isinstance(row[name], str) == column.is_text for name, column in ALL_COLUMNS.items() if name in row)


def tabulate_runs(runs: Sequence[Run]) -> pd.DataFrame:
    """Tabulate finished runs, a row each, with their ARM.

    Scene by scene in the order of the runs, sintered first, then by pressure and seed.
    """
    scenes = list(dict.fromkeys((run.case.shape.name, run.case.floor.name) for run in runs))

    def rank(run: Run) -> tuple:
        """Return what the rows are sorted by."""
        case = run.case
        scene = scenes.index((case.shape.name, case.floor.name))
        return scene, case.arm, case.sintering.name, case.pressure, case.seed, case.indenter is not None

    return pd.DataFrame([{**read_row(run), ARM: run.case.arm} for run in sorted(runs, key=rank)])


def _analyse(run: Run) -> tuple[dict[str, Any], xr.Dataset]:
    """Compute the row and the bonds of a finished run, and store both beside its result."""
    analysis = run.config.question.analysis
    with run.open() as dataset:
        try:
            ends = classify_ends(dataset, analysis)
            row = measure_run(dataset, ends)
        except NO_RESULT as error:
            raise run.broken(f"the result cannot be measured: {type(error).__name__}: {error}") from error
    bonds = make_bond_dataset(ends)
    with suppress(StoreError):  # a store that cannot be written to can still be read
        run.save_analysis(make_key(analysis), bonds)
        run.save_row(make_key(analysis), row)
    return row, bonds


@functools.cache
def make_key(analysis: Analysis) -> str:
    """Make the key that a row is stored under: a digest of the analysis settings and of the code that computes it."""
    return hashlib.sha256(f"{analysis.model_dump_json()} {CODE}".encode()).hexdigest()[:16]
