"""The differences between two runs, or between two sweeps cell by cell."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from ..errors import ConfigError, StoreError
from ..foreign import parse_json
from ..settings.config import NOT_RECORDED
from ..store import manifest
from ..store.find import find_result, open_run
from ..summary.columns import CASE_COLUMNS, COST_COLUMNS, SCALE_COLUMNS
from ..summary.row import summarise
from ..sweep import record
from .collect import CollectedSweep, collect_sweep, require_one_run_per_cell

MOST_LINES = 40
MEASURES = ("lump_fraction", "hardness")  # compared for a run that falls, and for one that is indented
NOT_COMPARED = {*CASE_COLUMNS, *SCALE_COLUMNS, *COST_COLUMNS}  # what is no result: settings and cost
MADE_BY = ("model_version", "git_state", "code", "environment")


@dataclass(frozen=True)
class NumberChange:
    """A column of the rows of numbers that differs; None: that run does not have it.

    ``difference``: of ``b`` from ``a``, NaN where they are no numbers.
    """

    name: str
    a: Any
    b: Any
    difference: float


@dataclass(frozen=True)
class ArrayChange:
    """An array whose bits are not the same in both runs.

    ``form``: how they differ in kind or size, where they cannot be compared; else ``largest``: the largest absolute
    difference, infinite where only one holds a number, and ``frame``: the first frame or snapshot that differs, None
    for an array that is not over time.
    """

    name: str
    form: str = ""
    largest: float = np.nan
    frame: int | None = None


@dataclass(frozen=True)
class RunDifferences:
    """The differences of run ``b`` from run ``a``: in settings, in code and environment, in numbers and in arrays.

    ``config``: settings, each as "key before -> now"; ``made``: code and environment likewise, None where a manifest is
    missing, so that it is not known.
    """

    a: str
    b: str
    config: list[str]
    made: list[str] | None
    numbers: list[NumberChange]
    arrays: list[ArrayChange]


@dataclass(frozen=True)
class SweepDifferences:
    """The differences of sweep ``b`` from sweep ``a`` in the cells that both have.

    ``config``: settings that differ in the first of these cells.  ``cells``: coordinates, ``measure``, ``a``, ``b`` and
    ``difference`` where both have a result; ``lacking``: coordinates and both states where they do not, or where one
    run falls and the other is indented.  ``only_a``, ``only_b``: coordinates of the cells of one sweep alone.
    """

    a: str
    b: str
    config: list[str]
    cells: pd.DataFrame
    lacking: pd.DataFrame
    only_a: pd.DataFrame
    only_b: pd.DataFrame


def describe_differences(a: str, b: str, store: str | Path = "runs") -> list[str]:
    """Describe the differences of two runs (ids, folders or files) or of two recorded sweeps (names), as lines.

    What a name and an id may be short for, say ``record.find_sweep`` and ``store.find.find_id``.

    Raises ConfigError where ``a`` and ``b`` are not of one kind, and StoreError where there is no such run.
    """
    sweeps = [name for word in (a, b) if (name := record.find_sweep(word, store, is_name=True))]
    if len(sweeps) == 2:
        return describe_sweep_differences(
            compare_sweeps(*(collect_sweep(record.plan_remembered(name, store)) for name in sweeps))
        )
    if sweeps:
        other = b if record.find_sweep(a, store, is_name=True) else a
        raise ConfigError(f"'{sweeps[0]}' is a sweep and '{other}' is none: name two runs or two sweeps")
    for word in (a, b):
        _require_run(word, store)
    return describe_run_differences(compare_runs(a, b, store))


def _require_run(name: str, store: str | Path) -> None:
    """Raise StoreError where there is no such run, with the sweeps that may be meant."""
    try:
        find_result(name, store)
    except StoreError as error:
        raise StoreError(f"{error}; sweeps are: {record.name_nearest(name, store)}") from error


def compare_runs(a: str | Path, b: str | Path, store: str | Path = "runs") -> RunDifferences:
    """Compare two runs, each an id in ``store`` (or its beginning or end), a folder or a file.

    Raises StoreError where there is no such run, and ConfigError where a file is none.
    """
    with open_run(a, store) as first, open_run(b, store) as second:
        names = dict.fromkeys(str(name) for name in (*first.variables, *second.variables))
        return RunDifferences(
            _read_name(first, a),
            _read_name(second, b),
            config=manifest.differences(_read_settings(first, a), _read_settings(second, b)),
            made=_compare_origins(first, second),
            numbers=_compare_numbers(summarise(first), summarise(second)),
            arrays=[change for name in names if (change := _compare_arrays(first, second, name))],
        )


def compare_sweeps(a: CollectedSweep, b: CollectedSweep) -> SweepDifferences:
    """Compare two sweeps cell by cell.

    A coordinate that has one value in each sweep does not decide which cells match: where the two values differ, they
    are among the settings that differ.  Raises ConfigError where the sweeps do not vary the same keys, or have two runs
    in a cell.
    """
    dims = _find_matching_dims(a, b)
    cells_of_both = _tabulate_cells(a, dims).merge(
        _tabulate_cells(b, dims), on=dims, how="outer", suffixes=("_a", "_b"), indicator="side"
    )
    matched = cells_of_both[cells_of_both["side"] == "both"]
    has_result = matched["measure_a"].notna() & (matched["measure_a"] == matched["measure_b"])
    cells = matched.loc[has_result, [*dims, "measure_a", "value_a", "value_b"]]
    cells.columns = [*dims, "measure", "a", "b"]
    return SweepDifferences(
        a.name,
        b.name,
        config=_compare_settings(a, b, matched),
        cells=cells.assign(difference=cells["b"] - cells["a"]).reset_index(drop=True),
        lacking=matched.loc[~has_result, [*dims, "state_a", "state_b"]].reset_index(drop=True),
        only_a=cells_of_both.loc[cells_of_both["side"] == "left_only", dims].reset_index(drop=True),
        only_b=cells_of_both.loc[cells_of_both["side"] == "right_only", dims].reset_index(drop=True),
    )


def describe_run_differences(differences: RunDifferences) -> list[str]:
    """Describe the differences of two runs, as lines."""
    origin = ["not known, as a manifest is missing"] if differences.made is None else add_colons(differences.made)
    return [
        f"a: {differences.a}",
        f"b: {differences.b}",
        *list_under_title("configuration", add_colons(differences.config), "the same configuration"),
        *list_under_title("code and environment", origin, "the same code and environment"),
        *list_under_title("summary", [describe_number(number) for number in differences.numbers], "the same summary"),
        *list_under_title("arrays", [describe_array(array) for array in differences.arrays], "the same bits"),
    ]


def describe_sweep_differences(differences: SweepDifferences) -> list[str]:
    """Describe the differences of two sweeps, as lines: each measure, then the cells, largest change first."""
    dims = list(differences.only_a.columns)
    sizes = differences.cells["difference"].abs()
    cells = differences.cells.loc[sizes.sort_values(ascending=False, kind="stable").index]
    changed = cells[cells["difference"] != 0]
    changes = [
        f"{cell}: {measure} {_format_value(a)} -> {_format_value(b)}{_format_difference(difference)}"
        for cell, (measure, a, b, difference) in zip(
            _label_cells(changed, dims),
            changed[["measure", "a", "b", "difference"]].itertuples(index=False),
            strict=True,
        )
    ]
    lacking = [
        f"{cell}: {a} in a, {b} in b"
        for cell, a, b in zip(
            _label_cells(differences.lacking, dims),
            differences.lacking["state_a"],
            differences.lacking["state_b"],
            strict=True,
        )
    ]
    has_common = len(differences.cells) or len(differences.lacking)
    where = "in the first cell of both" if has_common else "in the first run of each, as no cell is in both"
    return [
        f"a: {differences.a}",
        f"b: {differences.b}",
        *list_under_title(f"configuration, {where}", add_colons(differences.config), "the same configuration"),
        *(_describe_measure(name, of, dims) for name, of in cells.groupby("measure")),
        *list_under_title("cells that changed, largest first", changes, "no cell changed" if len(cells) else ""),
        *list_under_title("cells without results to compare", lacking),
        *list_under_title("cells in a only", _label_cells(differences.only_a, dims)),
        *list_under_title("cells in b only", _label_cells(differences.only_b, dims)),
    ]


def _read_name(dataset: xr.Dataset, name: str | Path) -> str:
    """Read the id of a run; ``name`` for data without one."""
    return str(dataset.attrs.get("run_id", name))


def _read_settings(dataset: xr.Dataset, name: str | Path) -> dict[str, Any]:
    """Read the settings that a run was made with.  Raises ConfigError where the file is no run."""
    if "config" not in dataset.attrs:
        raise ConfigError(f"'{name}' is no run of snowrepro: it carries no configuration")
    try:
        settings = parse_json(dataset.attrs["config"])
    except (ValueError, TypeError) as error:
        raise ConfigError(f"the configuration in '{name}' cannot be read: {error}") from error
    return {key: value for key, value in settings.items() if key not in NOT_RECORDED}


def _compare_origins(first: xr.Dataset, second: xr.Dataset) -> list[str] | None:
    """Compare code and environment of two runs by the manifests beside their files; None where one is missing."""
    a, b = (manifest.read(Path(dataset.encoding["source"]).parent) for dataset in (first, second))
    if not a or not b:
        return None
    return compare_origins(a, b)


def compare_origins(a: Mapping[str, Any], b: Mapping[str, Any]) -> list[str]:
    """Compare code and environment in two manifests; returns each difference as "key before -> now"."""
    return manifest.differences({key: a.get(key) for key in MADE_BY}, {key: b.get(key) for key in MADE_BY})


def _is_nan(value: Any) -> bool:
    """Whether a cell of a row is the number NaN; a row holds text and counts too."""
    return isinstance(value, float) and np.isnan(value)


def _compare_numbers(a: dict[str, Any], b: dict[str, Any]) -> list[NumberChange]:
    """Compare two rows of numbers; returns the columns that differ and are results."""
    changes = []
    for name in dict.fromkeys([*a, *b]):
        old, new = a.get(name), b.get(name)
        both_nan = _is_nan(old) and _is_nan(new)
        if name not in NOT_COMPARED and old != new and not both_nan:
            changes.append(NumberChange(name, old, new, _subtract(old, new)))
    return changes


def _subtract(old: Any, new: Any) -> float:
    """Return ``new`` less ``old``; NaN where one of them is no number, or a yes or no."""
    if isinstance(old, bool) or isinstance(new, bool):
        return float("nan")
    return float(new - old) if isinstance(old, int | float) and isinstance(new, int | float) else float("nan")


def _compare_arrays(first: xr.Dataset, second: xr.Dataset, name: str) -> ArrayChange | None:
    """Compare an array of two runs; None where the bits are the same."""
    if name not in first.variables or name not in second.variables:
        return ArrayChange(name, "in a only" if name in first.variables else "in b only")
    a, b = first[name].values, second[name].values
    if a.shape != b.shape or a.dtype != b.dtype:
        return ArrayChange(name, f"{a.dtype} {a.shape} in a, {b.dtype} {b.shape} in b")
    if a.dtype.kind not in "fiu":
        return None if np.array_equal(a, b) else ArrayChange(name, "other values")
    places = np.argwhere(_view_bits(a) != _view_bits(b))
    if not len(places):
        return None
    along = first[name].dims[0]
    frame = int(first[along][places[0, 0]]) if along in ("frame", "snapshot") else None
    return ArrayChange(name, largest=_find_largest_difference(a.astype(float), b.astype(float)), frame=frame)


def _view_bits(values: np.ndarray) -> np.ndarray:
    """Return the bits of numbers as whole numbers of the same size."""
    return np.ascontiguousarray(values).view(f"u{values.itemsize}")


def _find_largest_difference(a: np.ndarray, b: np.ndarray) -> float:
    """Find the largest absolute difference: 0 between two NaN, infinite between NaN and a number."""
    same = (a == b) | (np.isnan(a) & np.isnan(b))
    with np.errstate(invalid="ignore"):
        gap = np.where(same, 0.0, abs(a - b))
    return float(np.nan_to_num(gap, nan=np.inf, posinf=np.inf).max())


def _find_matching_dims(a: CollectedSweep, b: CollectedSweep) -> list[str]:
    """Find the coordinates by which cells are matched.  Raises ConfigError where they cannot be matched."""
    for sweep in (a, b):
        require_one_run_per_cell(sweep)
    if set(a.further) != set(b.further):
        keys = sorted({*a.further.values()} ^ {*b.further.values()})
        raise ConfigError(f"only one of the sweeps varies {', '.join(keys)}: their cells cannot be matched")

    def differs_throughout(dim: str) -> bool:
        """Return whether each sweep has one value of a coordinate, and another than the other sweep."""
        values = a.table[dim].unique(), b.table[dim].unique()
        return all(len(values_of_one) == 1 for values_of_one in values) and values[0][0] != values[1][0]

    dims = [dim for dim in a.dims if not differs_throughout(dim)]
    if not dims:
        raise ConfigError("the sweeps have no coordinate in common: compare two runs")
    return dims


def _tabulate_cells(sweep: CollectedSweep, dims: Sequence[str]) -> pd.DataFrame:
    """Tabulate each run's coordinates, row in the sweep's table, state, and its measure with its value."""
    table = sweep.table
    cells = table[[*dims, "state"]].assign(row=np.arange(len(table)), measure=None, value=np.nan)
    for measure in MEASURES:
        if measure in table:
            has_value = table[measure].notna()
            cells.loc[has_value, "measure"] = measure
            cells.loc[has_value, "value"] = table.loc[has_value, measure]
    return cells


def _compare_settings(a: CollectedSweep, b: CollectedSweep, matched: pd.DataFrame) -> list[str]:
    """Compare the settings of both runs in the first of the matched cells, each difference as "key before -> now".

    Where no cell is matched the first run of each sweep is compared.
    """
    rows = (0, 0) if matched.empty else (int(matched.iloc[0]["row_a"]), int(matched.iloc[0]["row_b"]))
    before, now = a.runs[rows[0]], b.runs[rows[1]]
    return manifest.differences(before.config.record(), now.config.record())


def _describe_measure(measure: str, cells: pd.DataFrame, dims: Sequence[str]) -> str:
    """Describe how much a measure changed over cells, of which the first changed most."""
    change = cells["difference"]
    text = f"{measure}: {len(cells)} cells, {int((change == 0).sum())} the same"
    if not change.any():
        return text
    (largest,) = _label_cells(cells.head(1), dims)
    return f"{text}, median change {change.median():+.4g}, largest {change.iloc[0]:+.4g} at {largest}"


def _label_cells(cells: pd.DataFrame, dims: Sequence[str]) -> list[str]:
    """Describe the coordinates of each cell in words."""
    return [
        ", ".join(f"{dim} {_format_value(value)}" for dim, value in zip(dims, row, strict=True))
        for row in cells[list(dims)].itertuples(index=False)
    ]


def describe_number(number: NumberChange) -> str:
    """Describe how a column of the rows of numbers differs."""
    return (
        f"{number.name}: {_format_value(number.a)} -> {_format_value(number.b)}{_format_difference(number.difference)}"
    )


def describe_array(array: ArrayChange) -> str:
    """Describe how an array differs."""
    if array.form:
        return f"{array.name}: {array.form}"
    since = "" if array.frame is None else f", first in frame {array.frame}"
    return f"{array.name}: by at most {array.largest:.4g}{since}"


def add_colons(differences: Sequence[str]) -> list[str]:
    """Put a colon behind the key of each difference that ``manifest.differences`` wrote."""
    return [line.replace(" ", ": ", 1) for line in differences]


def list_under_title(title: str, lines: Sequence[str], otherwise: str = "") -> list[str]:
    """List lines under a title, cut after MOST_LINES; without lines return ``otherwise`` as the only one."""
    if not lines:
        return [otherwise] if otherwise else []
    rest = [f"  ... and {len(lines) - MOST_LINES} more"] if len(lines) > MOST_LINES else []
    return [f"{title}:", *(f"  {line}" for line in lines[:MOST_LINES]), *rest]


def _format_value(value: Any) -> str:
    """Write a value, numbers with six digits."""
    return "nothing" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


def _format_difference(difference: float) -> str:
    """Write a difference in brackets; empty where it is NaN."""
    return "" if np.isnan(difference) else f" ({difference:+.4g})"
