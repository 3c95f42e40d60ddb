"""The numbers of a sweep's runs together: a row a run, or a grid over what was varied."""

import logging
import sys
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from ..analysis.columns import ASKED, Column, columns_of
from ..analysis.summary import row_of
from ..config import Config
from ..errors import ConfigError, StoreError
from ..store import cf, manifest, runs, states
from ..store.files import published
from . import record
from .plan import Plan

log = logging.getLogger("snowrepro")

CSV, NETCDF = "results.csv", "results.nc"
ALWAYS = ("pressure", "shape", "floor", "sintering", "seed")
TOLD = (*ALWAYS, "scene")  # a scene is a shape and a floor
NOT_ASKED = "not asked for"
MOST_CELLS = 2_000_000  # of a grid: half a kilobyte each
LEAST_PACKED = 100  # numbers: fewer take more room packed
PACKED = {"zlib": True, "complevel": 1}
MOST_NAMED = 50
MOST_LETTERS = 80
MADE = ("created", "git_state", "versions", "machine")
COMMENT = (
    "A cell whose state is not 'done' has no result: NaN in numbers, counts and yes/no (1/0) alike, and no text in "
    f"words. Cells of the grid that the sweep did not ask for have the state '{NOT_ASKED}' and no run_id."
)


@dataclass(frozen=True)
class Collected:
    """A sweep with what its runs gave.

    ``table``: a row an asked run, see ``sweep_table``; ``configs``: of its rows.  ``further``: the key in the
    configuration of each coordinate beside ALWAYS.  ``columns``: what the table's summary columns mean.
    ``length_unit``: of all runs, or "length" where they differ in it.  ``made``: when the last of the results was
    made, and by what all were.
    """

    name: str
    overrides: tuple[str, ...]
    table: pd.DataFrame
    configs: tuple[Config, ...]
    further: Mapping[str, str]
    columns: Mapping[str, Column]
    length_unit: str
    made: Mapping[str, str]

    @property
    def dims(self) -> list[str]:
        """What tells the runs apart."""
        return [*ALWAYS, *self.further]


@dataclass(frozen=True, slots=True)
class _Finding:
    """Where a run stands; of one with a result also its summary row, and when and by what it was made."""

    run_id: str
    state: str
    reason: str
    row: Mapping[str, Any] | None = None
    made: tuple[str, ...] | None = None


def open_sweep(name: str | Path, store: str | Path = "runs") -> xr.Dataset:
    """The summary rows of a recorded sweep's finished runs, on a grid.

    Dimensions are pressure, shape, floor, sintering and seed, always, and one for each further key that the sweep
    varies, with its values as text: numbers rise, names come as they were asked for.  Variables: every column of
    the summaries as float (counts and yes/no too), NaN where there is no result, or as text, empty there; and
    ``state`` and ``run_id`` of each run.  A cell that the sweep does not ask for has the state "not asked for".
    ``name`` may also be the path of a results.nc: then the grid is the one that it holds.
    Raises ConfigError where there is no such sweep, or where it makes no grid; then ``sweep_table`` still works.
    """
    if Path(name).suffix == ".nc":
        return _written(Path(name))
    return grid_of(collect(record.plan_of(str(name), store)))


def _written(path: Path) -> xr.Dataset:
    """The grid of a results.nc.  Raises ConfigError if there is none."""
    try:
        with xr.open_dataset(path) as dataset:
            return cf.sweep_as_read(dataset.load())
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path} cannot be read as the results of a sweep: {error}") from error


def sweep_table(name: str, store: str | Path = "runs") -> pd.DataFrame:
    """A recorded sweep with a row for each run that it asks for, in its order.

    Coordinates as in ``open_sweep``, ``run_id``, ``state``, ``reason`` and the summary columns, NaN where there is
    no result.  Raises ConfigError where there is no such sweep.
    """
    return collect(record.plan_of(name, store)).table


def write_results(plan: Plan) -> Path:
    """Write results.csv and results.nc into the folder of the sweep, and return it; see ``write_tables``."""
    found = collect(plan)
    folder = record.folder_of(found.name, plan.runs[0].config.store)
    write_tables(found, folder)
    return folder


def write_tables(found: Collected, folder: Path) -> None:
    """Write results.csv and results.nc into a folder.

    The same store gives the same bytes.  results.nc is the grid by the CF conventions: see ``store.cf``.  Where the
    runs make no grid there is no results.nc, and the log says why.
    """
    with published(folder / CSV) as partial:
        found.table.to_csv(partial, index=False, lineterminator="\n")
    try:
        grid = grid_of(found)
    except ConfigError as error:
        log.warning("no %s: %s", NETCDF, error)
        (folder / NETCDF).unlink(missing_ok=True)
        return
    numbers = [name for name in grid.data_vars if grid[name].dtype == float and grid[name].size >= LEAST_PACKED]
    written = cf.sweep_as_file(grid, f"{grid.attrs.get('created', '')} put together by snowrepro".strip())
    with published(folder / NETCDF) as partial:
        written.to_netcdf(partial, engine="netcdf4", encoding={name: PACKED for name in numbers})


def collect(plan: Plan) -> Collected:
    """Look up every run of a plan; a finished one that was not analysed yet is."""
    varied = _varied(plan)
    configs = [planned.config for planned in plan.runs]
    asked = pd.DataFrame({**_coordinates(configs), **{_dim(key): values for key, values in varied.items()}})
    findings = _findings(configs)
    for name in ("run_id", "state", "reason"):
        asked[name] = [getattr(finding, name) for finding in findings]
    columns = {name: column for name, column in columns_of(configs).items() if name not in asked}
    once = ~asked.duplicated([*ALWAYS, *map(_dim, varied), "run_id"])
    units = {config.reading.length_unit for config in configs}
    return Collected(
        name=record.name_of(plan.overrides),
        overrides=tuple(o for o in plan.overrides if not o.startswith("store=")),
        table=pd.concat([asked, _summaries(columns, findings)], axis=1)[once].reset_index(drop=True),
        configs=tuple(config for config, is_first in zip(configs, once, strict=True) if is_first),
        further={_dim(key): key for key in varied},
        columns=columns,
        length_unit=units.pop() if len(units) == 1 else "length",
        made=_made({finding.made for finding in findings if finding.made}),
    )


def grid_of(found: Collected) -> xr.Dataset:
    """A sweep on the grid of its coordinates; see ``open_sweep``."""
    table = found.table
    axes = {dim: _axis(table[dim]) for dim in found.dims}
    shape = tuple(len(axis) for axis in axes.values())
    _require_room(found.name, axes)
    where = np.ravel_multi_index([pd.Index(axis).get_indexer(table[dim]) for dim, axis in axes.items()], shape)
    require_one_run_a_cell(found)

    def laid(name: str, empty: str | float) -> np.ndarray:
        kind = object if isinstance(empty, str) else float
        values = np.full(np.prod(shape), empty, dtype=kind)
        values[where] = table[name].astype(kind).where(table[name].notna(), empty)
        return values.reshape(shape)

    variables = {
        "state": (found.dims, laid("state", NOT_ASKED), {"long_name": "where the run stands"}),
        "run_id": (found.dims, laid("run_id", ""), ASKED["run_id"].attrs("")),
    }
    for name, column in found.columns.items():
        values = laid(name, "" if column.is_text else np.nan)
        variables[name] = (found.dims, values, column.attrs(found.length_unit))
    dataset = xr.Dataset(variables, {dim: (dim, axis, _about(dim, found)) for dim, axis in axes.items()})
    dataset["pressure"].encoding["_FillValue"] = None  # a coordinate has a value everywhere
    return dataset.assign_attrs(_attrs(found))


def require_one_run_a_cell(found: Collected) -> None:
    """Raises ConfigError where the coordinates do not tell all runs apart."""
    twice = found.table[found.table.duplicated(found.dims)]
    if len(twice):
        cell = ", ".join(f"{dim} {twice.iloc[0][dim]}" for dim in found.dims)
        raise ConfigError(f"sweep '{found.name}' has two runs at {cell}: a table can hold them, a grid cannot")


def missing(table: pd.DataFrame, most: int = MOST_NAMED) -> str:
    """The runs without a result, in one line of ids and reasons; empty if there are none."""
    without = table[table["state"] != states.DONE]
    if without.empty:
        return ""
    named = [
        f"{run_id} ({state}: {reason[:MOST_LETTERS]})" if reason else f"{run_id} ({state})"
        for run_id, state, reason in without[["run_id", "state", "reason"]].head(most).itertuples(index=False)
    ]
    rest = [f"and {len(without) - most} more"] if len(without) > most else []
    return f"{len(without)} of {len(table)} runs: {'; '.join([*named, *rest])}"


def _varied(plan: Plan) -> dict[str, list[str]]:
    """What the runs' overrides vary beyond what ALWAYS tells: each key with its value in every run."""
    found = {}
    for texts in zip(*(planned.overrides for planned in plan.runs), strict=True):
        key = texts[0].lstrip("+~").partition("=")[0]
        if key not in TOLD and len(set(texts)) > 1:
            found[key] = [text.partition("=")[2] for text in texts]
    return found


def _coordinates(configs: Sequence[Config]) -> dict[str, list]:
    """The coordinates that every sweep has, by run."""
    return {
        "pressure": [config.pressure for config in configs],
        "shape": [config.shape.name for config in configs],
        "floor": [config.floor.name for config in configs],
        "sintering": [config.sintering.name for config in configs],
        "seed": [config.seed for config in configs],
    }


def _dim(key: str) -> str:
    """A key of the configuration as a name that NetCDF and Python take."""
    return "".join(letter if letter.isalnum() else "_" for letter in key)


def _findings(configs: Sequence[Config]) -> list[_Finding]:
    """What the store knows of each run."""
    found = []
    for config, standing in zip(configs, states.standings(configs), strict=True):
        run_id, reason = runs.identify(config), standing.reason
        if standing.stale:
            reason += "; older than " + "; ".join(f"{kind}: {what}" for kind, what in standing.stale.items())
        finding = _Finding(run_id, standing.state, reason)
        if standing.state == states.DONE:
            try:
                finding = _Finding(run_id, standing.state, reason, row_of(config), _maker(config))
            except StoreError as error:  # it is gone by now, or not what its size and time promise
                finding = _Finding(run_id, states.BROKEN, str(error))
        found.append(finding)
    return found


def _maker(config: Config) -> tuple[str, ...]:
    """When a result was made, and by what: the values of MADE."""
    written = manifest.read(runs.run_dir(config))
    return tuple(sys.intern(str(written.get(name, "unknown"))) for name in MADE)


def _summaries(columns: Mapping[str, Column], findings: Sequence[_Finding]) -> pd.DataFrame:
    """The summary columns over the runs; NaN where a run has none."""
    done = [place for place, finding in enumerate(findings) if finding.row is not None]
    found = {}
    for name, column in columns.items():
        values = np.full(len(findings), np.nan, dtype=object if column.is_text else float)
        values[done] = [findings[place].row.get(name, np.nan) for place in done]
        found[name] = values
    return pd.DataFrame(found)


def _made(makers: Collection[tuple[str, ...]]) -> dict[str, str]:
    """When the last of the results was made, and by what all of them were; empty without any."""
    if not makers:
        return {}
    created, *others = [sorted(set(values)) for values in zip(*makers, strict=True)]
    return dict(zip(MADE, [created[-1], *map("; ".join, others)], strict=True))


def _axis(values: pd.Series) -> np.ndarray:
    """The values of a coordinate: numbers, also where they are text, rise; names come as they do first."""
    found = values.unique().tolist()
    try:
        return np.array(sorted(found, key=float))
    except ValueError:
        return np.array(found)


def _require_room(name: str, axes: Mapping[str, np.ndarray]) -> None:
    cells = np.prod([float(len(axis)) for axis in axes.values()])
    if cells > MOST_CELLS:
        sizes = " x ".join(f"{len(axis)} {dim}" for dim, axis in axes.items() if len(axis) > 1)
        raise ConfigError(
            f"the grid of sweep '{name}' has {cells:,.0f} cells ({sizes}), and may have {MOST_CELLS:,}: "
            f"take its table, which has a row a run"
        )


def _about(dim: str, found: Collected) -> dict[str, str]:
    """Attributes of a coordinate."""
    if dim in found.further:
        key = found.further[dim]
        return {"long_name": f"value of {key}", "key": key}
    return ASKED[dim].attrs(found.length_unit)


def _attrs(found: Collected) -> dict[str, str]:
    """What is said of a sweep's grid as a whole."""
    about = {
        "title": f"summaries of the runs of sweep {found.name}",
        "source": "simulation by snowrepro",
        "sweep": found.name,
        "overrides": " ".join(found.overrides),
        **found.made,
        "missing": missing(found.table),
        "comment": COMMENT,
    }
    if found.length_unit == "length":
        about["comment"] += " Runs differ in their unit of length: 'length' is that of the reading of each."
    return about
