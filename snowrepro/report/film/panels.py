"""Runs side by side: the words that tell them apart, and the place of each panel in a grid."""

from collections.abc import Sequence
from itertools import combinations
from math import ceil, log, prod
from typing import Any

import numpy as np

from ...quantities import PRESSURE, format_powers
from ...settings.execution import COULD_CHANGE_BITS
from ...store.run import Run

SCENE = ("shape.name", "floor.name")
TITLE_KEYS = (*SCENE, "pressure", "sintering.name", "indenter.name")  # in a title, where all runs share them
PREFERRED_KEYS = (
    *TITLE_KEYS,
    "fidelity.name",
    "reading.name",
    "material.name",
    "seed",
)  # tell runs apart before other settings do
WIDE = 16 / 9  # of a picture
BLANK = 3.0  # what empty places cost, beside a factor e in width over height


def find_varied_keys(runs: Sequence[Run]) -> list[str]:
    """Find the settings in which runs differ, as "section.key".

    A setting is left out if those before it already tell the runs apart as well.
    """
    settings = [_flatten_settings(run) for run in runs]
    keys = [key for key in PREFERRED_KEYS if len({row.get(key) for row in settings}) > 1]
    for key in dict.fromkeys(key for row in settings for key in row):
        distinct = {tuple(row.get(k) for k in keys) for row in settings}
        if len({tuple(row.get(k) for k in (*keys, key)) for row in settings}) > len(distinct):
            keys.append(key)
    return keys


def format_title(runs: Sequence[Run], keys: Sequence[str]) -> str:
    """Format scene, pressure, sintering and hardness test, as far as runs that differ in ``keys`` share them.

    Where they differ in pressure, it has the unit alone.
    """
    values = _flatten_settings(runs[0])
    unit = format_powers(PRESSURE, sorted({run.case.reading.length_unit for run in runs}))
    parts = {key: format_label(runs[0], [key]) for key in TITLE_KEYS[len(SCENE) :] if key not in keys and key in values}
    if "pressure" in parts:
        parts["pressure"] += f" {unit}"
    elif "pressure" in keys:
        parts["pressure"] = f"pressure in {unit}"
    scene = format_label(runs[0], [key for key in SCENE if key not in keys])
    return ", ".join(filter(None, [scene, *parts.values()]))


def format_label(run: Run, keys: Sequence[str]) -> str:
    """Format a run's values of ``keys`` in words."""
    values = _flatten_settings(run)
    scene = " ".join(_describe_setting(key, values.get(key)) for key in SCENE if key in keys)
    return ", ".join(
        [scene] * bool(scene) + [_describe_setting(key, values.get(key)) for key in keys if key not in SCENE]
    )


def arrange_panels(runs: Sequence[Run], keys: Sequence[str], aspect: float) -> list[tuple[int, int]]:
    """Choose row and column of each run's panel.  ``aspect``: width over height of a panel.

    Runs that are all combinations of two settings or more form a table of them; settings are distributed over rows and
    columns so that the picture comes nearest to WIDE.  Other runs are placed in their order.
    """
    settings = [_flatten_settings(run) for run in runs]
    values_of = {key: _sort_values([row.get(key) for row in settings]) for key in keys}
    cells = [tuple(values_of[key].index(row.get(key)) for key in keys) for row in settings]
    sizes = [len(values) for values in values_of.values()]
    if len(keys) < 2 or not prod(sizes) == len(runs) == len(set(cells)):
        columns = min(
            range(1, len(runs) + 1), key=lambda count: _rate_grid(ceil(len(runs) / count), count, len(runs), aspect)
        )
        return [divmod(number, columns) for number in range(len(runs))]
    across = _choose_column_keys(keys, sizes, aspect)
    down = [number for number in range(len(keys)) if number not in across]
    return [(_index_cell(cell, down, sizes), _index_cell(cell, across, sizes)) for cell in cells]


def _choose_column_keys(keys: Sequence[str], sizes: Sequence[int], aspect: float) -> tuple[int, ...]:
    """Choose the keys that vary along columns; of equally good choices one with the pressure among them."""

    def cost(across: tuple[int, ...]) -> tuple[float, bool]:
        """Rate a choice: the shape of its grid, then whether the pressure is missing; the least is best."""
        columns = prod(sizes[k] for k in across)
        rows = prod(sizes) // columns
        return round(_rate_grid(rows, columns, prod(sizes), aspect), 6), "pressure" not in [keys[k] for k in across]

    return min((c for n in range(len(keys) + 1) for c in combinations(range(len(keys)), n)), key=cost)


def _rate_grid(rows: int, columns: int, count: int, aspect: float) -> float:
    """Rate how far a grid is from WIDE and from having no empty places; 0 is best."""
    return abs(log(columns * aspect / rows / WIDE)) + BLANK * (rows * columns / count - 1)


def _index_cell(cell: tuple[int, ...], which: Sequence[int], sizes: Sequence[int]) -> int:
    """Compute the row or column of a cell from those of its indices that vary along it."""
    if not which:
        return 0
    return int(np.ravel_multi_index([cell[k] for k in which], [sizes[k] for k in which]))


def _sort_values(values: Sequence[Any]) -> list[Any]:
    """Return each value once: numbers rising, others in their order."""
    distinct = list(dict.fromkeys(values))
    return sorted(distinct) if all(isinstance(value, int | float) for value in distinct) else distinct


def _flatten_settings(run: Run) -> dict[str, Any]:
    """Return all settings that say what is simulated and how it is classified, by "section.key"."""
    nested_settings = {key: value for key, value in run.config.record().items() if key not in COULD_CHANGE_BITS}
    flat: dict[str, Any] = {}
    while nested_settings:
        nested = {}
        for key, value in nested_settings.items():
            if isinstance(value, dict):
                nested.update({f"{key}.{inner}": v for inner, v in value.items()})
            else:
                flat[key] = str(value) if isinstance(value, list) else value
        nested_settings = nested
    return flat


def _describe_setting(key: str, value: Any) -> str:
    """Format a setting and its value for a label."""
    if key == "sintering.name":
        return {"paper": "sintering", "none": "no sintering"}.get(value, f"sintering {value}")
    if key == "indenter.name":
        return f"indented by {value}" if value else "falling"
    text = f"{value:g}" if isinstance(value, float) else "none" if value is None else str(value)
    return {"shape.name": text, "floor.name": f"on {text}"}.get(key, f"{key.removesuffix('.name')} {text}")
