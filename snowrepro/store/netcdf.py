"""NetCDF files of anybody, opened and written.

HDF5 is not safe to use from several threads.  xarray takes a lock for each piece of data that it reads or writes, but
none while it opens a file and looks at its variables: two threads that open files, or one that opens and one that
reads, end in a crash of the process sooner or later.  So all files are opened, read and written under one lock of ours.
"""

import contextlib
import math
import stat
import threading
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import xarray as xr

from ..errors import StoreError
from ..text import make_printable, quote, quote_all
from . import classic

HDF5 = b"\x89HDF\r\n\x1a\n"
HDF5_PLACES = (0, *(512 << power for power in range(12)))  # a block of the user's own may stand before it
LARGEST_COORDINATE = 1 << 28  # bytes: xarray reads coordinates when it opens a file
MOST_VARIABLES = 10_000
GROUPS = "groups"  # in the encoding of a Dataset: the groups that its file has
LEFT_OUT = "left_out"  # likewise: variables that cannot be read, each with the reason
# What netCDF4 and xarray raise on files that are damaged or that they do not understand.
UNREADABLE = (
    OSError, RuntimeError, ValueError, TypeError, AttributeError, LookupError, ArithmeticError, MemoryError,
    NotImplementedError,
)  # fmt: skip


class _Lock:
    """A lock that its thread can take again, and that stays the same one when it is copied or pickled with a file."""

    def __init__(self) -> None:
        self._lock = threading.RLock()

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        """Take the lock; see ``threading.Lock``."""
        return self._lock.acquire(blocking, timeout)

    def release(self) -> None:
        """Give the lock back."""
        self._lock.release()

    def __enter__(self) -> bool:
        return self.acquire()

    def __exit__(self, *_: object) -> None:
        self.release()

    def __reduce__(self) -> str:
        return "LOCK"


LOCK = _Lock()


def open_netcdf(path: Path, group: str | None = None) -> xr.Dataset:
    """Open a NetCDF file, whoever wrote it, or one of its groups; values are read when used, times stay numbers.

    Raises StoreError that says what is wrong if it is no such file, is cut off, or cannot be read.
    """
    require_whole(path)
    with LOCK, _explaining(path), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # they would show text of the file as it is
        left_out, groups = _look_into(path, group)
        dataset = xr.open_dataset(
            path, engine="netcdf4", lock=LOCK, group=group, decode_times=False, drop_variables=[*left_out]
        )
    dataset.encoding |= {GROUPS: groups, LEFT_OUT: left_out}
    return dataset


def write_netcdf(dataset: xr.Dataset, path: Path, encoding: Mapping[Any, Any] | None = None) -> None:
    """Write a Dataset to a file; ``encoding`` by the names of variables.  Raises OSError or RuntimeError."""
    with LOCK:
        dataset.to_netcdf(path, engine="netcdf4", encoding=encoding)


def require_whole(path: Path) -> None:
    """Check that a path leads to a NetCDF file that is not cut off.  Raises StoreError if not."""
    with _explaining(path):
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise StoreError(f"{_show(path)} is no file that can be read as NetCDF: it is {_name_kind(status.st_mode)}")
        if not status.st_size:
            raise StoreError(f"{_show(path)} cannot be read as NetCDF: it is empty")
        with path.open("rb") as file:
            magic = file.read(4)
            if magic not in classic.MAGIC and not _has_hdf5(file):
                raise StoreError(
                    f"{_show(path)} cannot be read as NetCDF: it begins with {magic!r}, which no NetCDF file does"
                )
        if magic in classic.MAGIC and (size := classic.find_declared_size(path)) > status.st_size:
            raise StoreError(
                f"{_show(path)} cannot be read: it is cut off, as it should have {size:,} bytes by its header and has "
                f"{status.st_size:,}: copy it again"
            )


def _has_hdf5(file: Any) -> bool:
    """Whether a file that is open for bytes has the mark of HDF5."""
    for place in HDF5_PLACES:
        file.seek(place)
        if file.read(len(HDF5)) == HDF5:
            return True
    return False


def _look_into(path: Path, group: str | None) -> tuple[dict[str, str], list[str]]:
    """Return the variables that cannot be read, each with the reason, and the names of the groups of a file.

    Raises StoreError where there is no such group, or where opening would take too much memory.
    """
    with netCDF4.Dataset(str(path)) as file:
        groups = [name.strip("/") for name in _list_groups(file)]
        if group is not None and group.strip("/") not in groups:
            raise StoreError(f"{_show(path)} has no group {quote(group)}; there are: {quote_all(groups) or 'none'}")
        node = file if group is None else file[group]
        if len(node.variables) > MOST_VARIABLES:
            raise StoreError(f"{_show(path)} has {len(node.variables):,} variables, more than {MOST_VARIABLES:,}")
        for name, variable in node.variables.items():
            size = math.prod(map(int, variable.shape)) * np.dtype(variable.dtype).itemsize
            if variable.dimensions == (name,) and size > LARGEST_COORDINATE:
                raise StoreError(
                    f"{_show(path)} declares {size:,} bytes for its coordinate {quote(name)}, more than the "
                    f"{LARGEST_COORDINATE:,} that are read"
                )
        flaws = {name: _find_flaw(variable) for name, variable in node.variables.items()}
        return {name: flaw for name, flaw in flaws.items() if flaw}, groups


def _list_groups(node: Any, most: int = 1000) -> list[str]:
    """List the paths of the groups in a group and below."""
    found: list[str] = []
    waiting = [*node.groups.values()]
    while waiting and len(found) < most:
        group = waiting.pop(0)
        found.append(group.path)
        waiting += group.groups.values()
    return found


def _find_flaw(variable: Any) -> str:
    """Return why xarray cannot read a variable, by the attributes that say how its values are stored; or nothing."""
    attributes = {name: variable.getncattr(name) for name in variable.ncattrs()}
    for name in ("scale_factor", "add_offset"):
        value = np.asarray(attributes.get(name, 0.0))
        if value.size != 1 or value.dtype.kind not in "iuf":
            return f"its attribute {name} is {quote(attributes[name])}, which is no number"
    for name in ("coordinates", "_Encoding"):
        if not isinstance(attributes.get(name, ""), str):
            return f"its attribute {name} is {quote(attributes[name])}, which is no text"
    if "_Encoding" in attributes and np.dtype(variable.dtype).kind not in "SUO":
        return "its attribute _Encoding is for text, and it holds numbers"
    return ""


@contextlib.contextmanager
def _explaining(path: Path) -> Iterator[None]:
    """Turn what goes wrong in the block into a StoreError that names the file."""
    try:
        yield
    except StoreError:
        raise
    except UNREADABLE as error:
        reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise StoreError(f"{_show(path)} cannot be read as NetCDF: {make_printable(reason)[:200]}") from error


def _name_kind(mode: int) -> str:
    """Name a kind of file that is no regular one."""
    kinds = {
        stat.S_IFDIR: "a folder", stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket", stat.S_IFCHR: "a device",
        stat.S_IFBLK: "a device",
    }  # fmt: skip
    return kinds.get(stat.S_IFMT(mode), "something else")


def _show(path: Path) -> str:
    return make_printable(path)
