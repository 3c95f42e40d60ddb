"""What a name or a Dataset stands for: a run or a sweep."""

from pathlib import Path

import xarray as xr

from ..errors import ConfigError, StoreError
from ..store.find import find_result
from ..sweep import record
from ..text import quote


def find_sweep(data: xr.Dataset | str | Path, store: str | Path) -> str:
    """Find the name of the sweep that is meant; empty where it is a run.

    ``data``: a Dataset, an id, a path, or the name of a sweep or of its experiment.  Raises ConfigError where a name is
    neither a run's nor a sweep's, or where it is that of several runs.
    """
    if isinstance(data, xr.Dataset):
        return str(data.attrs.get("sweep", ""))
    if isinstance(data, Path):
        return ""
    if data in record.list_sweeps(store):
        return data
    try:
        find_result(data, store)
    except StoreError:
        try:
            return record.require_sweep(data, store)
        except ConfigError as error:
            raise ConfigError(f"there is no run {quote(data)} in the store {quote(store)}, and {error}") from error
    return ""
