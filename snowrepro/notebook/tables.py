"""A sweep from its table: what pictures and views need of it beside the rows."""

from collections.abc import Hashable, Sequence

import pandas as pd
from pandas.api.types import is_numeric_dtype

from ..errors import ConfigError
from ..evidence.collect import ALWAYS, NOT_IN_SWEEP, POINT, CollectedSweep
from ..summary.columns import TEXT, Column
from ..summary.row import ALL_COLUMNS

NEEDED = ("run_id", "state")


def find_coordinates(table: pd.DataFrame, needed: Sequence[str] = ()) -> list[Hashable]:
    """Find the coordinates of a sweep's table: its columns before id and state.

    ``needed``: further columns that it should have.  Raises ConfigError that names what it has not.
    """
    names = list(table.columns)
    lacking = [name for name in (*NEEDED, *needed) if name not in names]
    if lacking:
        raise ConfigError(
            f"this table is not of a sweep, as snowrepro.sweep_table gives one: it has no {' and no '.join(lacking)}"
        )
    return names[: min(map(names.index, NEEDED))]


def read_sweep(table: pd.DataFrame) -> CollectedSweep:
    """Make a sweep of a table as ``sweep_table`` gives it, of some of its rows, or of a grid's ``to_dataframe()``.

    Columns that the caller added are numbers or words without a unit.  Raises ConfigError where it is none.
    """
    table = table.reset_index() if table.index.names != [None] else table
    coordinates = [str(name) for name in find_coordinates(table, ALWAYS)]
    rows = table[table["state"] != NOT_IN_SWEEP].reset_index(drop=True)
    others = [str(name) for name in rows.columns if name not in (*coordinates, *NEEDED, "reason")]
    own = {name: Column(name, "1" if is_numeric_dtype(rows[name]) else TEXT) for name in others}
    return CollectedSweep(
        name=table.attrs.get("sweep", "of this table"),
        overrides=(),
        table=rows,
        runs=(),
        further={name: name for name in coordinates if name not in (*ALWAYS, POINT)},
        columns={name: ALL_COLUMNS.get(name, column) for name, column in own.items()},
        length_unit=table.attrs.get("length_unit", "length"),
        made={},
    )
