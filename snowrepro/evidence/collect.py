"""The numbers of all runs of a sweep: as a table with a row for each run, or as a grid over what was varied."""

import logging
import sys
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from ..errors import ConfigError, StoreError
from ..store import cf, states
from ..store.files import published
from ..store.netcdf import UNREADABLE, open_netcdf, write_netcdf
from ..store.run import Run
from ..summary.columns import CASE_COLUMNS, Column, find_columns
from ..summary.row import read_row
from ..sweep import record
from ..sweep.plan import Plan
from ..sweep.sample import Sample
from ..text import make_cells

log = logging.getLogger("snowrepro")

CSV, NETCDF = "results.csv", "results.nc"
ALWAYS = ("pressure", "shape", "floor", "sintering", "seed")
NOT_FURTHER = (*ALWAYS, "scene")  # a scene is a shape and a floor
POINT = "point"  # of a design
NOT_IN_SWEEP = "not asked for"
MOST_CELLS = 2_000_000  # of a grid: half a kilobyte each
LEAST_PACKED = 100  # numbers: fewer take more room packed
PACKED = {"zlib": True, "complevel": 1}
MOST_NAMED = 50
MOST_LETTERS = 80
PROVENANCE = ("created", "git_state", "versions", "machine")
COMMENT = (
    "A cell whose state is not 'done' has no result: NaN in numbers, counts and yes/no (1/0) alike, and no text in "
    f"words. Cells of the grid that the sweep did not ask for have the state '{NOT_IN_SWEEP}' and no run_id."
)


@dataclass(frozen=True)
class CollectedSweep:
    """A sweep with the numbers of its runs.

    ``table``: a row for each run, see ``sweep_table``; ``runs``: of its rows; ``further``: the key in the configuration
    of each coordinate beside ALWAYS; ``sample``: what a design sampled, if one did: then the table has a column POINT;
    ``columns``: what the table's columns of numbers mean; ``length_unit``: of all
    runs, or "length" where they differ in it; ``made``: when the last result was made, and by which code, versions and
    machines.
    """

    name: str
    overrides: tuple[str, ...]
    table: pd.DataFrame
    runs: tuple[Run, ...]
    further: Mapping[str, str]
    columns: Mapping[str, Column]
    length_unit: str
    made: Mapping[str, str]
    sample: Sample | None = None

    @property
    def factors(self) -> list[str]:
        """The names of the coordinates that a design sampled, but for what came out the same at all points."""
        names = map(_name_dimension, self.sample.keys) if self.sample else ()
        return [name for name in names if name in self.table]

    @property
    def grid_dims(self) -> list[str]:
        """The names of the coordinates that span a grid: the points of a design in place of what it sampled."""
        points = [POINT] if POINT in self.table else []
        return [*points, *(dim for dim in self.dims if dim not in self.factors)]

    @property
    def dims(self) -> list[str]:
        """The names of the coordinates, by which the runs differ."""
        return [*ALWAYS, *self.further]

    @property
    def varied(self) -> list[str]:
        """The names of the coordinates that have more than one value."""
        return [dim for dim in self.dims if len(self.table[dim].unique()) > 1]

    def key_of(self, name: str) -> str:
        """Return the setting that a coordinate is of, as one types it; any other column as it is called."""
        return self.further.get(name, name)


@dataclass(frozen=True, slots=True)
class _RunRecord:
    """The state of a run; with a result also its row of numbers, and when and by what it was made (PROVENANCE)."""

    run_id: str
    state: str
    reason: str
    row: Mapping[str, Any] | None = None
    made: tuple[str, ...] | None = None


def open_sweep(name: str | Path, store: str | Path = "runs") -> xr.Dataset:
    """Open the numbers of a recorded sweep's finished runs as a grid.

    Dimensions are pressure, shape, floor, sintering and seed, always, and one for each further key that the sweep
    varies, with its values as text: numbers rise, names keep their order in the sweep.  Variables: every column of
    the rows of numbers as float (counts and yes/no too), NaN where there is no result, or as text, empty there; and
    ``state`` and ``run_id`` of each run.  A cell that the sweep does not ask for has the state "not asked for".
    Of a sweep that a design sampled the points are a dimension, and what was sampled are coordinates along it.
    ``name`` may also be the path of a results.nc: then the grid is the one that it holds.
    An experiment's name stands for its newest sweep: see ``record.find_sweep``.
    Raises ConfigError where there is no such sweep, or where it makes no grid; then ``sweep_table`` still works.
    """
    if Path(name).suffix == ".nc":
        return _read_grid(Path(name))
    return make_grid(collect_sweep(record.plan_remembered(str(name), store)))


def _read_grid(path: Path) -> xr.Dataset:
    """Read the grid of a results.nc.  Raises ConfigError where the file cannot be read as one."""
    try:
        with open_netcdf(path) as dataset:
            return cf.sweep_as_read(dataset.load())
    except (StoreError, *UNREADABLE) as error:
        raise ConfigError(f"{path} cannot be read as the results of a sweep: {error}") from error


def sweep_table(name: str, store: str | Path = "runs") -> pd.DataFrame:
    """Return a recorded sweep as a table with a row for each of its runs, in its order.

    Name and coordinates as in ``open_sweep``, ``run_id``, ``state``, ``reason`` and the summary columns, NaN where
    there is no result.  Its ``attrs`` have the sweep's name and the unit of length of its runs.
    Raises ConfigError where there is no such sweep.
    """
    sweep = collect_sweep(record.plan_remembered(name, store))
    sweep.table.attrs = {"sweep": sweep.name, "length_unit": sweep.length_unit}
    return sweep.table


def write_results(plan: Plan) -> Path:
    """Write results.csv and results.nc of a plan into the folder of its sweep, and return that folder."""
    sweep = collect_sweep(plan)
    folder = record.locate_sweep(sweep.name, plan.runs[0].store)
    write_tables(sweep, folder)
    return folder


def write_tables(sweep: CollectedSweep, folder: Path) -> None:
    """Write results.csv and results.nc of a sweep into a folder.

    The same store gives the same bytes.  results.nc is the grid by the CF conventions: see ``store.cf``.  Where the
    runs make no grid there is no results.nc, and the log says why.
    """
    with published(folder / CSV) as partial:
        make_cells(sweep.table).to_csv(partial, index=False, lineterminator="\n")
    try:
        grid = make_grid(sweep)
    except ConfigError as error:
        log.warning("no %s: %s", NETCDF, error)
        (folder / NETCDF).unlink(missing_ok=True)
        return
    packed = [name for name in grid.data_vars if grid[name].dtype == float and grid[name].size >= LEAST_PACKED]
    dataset = cf.sweep_as_file(grid, f"{grid.attrs.get('created', '')} put together by snowrepro".strip())
    with published(folder / NETCDF) as partial:
        write_netcdf(dataset, partial, dict.fromkeys(packed, PACKED))


def collect_sweep(plan: Plan) -> CollectedSweep:
    """Collect the numbers of every run of a plan; they are computed of a finished run that has none yet."""
    varied = _find_varied_keys(plan)
    coordinates = {_name_dimension(key): values for key, values in varied.items()}
    points = {POINT: [planned.point for planned in plan.planned]} if plan.sample else {}
    table = pd.DataFrame({**points, **_read_coordinates(plan.runs), **coordinates})
    records = _look_up_runs(plan.runs)
    for name in ("run_id", "state", "reason"):
        table[name] = [getattr(entry, name) for entry in records]
    columns = find_columns(run.case for run in plan.runs)
    columns = {name: column for name, column in columns.items() if name not in table}
    is_first = ~table.duplicated([*points, *ALWAYS, *coordinates, "run_id"])
    units = {run.case.reading.length_unit for run in plan.runs}
    return CollectedSweep(
        name=record.name_sweep(plan.overrides),
        overrides=tuple(o for o in plan.overrides if not o.startswith("store=")),
        table=pd.concat([table, _tabulate_summaries(columns, records)], axis=1)[is_first].reset_index(drop=True),
        runs=tuple(run for run, first in zip(plan.runs, is_first, strict=True) if first),
        further={_name_dimension(key): key for key in varied},
        columns=columns,
        length_unit=units.pop() if len(units) == 1 else "length",
        made=_combine_provenance({entry.made for entry in records if entry.made}),
        sample=plan.sample,
    )


def find_varied_columns(plan: Plan) -> dict[str, list]:
    """Find the coordinates of a sweep's table that vary, each with its value in every run."""
    further = {_name_dimension(key): values for key, values in _find_varied_keys(plan).items()}
    columns = {**_read_coordinates(plan.runs), **further}
    return {name: values for name, values in columns.items() if len(set(values)) > 1}


def make_grid(sweep: CollectedSweep) -> xr.Dataset:
    """Put a sweep on the grid of its coordinates: see ``open_sweep``.

    Raises ConfigError where the grid is too large, or where two runs would be in one cell.
    """
    table = sweep.table
    axes = {dim: _sort_axis(table[dim]) for dim in sweep.grid_dims}
    shape = tuple(len(axis) for axis in axes.values())
    _require_room(sweep.name, axes)
    where = np.ravel_multi_index([pd.Index(axis).get_indexer(table[dim]) for dim, axis in axes.items()], shape)
    require_one_run_per_cell(sweep)

    def arrange(name: str, empty: str | float) -> np.ndarray:
        """Put a column of the table on the grid, with ``empty`` where it has no value."""
        kind = object if isinstance(empty, str) else float
        values = np.full(np.prod(shape), empty, dtype=kind)
        values[where] = table[name].astype(kind).where(table[name].notna(), empty)
        return values.reshape(shape)

    variables = {
        "state": (sweep.grid_dims, arrange("state", NOT_IN_SWEEP), {"long_name": "where the run stands"}),
        "run_id": (sweep.grid_dims, arrange("run_id", ""), CASE_COLUMNS["run_id"].attrs("")),
    }
    for name, column in sweep.columns.items():
        values = arrange(name, "" if column.is_text else np.nan)
        variables[name] = (sweep.grid_dims, values, column.attrs(sweep.length_unit))
    coordinates = {dim: (dim, axis, _describe_coordinate(dim, sweep)) for dim, axis in axes.items()}
    dataset = xr.Dataset(variables, {**coordinates, **_list_sampled(sweep)})
    dataset["pressure"].encoding["_FillValue"] = None  # a coordinate has a value everywhere
    return dataset.assign_attrs(_describe_grid(sweep))


def _list_sampled(sweep: CollectedSweep) -> dict[str, tuple[str, np.ndarray, dict[str, str]]]:
    """List the coordinates of a grid that a design sampled, by name: a value at each point; words as text."""
    at_points = sweep.table.drop_duplicates(POINT).sort_values(POINT) if sweep.factors else sweep.table
    return {
        name: (POINT, _read_numbers(at_points[name].tolist()), _describe_coordinate(name, sweep))
        for name in sweep.factors
    }


def require_one_run_per_cell(sweep: CollectedSweep) -> None:
    """Raise ConfigError where two runs of a sweep have the same coordinates."""
    repeated = sweep.table[sweep.table.duplicated(sweep.grid_dims)]
    if len(repeated):
        cell = ", ".join(f"{dim} {repeated.iloc[0][dim]}" for dim in sweep.grid_dims)
        raise ConfigError(f"sweep '{sweep.name}' has two runs at {cell}: a table can hold them, a grid cannot")


def list_varied_keys(plan: Plan) -> list[str]:
    """List the settings in which the runs of a plan differ, as one types them."""
    coordinates = _read_coordinates(plan.runs)
    return [*(name for name in ALWAYS if len(set(coordinates[name])) > 1), *_find_varied_keys(plan)]


def describe_missing(table: pd.DataFrame, most: int = MOST_NAMED) -> str:
    """Describe the runs without a result in a line of ids and reasons, ``most`` of them; empty if there are none."""
    without = table[table["state"] != states.DONE]
    if without.empty:
        return ""
    entries = [
        f"{run_id} ({state}: {reason[:MOST_LETTERS]})" if reason else f"{run_id} ({state})"
        for run_id, state, reason in without[["run_id", "state", "reason"]].head(most).itertuples(index=False)
    ]
    rest = [f"and {len(without) - most} more"] if len(without) > most else []
    return f"{len(without)} of {len(table)} runs: {'; '.join([*entries, *rest])}"


def _find_varied_keys(plan: Plan) -> dict[str, list[str]]:
    """Find the keys beside ALWAYS that the overrides of the runs vary, each with its value in every run."""
    values_by_key = {}
    for texts in zip(*(planned.overrides for planned in plan.planned), strict=True):
        key = texts[0].lstrip("+~").partition("=")[0]
        if key not in NOT_FURTHER and len(set(texts)) > 1:
            values_by_key[key] = [text.partition("=")[2] for text in texts]
    return values_by_key


def _read_coordinates(runs: Sequence[Run]) -> dict[str, list]:
    """Read the coordinates that every sweep has, ALWAYS: by name the values of all runs."""
    return {
        "pressure": [run.case.pressure for run in runs],
        "shape": [run.case.shape.name for run in runs],
        "floor": [run.case.floor.name for run in runs],
        "sintering": [run.case.sintering.name for run in runs],
        "seed": [run.case.seed for run in runs],
    }


def _name_dimension(key: str) -> str:
    """Turn a key of the configuration into a name that NetCDF and Python accept."""
    return "".join(letter if letter.isalnum() else "_" for letter in key)


def _look_up_runs(runs: Sequence[Run]) -> list[_RunRecord]:
    """Look up state and numbers of each run in the store."""
    records = []
    for run, standing in zip(runs, states.standings(runs), strict=True):
        reason = standing.reason
        if standing.stale:
            reason += "; older than " + "; ".join(f"{kind}: {what}" for kind, what in standing.stale.items())
        entry = _RunRecord(run.id, standing.state, reason)
        if standing.state == states.DONE:
            try:
                entry = _RunRecord(run.id, standing.state, reason, read_row(run), _read_provenance(run))
            except StoreError as error:  # it is gone by now, or not what its size and time promise
                entry = _RunRecord(run.id, states.BROKEN, str(error))
        records.append(entry)
    return records


def _read_provenance(run: Run) -> tuple[str, ...]:
    """Read from the manifest when a result was made, and by what: the values of PROVENANCE."""
    manifest = run.manifest()
    return tuple(sys.intern(str(manifest.get(name, "unknown"))) for name in PROVENANCE)


def _tabulate_summaries(columns: Mapping[str, Column], records: Sequence[_RunRecord]) -> pd.DataFrame:
    """Tabulate the columns of numbers over the runs; NaN where a run has none."""
    done = [place for place, entry in enumerate(records) if entry.row is not None]
    rows = [entry.row for entry in records if entry.row is not None]
    values_by_name = {}
    for name, column in columns.items():
        values = np.full(len(records), np.nan, dtype=object if column.is_text else float)
        values[done] = [row.get(name, np.nan) for row in rows]
        values_by_name[name] = values
    return pd.DataFrame(values_by_name)


def _combine_provenance(makers: Collection[tuple[str, ...]]) -> dict[str, str]:
    """Combine the provenance of all results: when the last was made, and by what all were; empty without any."""
    if not makers:
        return {}
    created, *others = [sorted(set(values)) for values in zip(*makers, strict=True)]
    return dict(zip(PROVENANCE, [created[-1], *map("; ".join, others)], strict=True))


def _sort_axis(values: pd.Series) -> np.ndarray:
    """Return the different values of a coordinate: numbers rising, also where they are text; names in their order."""
    names = values.unique().tolist()
    try:
        return np.array(sorted(names, key=float))
    except ValueError:
        return np.array(names)


def _read_numbers(values: Sequence[Any]) -> np.ndarray:
    """Return values as numbers if all are, also written ones; else as they are."""
    try:
        return np.array(values, dtype=float)
    except ValueError:
        return np.array(values)


def _require_room(name: str, axes: Mapping[str, np.ndarray]) -> None:
    """Raise ConfigError where a grid would have more than MOST_CELLS cells."""
    cells = np.prod([float(len(axis)) for axis in axes.values()])
    if cells > MOST_CELLS:
        sizes = " x ".join(f"{len(axis)} {dim}" for dim, axis in axes.items() if len(axis) > 1)
        raise ConfigError(
            f"the grid of sweep '{name}' has {cells:,.0f} cells ({sizes}), and may have {MOST_CELLS:,}: "
            f"take its table, which has a row a run"
        )


def _describe_coordinate(dim: str, sweep: CollectedSweep) -> dict[str, str]:
    """Return the attributes of a coordinate."""
    if dim == POINT:
        return {"long_name": "point of the design", "units": "1"}
    if dim in sweep.further:
        key = sweep.further[dim]
        return {"long_name": f"value of {key}", "key": key}
    return CASE_COLUMNS[dim].attrs(sweep.length_unit)


def _describe_grid(sweep: CollectedSweep) -> dict[str, str]:
    """Return the attributes of a sweep's grid as a whole."""
    attributes = {
        "title": f"summaries of the runs of sweep {sweep.name}",
        "source": "simulation by snowrepro",
        "sweep": sweep.name,
        "overrides": " ".join(sweep.overrides),
        **sweep.made,
        "missing": describe_missing(sweep.table),
        "comment": COMMENT,
    }
    if sweep.length_unit == "length":
        attributes["comment"] += " Runs differ in their unit of length: 'length' is that of the reading of each."
    return attributes
