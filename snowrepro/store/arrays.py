"""What of a run is in arrays, in and out of files; ``store.run`` loads this module when an array is first needed."""

import hashlib
import math
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
import xarray as xr

from ..errors import StoreError
from ..foreign import Unreadable, open_plain
from . import cf
from .bits import digest_values, digests
from .cost import Kind, count_particles, kind_of
from .files import flush, published
from .netcdf import UNREADABLE, open_netcdf, write_netcdf

__all__ = [
    "Kind", "count_particles", "digests", "kind_of", "read_checkpoint", "read_derived", "read_result",
    "write_checkpoint", "write_derived", "write_result",
]  # fmt: skip

PACKED = {"zlib": True, "complevel": 1, "shuffle": True}
KEY = "key"  # attribute of what is derived
RUN_ID, MADE_BY, CHECKSUM = "run_id", "made_by", "checksum"  # arrays of a checkpoint
MOST_CHECKPOINT = 1 << 30  # bytes
MOST_UNPACKED = 1100  # bytes of an array for each byte of its file: what deflate can do at most
# What NetCDF libraries raise on what is no file of theirs, or not as it was written.
BAD_FILE = (OSError, ValueError, TypeError, KeyError, IndexError, AttributeError, RuntimeError, OverflowError)
BAD_ARCHIVE = (EOFError, zipfile.BadZipFile, zlib.error, MemoryError, SyntaxError)  # and what is no npz file


def write_result(path: Path, dataset: xr.Dataset) -> None:
    """Write a run's Dataset, by the CF conventions, and have it on the disk."""
    written = cf.run_as_file(dataset, f"{dataset.attrs['created']} simulated by snowrepro")
    encoding = {name: PACKED for name in written.variables if written[name].ndim > 1}
    write_netcdf(written, path, encoding)
    flush(path)


def read_result(path: Path, group: str | None = None) -> xr.Dataset:
    """Open a run's Dataset as ``simulate`` gave it, or another code's file, or a group of it, as it is.

    Values are read when used.  Raises StoreError if it cannot be read, or holds more than a file of its size can.
    """
    dataset = _open(path, group)
    try:
        return cf.run_as_read(dataset)
    except BAD_FILE as error:
        dataset.close()
        raise StoreError(f"{path} cannot be read as a run: {describe(error)}") from error


def _open(path: Path, group: str | None = None) -> xr.Dataset:
    """Open a regular file, or a group of it, as a Dataset.  Raises StoreError."""
    open_plain(path).close()
    try:
        dataset = open_netcdf(path, group)
    except BAD_FILE as error:
        raise StoreError(f"{path} cannot be read as a run: {describe(error)}") from error
    _require_room(path, dataset)
    return dataset


def _require_room(path: Path, dataset: xr.Dataset) -> None:
    """Check that the arrays of a file can be in it.  Raises Unreadable."""
    room = max(path.stat().st_size, 1) * MOST_UNPACKED
    for name, variable in dataset.variables.items():
        if variable.size * variable.dtype.itemsize > room:
            raise Unreadable(path, f"is too small for the {variable.size:,} numbers that it says '{name}' has")


def describe(error: Exception) -> str:
    """What was wrong with a file, in words, also where the library says just a key."""
    return (
        f"{type(error).__name__} {error}"
        if isinstance(error, (KeyError, IndexError))
        else str(error) or type(error).__name__
    )


def write_derived(path: Path, dataset: xr.Dataset, key: str) -> None:
    """Write what was derived from a result, under the key of what derived it."""
    encoding = {name: PACKED for name in dataset.data_vars if dataset[name].size > 1}
    with published(path, durable=False) as partial:
        write_netcdf(dataset.assign_attrs({KEY: key}), partial, encoding)


def read_derived(path: Path, key: str) -> xr.Dataset | None:
    """What was written under a key, read whole; None if it was under another, or cannot be read."""
    try:
        with _open(path) as dataset:
            return dataset.load() if dataset.attrs.get(KEY) == key else None
    except (StoreError, *BAD_FILE, *UNREADABLE):
        return None


def write_checkpoint(path: Path, arrays: Mapping[str, np.ndarray], run_id: str, made_by: str) -> None:
    """Write a checkpoint in place of the one before: whose it is, what made it, and a checksum of all of it."""
    content: dict[str, Any] = {RUN_ID: np.array(run_id), MADE_BY: np.array(made_by), **arrays}
    content[CHECKSUM] = np.array(checksum(content))
    with published(path, durable=False) as partial, partial.open("wb") as file:
        np.savez(file, **content)


def read_checkpoint(path: Path, run_id: str, made_by: str) -> dict[str, np.ndarray]:
    """The arrays of a checkpoint.  Raises Unreadable if it is broken, another run's, or something else made it."""
    try:
        arrays = _read_arrays(path)
    except FileNotFoundError:
        raise
    except (*BAD_FILE, *BAD_ARCHIVE) as error:
        raise Unreadable(path, f"is not as it was written: {describe(error)}") from error
    written = str(arrays.pop(CHECKSUM, ""))
    if not written or RUN_ID not in arrays:
        raise Unreadable(path, "does not say whose it is: an older version made it")
    if written != checksum(arrays):
        raise Unreadable(path, "is not as it was written: its checksum differs")
    if (other := str(arrays.pop(RUN_ID))) != run_id:
        raise Unreadable(path, f"is of another run, {other}")
    if str(arrays.pop(MADE_BY, "")) != made_by:
        raise Unreadable(path, "was made by other code or versions")
    return arrays


def _read_arrays(path: Path) -> dict[str, np.ndarray]:
    """The arrays of an npz file as NumPy writes it: not packed, each as long as its own header says."""
    arrays = {}
    with open_plain(path, MOST_CHECKPOINT) as file, zipfile.ZipFile(file) as archive:
        for entry in archive.infolist():
            if entry.compress_type != zipfile.ZIP_STORED or entry.file_size > MOST_CHECKPOINT:
                raise ValueError(f"'{entry.filename}' is packed")
            with archive.open(entry) as stream:
                arrays[entry.filename.removesuffix(".npy")] = _read_array(stream, entry.file_size)
    return arrays


def _read_array(stream: IO[bytes], size: int) -> np.ndarray:
    """One array of ``size`` bytes, header included.  Raises ValueError if its header says otherwise."""
    if np.lib.format.read_magic(stream) != (1, 0):
        raise ValueError("its arrays are of another format")
    shape, is_fortran, kind = np.lib.format.read_array_header_1_0(stream)
    length = math.prod(shape) * kind.itemsize
    if kind.hasobject or not (0 <= length <= size):
        raise ValueError("an array has another size than it says")
    values = (
        np.frombuffer(bytearray(stream.read(length)), kind, count=math.prod(shape)) if length else np.empty(0, kind)
    )
    return values.reshape(shape, order="F" if is_fortran else "C")


def checksum(arrays: Mapping[str, np.ndarray]) -> str:
    """A SHA-256 over all arrays: names, types, shapes and values."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        digest.update(f"{name} {digest_values(np.asarray(arrays[name]))} ".encode())
    return digest.hexdigest()
