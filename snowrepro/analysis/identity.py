"""Which particle is which in each state, where the data has ids."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from ..errors import DataError
from ..text import quote
from .layout import Layout
from .values import read_values


@dataclass(frozen=True)
class Identity:
    """``ids`` (n,): of the particles, in the order in which they are kept, or None where the data has none.

    ``order`` (t, n): the place of each particle in each state of the data since the release, or None where the states
    have one order.
    """

    ids: np.ndarray | None = None
    order: np.ndarray | None = None

    def sort_states(self, values: np.ndarray) -> np.ndarray:
        """Return values (t, n, ...) with the particles of all states in one order."""
        if self.order is None:
            return values
        return np.stack([self.sort_state(state, index) for index, state in enumerate(values)])

    def sort_state(self, values: np.ndarray, index: int) -> np.ndarray:
        """Return values (n, ...) of the state at ``index`` with the particles in that order."""
        return values if self.order is None else values[self.order[index]]


def read_identity(variable: xr.DataArray | None, layout: Layout, start: int) -> Identity:
    """Read ids (particle) or, in any order, (time, particle) from the state at ``start`` on; sort by them if needed.

    Raises DataError where ids repeat, are missing, or are not the same in all states.
    """
    if variable is None:
        return Identity()
    if variable.ndim == 1:
        ids = _read_ids(variable)
        _require_single(ids, f"the ids {quote(variable.name)}")
        return Identity(ids)
    since = slice(start, None)
    states = layout.turn(variable, _read_ids(variable.isel({layout.time: since})), since)
    _require_single(states[0], f"the ids {quote(variable.name)} in state {start}")
    if (states == states[0]).all():
        return Identity(states[0])
    order = np.argsort(states, axis=1, kind="stable")
    ids = np.take_along_axis(states[:1], order[:1], axis=1)[0]
    for index, state in enumerate(states):
        there = state[order[index]]
        if (there != ids).any():
            _require_single(state, f"the ids {quote(variable.name)} in state {start + index}")
            other = int(np.isin(there, ids, invert=True).sum())
            raise DataError(
                f"the ids {quote(variable.name)} of state {start + index} are not those of state {start}: {other} of "
                f"{len(ids)} are others, and all particles must be there in all states"
            )
    return Identity(ids, order)


def _read_ids(variable: xr.DataArray) -> np.ndarray:
    """Read ids of any kind that can be sorted.  Raises DataError where some are missing, or for other kinds."""
    values = read_values(variable)
    if values.dtype.kind == "f":
        missing = ~np.isfinite(values)
        if missing.any():
            state = f", the first in state {np.argwhere(missing)[0][0]}" if values.ndim == 2 else ""
            raise DataError(
                f"{int(missing.sum())} ids {quote(variable.name)} are missing{state}: the number of particles must not "
                "change; if these are no ids, say --id none"
            )
    elif values.dtype.kind == "O":
        values = values.astype(str)
    elif values.dtype.kind not in "iubSU":
        raise DataError(f"the ids {quote(variable.name)} are {values.dtype}, no numbers and no texts: say --id none")
    return values


def _require_single(ids: np.ndarray, whose: str) -> None:
    """Check that no id is there twice.  Raises DataError with the first that is."""
    values, counts = np.unique(ids, return_counts=True)
    if (counts > 1).any():
        raise DataError(
            f"{whose} repeat: {quote(values[np.argmax(counts > 1)])} is there {counts.max()} times; name the right "
            "ones with --id, or none, --id none"
        )
