"""What of a run is in arrays, in and out of files; ``store.run`` loads this module when an array is first needed."""

import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..errors import StoreError
from . import cf
from .bits import digests
from .cost import Kind, kind_of
from .files import flush, published
from .netcdf import UNREADABLE, open_netcdf, write_netcdf

__all__ = [
    "Kind", "digests", "kind_of", "read_checkpoint", "read_derived", "read_result", "write_checkpoint", "write_derived",
    "write_result",
]  # fmt: skip

PACKED = {"zlib": True, "complevel": 1, "shuffle": True}
KEY = "key"  # attribute of what is derived
MADE_BY = "made_by"  # array of a checkpoint


def write_result(path: Path, dataset: xr.Dataset) -> None:
    """Write a run's Dataset, by the CF conventions, and have it on the disk."""
    written = cf.run_as_file(dataset, f"{dataset.attrs['created']} simulated by snowrepro")
    encoding = {name: PACKED for name in written.variables if {"snapshot", "particle"} <= {*written[name].dims}}
    write_netcdf(written, path, encoding)
    flush(path)


def read_result(path: Path, group: str | None = None) -> xr.Dataset:
    """Open a run's Dataset as ``simulate`` gave it, or another code's file, or a group of it, as it is.

    Values are read when used.  Raises StoreError if it cannot be read.
    """
    return cf.run_as_read(open_netcdf(path, group))


def write_derived(path: Path, dataset: xr.Dataset, key: str) -> None:
    """Write what was derived from a result, under the key of what derived it."""
    encoding = {name: PACKED for name in dataset.data_vars if dataset[name].size > 1}
    with published(path, durable=False) as partial:
        write_netcdf(dataset.assign_attrs({KEY: key}), partial, encoding)


def read_derived(path: Path, key: str) -> xr.Dataset | None:
    """What was written under a key, read whole; None if it was under another, or cannot be read."""
    try:
        with open_netcdf(path) as dataset:
            return dataset.load() if dataset.attrs.get(KEY) == key else None
    except (StoreError, *UNREADABLE):
        return None


def write_checkpoint(path: Path, arrays: Mapping[str, np.ndarray], made_by: str) -> None:
    """Write a checkpoint in place of the one before, with what made it."""
    content: dict[str, Any] = {MADE_BY: np.array(made_by), **arrays}
    with published(path, durable=False) as partial, partial.open("wb") as file:
        np.savez(file, **content)


def read_checkpoint(path: Path, made_by: str) -> dict[str, np.ndarray] | None:
    """The arrays of a checkpoint; None if there is none, it is broken, or something else made it."""
    try:
        with np.load(path, allow_pickle=False) as saved:
            arrays = {name: saved[name] for name in saved.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error):
        return None
    return arrays if str(arrays.pop(MADE_BY, "")) == made_by else None
