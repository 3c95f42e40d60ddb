"""The bits of a result's arrays, apart from the file that holds them and what that says of its making."""

import hashlib

import numpy as np
import xarray as xr


def digests(dataset: xr.Dataset) -> dict[str, str]:
    """Each variable and coordinate with a SHA-256 of its type, shape and values; the same in memory and from a file."""
    return {str(name): digest_values(dataset[name].values) for name in sorted(dataset.variables, key=str)}


def digest_values(values: np.ndarray) -> str:
    """A SHA-256 of an array's type, shape and values."""
    if values.dtype.kind in "fiub":
        little = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
        kind, content = little.dtype.str, little.tobytes()
    else:  # names: NumPy and NetCDF have several types for them
        kind, content = "text", "\0".join(map(str, values.ravel())).encode()
    digest = hashlib.sha256(f"{kind} {values.shape} ".encode())
    digest.update(content)
    return digest.hexdigest()
