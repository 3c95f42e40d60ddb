"""Values of variables and attributes of anybody's Dataset, read with checks: numbers of a bounded size."""

import math
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import xarray as xr

from ..errors import DataError
from ..text import make_printable, quote, quote_all

LARGEST = 1 << 30  # bytes of an array in memory
SMALL = 1 << 26  # bytes that a file of any size may declare
MOST_PACKED = 200  # bytes declared by each byte of a file; DEFLATE comes to 1000 where all values are the same
NOTHING = "none"  # said of a variable: the data has none
FILL = {np.dtype(code): value for code, value in netCDF4.default_fillvals.items() if code in ("f4", "f8")}


def find_variable(dataset: xr.Dataset, name: str, option: str) -> xr.DataArray:
    """Return a variable that was named by ``option``.  Raises DataError, listing what there is, if it is not there."""
    if name in dataset.variables:
        return dataset[name]
    reason = f": {dataset.encoding['left_out'][name]}" if name in dataset.encoding.get("left_out", {}) else ""
    raise DataError(
        f"there is no variable {quote(name)} that can be read ({option}){reason}; {list_variables(dataset)}"
    )


def list_variables(dataset: xr.Dataset) -> str:
    """List the variables and the groups that a Dataset has, in words."""
    words = [f"there are: {quote_all(dataset.variables) or 'no variables'}"]
    words += [
        f"{quote(name)} cannot be read: {reason}" for name, reason in dataset.encoding.get("left_out", {}).items()
    ]
    if groups := dataset.encoding.get("groups"):
        words.append(f"the file has groups, name one with --group: {quote_all(groups)}")
    return "; ".join(words)


def read_values(variable: xr.DataArray) -> np.ndarray:
    """Read all values of a variable.  Raises DataError where it is too large, or where reading fails."""
    require_size(variable)
    try:
        return np.asarray(variable.values)
    except MemoryError as error:
        raise DataError(f"{quote(variable.name)} does not fit into memory") from error
    except (OSError, RuntimeError, ValueError, TypeError, AttributeError, LookupError, ArithmeticError) as error:
        raise DataError(f"{quote(variable.name)} cannot be read: {make_printable(error)[:200]}") from error


def read_numbers(variable: xr.DataArray) -> np.ndarray:
    """Read a variable as floating-point numbers, NaN where none was written.  Raises DataError if they are none."""
    require_numbers(variable)
    values = read_values(variable)
    if values.dtype not in (np.float32, np.float64):
        values = values.astype(float)
    is_unwritten = values == FILL[values.dtype.newbyteorder("=")]
    return np.where(is_unwritten, values.dtype.type(np.nan), values) if is_unwritten.any() else values


def require_numbers(variable: xr.DataArray) -> None:
    """Check that a variable holds real numbers.  Raises DataError if not."""
    if variable.dtype.kind not in "iuf":
        raise DataError(f"{quote(variable.name)} must be numbers, not {variable.dtype}")


def require_size(variable: xr.DataArray, copies: int = 1) -> None:
    """Check that a variable, ``copies`` times, can be read into memory.  Raises DataError with size and bound if not.

    A file can declare any size, and have pieces ("chunks") of any size.
    """
    item = max(variable.dtype.itemsize, 4)
    size = math.prod(variable.shape) * item * copies
    chunk = math.prod(variable.encoding.get("chunksizes") or ()) * item
    for bytes_wanted, what in ((size, "has"), (chunk, "is stored in pieces of")):
        if bytes_wanted > LARGEST:
            raise DataError(
                f"{quote(variable.name)} {what} {bytes_wanted / 1e9:,.3g} GB, more than the {LARGEST / 1e9:.3g} GB "
                "that are read at once: keep fewer states"
            )


def require_plausible_size(variable: xr.DataArray, copies: int = 1) -> None:
    """Check that a variable can be read, and that its file is large enough to hold it.  Raises DataError if not."""
    require_size(variable, copies)
    size = math.prod(variable.shape) * variable.dtype.itemsize
    held = _find_file_size(variable)
    if held is not None and size > max(SMALL, MOST_PACKED * held):
        raise DataError(f"{quote(variable.name)} declares {size:,} bytes, which its file of {held:,} bytes cannot hold")


def _find_file_size(variable: xr.DataArray) -> int | None:
    """Find the size of the file that a variable is read from; None where it is from none."""
    try:
        return Path(variable.encoding["source"]).stat().st_size
    except (KeyError, TypeError, OSError):
        return None


def read_number(value: Any, name: str, remedy: str) -> float:
    """Read an attribute or an argument as a number, also one in a text or alone in an array.

    ``remedy``: what to do, as the message says it.  Raises DataError where it is none.
    """
    try:
        return float(np.asarray(value).reshape(()).astype(float))
    except (TypeError, ValueError, OverflowError) as error:
        raise DataError(f"{name} is {quote(value)}, which is no number: {remedy}") from error


def read_text(variable: xr.DataArray | xr.Variable, name: str) -> str:
    """Read an attribute of a variable that is a text; nothing where it is none."""
    value = variable.attrs.get(name, "")
    return value if isinstance(value, str) else ""


def read_unit(variable: xr.DataArray | xr.Variable) -> str:
    """Read the unit of a variable: a short text that can be shown, or nothing."""
    return make_printable(read_text(variable, "units")[:200].strip())[:40]
