"""What differs between two runs, or between two sweeps cell by cell."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from ..analysis.columns import ASKED, COST
from ..analysis.summary import summarise
from ..errors import ConfigError
from ..store import manifest, runs
from . import record
from .collect import Collected, collect, require_one_run_a_cell

MOST_LINES = 40
MEASURES = ("lump_fraction", "hardness")  # of a run that falls, of one that is indented
NOT_FOUND = {*ASKED, *COST}  # columns that are no finding: what was asked for, and what it cost
MADE_BY = ("model_version", "git_state", "code", "environment")


@dataclass(frozen=True)
class NumberChange:
    """A summary column that differs; a value None: that run does not have it; ``difference`` NaN: not of numbers."""

    name: str
    a: Any
    b: Any
    difference: float


@dataclass(frozen=True)
class ArrayChange:
    """An array that is not the same bits in both runs.

    ``form``: how they differ in kind or size, if they cannot be compared; else ``largest``: the largest absolute
    difference, infinite where only one holds a number, and ``frame``: the first frame or snapshot that differs, None
    where the array is none over time.
    """

    name: str
    form: str = ""
    largest: float = np.nan
    frame: int | None = None


@dataclass(frozen=True)
class RunDifferences:
    """How run ``b`` differs from run ``a``: setting by setting, in what made it, number by number, array by array.

    ``made``: of code and environment, "key before -> now"; None where a manifest is missing, so it cannot be told.
    """

    a: str
    b: str
    config: list[str]
    made: list[str] | None
    numbers: list[NumberChange]
    arrays: list[ArrayChange]


@dataclass(frozen=True)
class SweepDifferences:
    """How sweep ``b`` differs from sweep ``a``, in the cells that both have.

    ``config``: settings that differ in the first of these cells.  ``cells``: coordinates, ``measure``,
    ``a``, ``b`` and ``difference`` where both have a result; ``lacking``: coordinates and both states where not,
    or where one falls and the other is indented.
    ``only_a``, ``only_b``: coordinates of the cells that one sweep alone asks for.
    """

    a: str
    b: str
    config: list[str]
    cells: pd.DataFrame
    lacking: pd.DataFrame
    only_a: pd.DataFrame
    only_b: pd.DataFrame


def diff_command_lines(a: str, b: str, store: str | Path = "runs") -> list[str]:
    """What ``snowrepro diff`` prints of two runs (ids, folders or files) or of two recorded sweeps (names).

    Raises ConfigError where ``a`` and ``b`` are not of one kind, and StoreError where there is no such run.
    """
    sweeps = [name for name in (a, b) if name in record.names(store)]
    if len(sweeps) == 2:
        return sweep_lines(compare_sweeps(*(collect(record.plan_of(name, store)) for name in sweeps)))
    if sweeps:
        other = b if sweeps == [a] else a
        raise ConfigError(f"'{sweeps[0]}' is a sweep and '{other}' is none: name two runs or two sweeps")
    return run_lines(compare_runs(a, b, store))


def compare_runs(a: str | Path, b: str | Path, store: str | Path = "runs") -> RunDifferences:
    """Compare two runs, each an id in ``store``, a folder or a file.

    Raises StoreError where there is no such run, and ConfigError where a file is none.
    """
    with runs.open_run(a, store) as first, runs.open_run(b, store) as second:
        names = dict.fromkeys([*first.variables, *second.variables])
        return RunDifferences(
            _name(first, a),
            _name(second, b),
            config=manifest.differences(_config(first, a), _config(second, b)),
            made=_made(first, second),
            numbers=_numbers(summarise(first), summarise(second)),
            arrays=[change for name in names if (change := _array(first, second, name))],
        )


def compare_sweeps(a: Collected, b: Collected) -> SweepDifferences:
    """Compare two sweeps cell by cell.

    A coordinate with one value in each sweep is not needed to match cells: if that differs, it is among the settings
    that do.  Raises ConfigError where the sweeps do not vary the same keys, or have two runs in a cell.
    """
    dims = _matching_dims(a, b)
    both = _cells(a, dims).merge(_cells(b, dims), on=dims, how="outer", suffixes=("_a", "_b"), indicator="side")
    matched = both[both["side"] == "both"]
    has = matched["measure_a"].notna() & (matched["measure_a"] == matched["measure_b"])
    cells = matched.loc[has, [*dims, "measure_a", "value_a", "value_b"]]
    cells.columns = [*dims, "measure", "a", "b"]
    return SweepDifferences(
        a.name,
        b.name,
        config=_asked_otherwise(a, b, matched),
        cells=cells.assign(difference=cells["b"] - cells["a"]).reset_index(drop=True),
        lacking=matched.loc[~has, [*dims, "state_a", "state_b"]].reset_index(drop=True),
        only_a=both.loc[both["side"] == "left_only", dims].reset_index(drop=True),
        only_b=both.loc[both["side"] == "right_only", dims].reset_index(drop=True),
    )


def run_lines(found: RunDifferences) -> list[str]:
    """The differences of two runs as text."""
    made = ["not known, as a manifest is missing"] if found.made is None else pairs(found.made)
    return [
        f"a: {found.a}",
        f"b: {found.b}",
        *listed("configuration", pairs(found.config), "the same configuration"),
        *listed("code and environment", made, "the same code and environment"),
        *listed("summary", [number_line(number) for number in found.numbers], "the same summary"),
        *listed("arrays", [array_line(array) for array in found.arrays], "the same bits"),
    ]


def sweep_lines(found: SweepDifferences) -> list[str]:
    """The differences of two sweeps as text: of each measure in a line, then the cells, largest change first."""
    dims = list(found.only_a.columns)
    cells = found.cells.loc[found.cells["difference"].abs().sort_values(ascending=False, kind="stable").index]
    changed = cells[cells["difference"] != 0]
    changes = [
        f"{cell}: {measure} {_text(a)} -> {_text(b)}{_by(difference)}"
        for cell, (measure, a, b, difference) in zip(
            _labels(changed, dims),
            changed[["measure", "a", "b", "difference"]].itertuples(index=False),
            strict=True,
        )
    ]
    lacking = [
        f"{cell}: {a} in a, {b} in b"
        for cell, a, b in zip(
            _labels(found.lacking, dims), found.lacking["state_a"], found.lacking["state_b"], strict=True
        )
    ]
    return [
        f"a: {found.a}",
        f"b: {found.b}",
        *listed("configuration, in the first cell of both", pairs(found.config), "the same configuration"),
        *(_summary_line(name, of, dims) for name, of in cells.groupby("measure")),
        *listed("cells that changed, largest first", changes, "no cell changed" if len(cells) else ""),
        *listed("cells without results to compare", lacking),
        *listed("cells in a only", _labels(found.only_a, dims)),
        *listed("cells in b only", _labels(found.only_b, dims)),
    ]


def _name(dataset: xr.Dataset, given: str | Path) -> str:
    return str(dataset.attrs.get("run_id", given))


def _config(dataset: xr.Dataset, given: str | Path) -> dict[str, Any]:
    """The settings of a run, as it was made.  Raises ConfigError if the file is no run."""
    if "config" not in dataset.attrs:
        raise ConfigError(f"'{given}' is no run of snowrepro: it carries no configuration")
    said = json.loads(dataset.attrs["config"])
    return {key: value for key, value in said.items() if key not in runs.NOT_IN_MANIFEST}


def _made(first: xr.Dataset, second: xr.Dataset) -> list[str] | None:
    """How code and environment differ, by the manifests beside the files; None where one is missing."""
    a, b = (manifest.read(Path(dataset.encoding["source"]).parent) for dataset in (first, second))
    if not a or not b:
        return None
    return made_otherwise(a, b)


def made_otherwise(a: Mapping[str, Any], b: Mapping[str, Any]) -> list[str]:
    """How code and environment differ by two manifests, each as "key before -> now"."""
    return manifest.differences({key: a.get(key) for key in MADE_BY}, {key: b.get(key) for key in MADE_BY})


def _numbers(a: dict[str, Any], b: dict[str, Any]) -> list[NumberChange]:
    """The findings of two summaries that differ."""
    changes = []
    for name in dict.fromkeys([*a, *b]):
        old, new = a.get(name), b.get(name)
        both_nan = old != old and new != new
        if name not in NOT_FOUND and old != new and not both_nan:
            numeric = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (old, new))
            changes.append(NumberChange(name, old, new, float(new - old) if numeric else np.nan))
    return changes


def _array(first: xr.Dataset, second: xr.Dataset, name: str) -> ArrayChange | None:
    """How an array differs; None if it is the same bits."""
    if name not in first.variables or name not in second.variables:
        return ArrayChange(name, "in a only" if name in first.variables else "in b only")
    a, b = first[name].values, second[name].values
    if a.shape != b.shape or a.dtype != b.dtype:
        return ArrayChange(name, f"{a.dtype} {a.shape} in a, {b.dtype} {b.shape} in b")
    if a.dtype.kind not in "fiu":
        return None if np.array_equal(a, b) else ArrayChange(name, "other values")
    places = np.argwhere(_bits(a) != _bits(b))
    if not len(places):
        return None
    along = first[name].dims[0]
    frame = int(first[along][places[0, 0]]) if along in ("frame", "snapshot") else None
    return ArrayChange(name, largest=_largest(a.astype(float), b.astype(float)), frame=frame)


def _bits(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values).view(f"u{values.itemsize}")


def _largest(a: np.ndarray, b: np.ndarray) -> float:
    """The largest absolute difference: none between two NaN, infinite between NaN and a number."""
    same = (a == b) | (np.isnan(a) & np.isnan(b))
    with np.errstate(invalid="ignore"):
        gap = np.where(same, 0.0, abs(a - b))
    return float(np.nan_to_num(gap, nan=np.inf, posinf=np.inf).max())


def _matching_dims(a: Collected, b: Collected) -> list[str]:
    """The coordinates that cells are matched by.  Raises ConfigError where there is no matching them."""
    for found in (a, b):
        require_one_run_a_cell(found)
    if set(a.further) != set(b.further):
        keys = sorted({*a.further.values()} ^ {*b.further.values()})
        raise ConfigError(f"only one of the sweeps varies {', '.join(keys)}: their cells cannot be matched")

    def differs_throughout(dim: str) -> bool:
        values = a.table[dim].unique(), b.table[dim].unique()
        return all(len(own) == 1 for own in values) and values[0][0] != values[1][0]

    dims = [dim for dim in a.dims if not differs_throughout(dim)]
    if not dims:
        raise ConfigError("the sweeps have no coordinate in common: compare two runs")
    return dims


def _cells(found: Collected, dims: Sequence[str]) -> pd.DataFrame:
    """Each run's coordinates, row in the table, state, and the measure that it has with its value."""
    table = found.table
    cells = table[[*dims, "state"]].assign(row=np.arange(len(table)), measure=None, value=np.nan)
    for measure in MEASURES:
        if measure in table:
            has = table[measure].notna()
            cells.loc[has, "measure"] = measure
            cells.loc[has, "value"] = table.loc[has, measure]
    return cells


def _asked_otherwise(a: Collected, b: Collected, matched: pd.DataFrame) -> list[str]:
    """The settings that differ in the first of the matched cells."""
    if matched.empty:
        return []
    first = matched.iloc[0]
    configs = a.configs[int(first["row_a"])], b.configs[int(first["row_b"])]
    return manifest.differences(*(config.model_dump(mode="json", exclude=runs.NOT_IN_MANIFEST) for config in configs))


def _summary_line(measure: str, cells: pd.DataFrame, dims: Sequence[str]) -> str:
    """How much a measure changed over cells that begin with the one that changed most."""
    change = cells["difference"]
    text = f"{measure}: {len(cells)} cells, {int((change == 0).sum())} the same"
    if not change.any():
        return text
    (largest,) = _labels(cells.head(1), dims)
    return f"{text}, median change {change.median():+.4g}, largest {change.iloc[0]:+.4g} at {largest}"


def _labels(cells: pd.DataFrame, dims: Sequence[str]) -> list[str]:
    """The coordinates of each cell in words."""
    return [
        ", ".join(f"{dim} {_text(value)}" for dim, value in zip(dims, row, strict=True))
        for row in cells[list(dims)].itertuples(index=False)
    ]


def number_line(number: NumberChange) -> str:
    """How a column of the summary differs, in words."""
    return f"{number.name}: {_text(number.a)} -> {_text(number.b)}{_by(number.difference)}"


def array_line(array: ArrayChange) -> str:
    """How an array differs, in words."""
    if array.form:
        return f"{array.name}: {array.form}"
    since = "" if array.frame is None else f", first in frame {array.frame}"
    return f"{array.name}: by at most {array.largest:.4g}{since}"


def pairs(differences: Sequence[str]) -> list[str]:
    """Differences as ``manifest.differences`` writes them, with a colon behind the key."""
    return [line.replace(" ", ": ", 1) for line in differences]


def listed(title: str, lines: Sequence[str], otherwise: str = "") -> list[str]:
    """A titled list that is cut where it gets long; without lines, what is said instead."""
    if not lines:
        return [otherwise] if otherwise else []
    rest = [f"  ... and {len(lines) - MOST_LINES} more"] if len(lines) > MOST_LINES else []
    return [f"{title}:", *(f"  {line}" for line in lines[:MOST_LINES]), *rest]


def _text(value: Any) -> str:
    return "nothing" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


def _by(difference: float) -> str:
    return "" if np.isnan(difference) else f" ({difference:+.4g})"
