"""The times of states, in seconds, and their frame numbers, from anybody's Dataset."""

import re
from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np
import xarray as xr

from ..errors import DataError
from ..text import quote, quote_all
from .layout import Layout, Names
from .values import NOTHING, find_variable, read_numbers, read_text, read_unit, read_values

SECOND, FRAME = "s", "frame"
UNSAID = 0.0  # in place of a unit
_SECONDS = {  # of a unit of time, by its names
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "msecs", "millisec", "millisecs", "millisecond", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "\u00b5s", "\u03bcs", "usec", "usecs", "microsec", "microsecond", "microseconds"), 1e-6),
    **dict.fromkeys(("ns", "nsec", "nanosec", "nanosecond", "nanoseconds"), 1e-9),
    **dict.fromkeys(("ps", "picosecond", "picoseconds"), 1e-12),
    **dict.fromkeys(("fs", "femtosecond", "femtoseconds"), 1e-15),
    **dict.fromkeys(("min", "mins", "minute", "minutes"), 60.0),
    **dict.fromkeys(("h", "hr", "hrs", "hour", "hours"), 3600.0),
    **dict.fromkeys(("d", "day", "days"), 86400.0),
    **dict.fromkeys(("week", "weeks"), 604800.0),
}
_OF_CALENDARS = ("month", "months", "mon", "year", "years", "yr", "yrs", "common_year", "common_years")
AGREEMENT = 1e-9  # of the times that particles have of one state, part of the whole time


@dataclass(frozen=True)
class Clock:
    """``frames`` (t,): numbers of the states; ``time`` (t,): of each, in ``unit``; ``assumed``: about it, in words."""

    frames: np.ndarray
    time: np.ndarray
    unit: str
    assumed: tuple[str, ...] = ()


def read_clock(dataset: xr.Dataset, layout: Layout, names: Names) -> Clock:
    """Read the frame number of each state, and its time [s], or the frame number where there is none.

    Raises DataError where numbers or times do not rise, or where the times cannot be read.
    """
    count = dataset.sizes[layout.time]
    frames = _read_frames(dataset, layout, count)
    found = _find_time(dataset, layout, names)
    if found is None:
        return Clock(frames, frames.astype(float), FRAME)
    seconds, unit, assumed = _read_seconds(found)
    if found.ndim == 2:
        seconds = _merge_times(seconds if found.dims[0] == layout.time else seconds.T, found.name)
    _require_rising(seconds, found.name)
    return Clock(frames, seconds, unit, assumed)


def _read_frames(dataset: xr.Dataset, layout: Layout, count: int) -> np.ndarray:
    """Read the numbers of the states: the whole numbers along the dimension of time, or else from 0 on."""
    if layout.time not in dataset.coords or not _has_frame_numbers(dataset[layout.time]):
        return np.arange(count)
    frames = read_values(dataset[layout.time]).astype(np.int64)
    wrong = np.flatnonzero(np.diff(frames) <= 0)
    if len(wrong):
        state = int(wrong[0]) + 1
        raise DataError(
            f"the frame numbers along {quote(layout.time)} must rise: state {state} has {frames[state]} after "
            f"{frames[state - 1]}"
        )
    return frames


def _has_frame_numbers(label: xr.DataArray) -> bool:
    """Whether a coordinate holds whole numbers that are no times."""
    return label.dtype.kind in "iu" and not _parse_unit(read_unit(label))


def _find_time(dataset: xr.Dataset, layout: Layout, names: Names) -> xr.DataArray | None:
    """Find the variable with the times, (time) or, in any order, (time, particle); None where there is none.

    Raises DataError where one that was named has other dimensions.
    """
    if names.time == NOTHING:
        return None
    if names.time:
        found = find_variable(dataset, names.time, "--time")
        if not layout.has_times(found):
            raise DataError(f"the times {quote(found.name)} (--time) have dimensions {quote_all(found.dims)}")
        return found
    usual: list[Hashable] = [f"{layout.time}_time", "time", layout.time, "t"]
    usual += [name for name, variable in dataset.variables.items() if read_text(variable, "standard_name") == "time"]
    for name in usual:
        if name not in dataset.variables or not layout.has_times(dataset[name]):
            continue
        if not (name == layout.time and _has_frame_numbers(dataset[name])):
            return dataset[name]
    return None


def _read_seconds(variable: xr.DataArray) -> tuple[np.ndarray, str, tuple[str, ...]]:
    """Read times of any kind as numbers; returns them, their unit, and what was assumed."""
    name = quote(variable.name)
    if variable.dtype.kind in "iuf":
        return _scale_times(read_numbers(variable).astype(float), read_unit(variable), name)
    values = read_values(variable)
    if values.dtype.kind in "mM":
        passed = values - np.nanmin(values) if values.dtype.kind == "M" else values
        return np.where(np.isnat(passed), np.nan, passed / np.timedelta64(1, "ns") * 1e-9), SECOND, ()
    return _subtract_dates(values, name), SECOND, ()


def _scale_times(times: np.ndarray, text: str, name: str) -> tuple[np.ndarray, str, tuple[str, ...]]:
    """Return times in seconds; in the file's own unit where that is not known; what was assumed is the last."""
    unit = _parse_unit(text)
    if unit is None:
        return times, text, (f"unit of time: {quote(text)}, as {name} says; velocities are by that",)
    if unit == UNSAID:
        return times, SECOND, (f"unit of time: seconds, as {name} has none",)
    return times * unit, SECOND, ()


def _parse_unit(text: str) -> float | None:
    """Return the seconds of a unit of time; UNSAID where there is no text, None where it is not understood.

    A date behind "since" only moves all times.  Raises DataError for units that last differently long.
    """
    unit = re.split(r"\s+since(?:\s|$)", text, maxsplit=1, flags=re.IGNORECASE)[0].strip()
    if unit in ("", "1", "-"):
        return UNSAID
    parts = re.fullmatch(r"([0-9.]+(?:[eE][+-]?[0-9]{1,2})?)?\s*([^\W\d]+)\.?", unit)
    if not parts:
        return None
    name = parts[2] if len(parts[2]) < 3 else parts[2].lower()  # Ms is no ms
    if name in _OF_CALENDARS:
        raise DataError(
            f"a {name.rstrip('s')} is no fixed time ({quote(text)}): give times in days or seconds, or --time none"
        )
    try:
        return float(parts[1] or 1) * _SECONDS[name]
    except (KeyError, ValueError):
        return None


def _subtract_dates(values: np.ndarray, name: str) -> np.ndarray:
    """Return the seconds of dates, of any calendar, since the first of them."""
    try:
        first = min(values.ravel().tolist())
        return np.vectorize(lambda date: (date - first).total_seconds(), otypes=[float])(values)
    except (TypeError, ValueError, AttributeError, OverflowError) as error:
        raise DataError(
            f"the times {name} are no numbers and no dates: name others with --time, or none, --time none"
        ) from error


def _merge_times(seconds: np.ndarray, name: Hashable) -> np.ndarray:
    """Return the one time of each state, from those that its particles have, (time, particle), NaN where one has none.

    Raises DataError where they differ.
    """
    is_there = ~np.isnan(seconds)
    empty = np.flatnonzero(~is_there.any(axis=1))
    if len(empty):
        raise DataError(f"the times {quote(name)} are missing in {len(empty)} states, the first is state {empty[0]}")
    least = np.min(seconds, axis=1, where=is_there, initial=np.inf)
    most = np.max(seconds, axis=1, where=is_there, initial=-np.inf)
    apart = np.flatnonzero(most - least > AGREEMENT * max(float(most.max() - least.min()), 0.0))
    if len(apart):
        raise DataError(
            f"particles have times of their own ({quote(name)}): in state {apart[0]} from {least[apart[0]]:.6g} "
            f"to {most[apart[0]]:.6g}: put all of them on the same times"
        )
    return least


def _require_rising(seconds: np.ndarray, name: Hashable) -> None:
    """Check that times are there and rise.  Raises DataError with the states where they do not."""
    missing = np.flatnonzero(~np.isfinite(seconds))
    if len(missing):
        raise DataError(f"{len(missing)} states have no time in {quote(name)}, the first is state {missing[0]}")
    wrong = np.flatnonzero(np.diff(seconds) <= 0)
    if len(wrong):
        state = int(wrong[0])
        how = "goes back" if seconds[state + 1] < seconds[state] else "stands still"
        raise DataError(
            f"time {how}: {quote(name)} is {seconds[state]:.6g} in state {state} and {seconds[state + 1]:.6g} in state "
            f"{state + 1} (states count from 0): remove states that were written twice, or name other times with --time"
        )
