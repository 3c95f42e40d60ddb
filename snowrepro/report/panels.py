"""Several runs side by side: what tells them apart, in words, and where in a grid each has its panel."""

from collections.abc import Sequence
from itertools import combinations
from math import ceil, log, prod
from typing import Any

import numpy as np

from ..config import Config
from ..store import manifest, runs

SCENE = ("shape.name", "floor.name")
TOLD = (*SCENE, "pressure", "sintering.name", "indenter.name")  # in a title, where all runs share them
FIRST = (*TOLD, "fidelity.name", "reading.name", "material.name", "seed")  # tell runs apart before other settings do
WIDE = 16 / 9  # of a picture
BLANK = 3.0  # what empty places cost, beside a factor e in width over height


def varied(configs: Sequence[Config]) -> list[str]:
    """The settings in which runs differ, as "section.key"; none that the ones before it already tell."""
    flat = [_flat(config) for config in configs]
    keys = [key for key in FIRST if len({row.get(key) for row in flat}) > 1]
    for key in dict.fromkeys(key for row in flat for key in row):
        told = {tuple(row.get(k) for k in keys) for row in flat}
        if len({tuple(row.get(k) for k in (*keys, key)) for row in flat}) > len(told):
            keys.append(key)
    return keys


def title_of(configs: Sequence[Config], keys: Sequence[str]) -> str:
    """Scene, pressure, sintering and hardness test, as far as runs that differ in ``keys`` share them."""
    values = _flat(configs[0])
    return label_of(configs[0], [key for key in TOLD if key not in keys and key in values])


def label_of(config: Config, keys: Sequence[str]) -> str:
    """What a run has for ``keys``, in words."""
    values = _flat(config)
    scene = " ".join(_words(key, values.get(key)) for key in SCENE if key in keys)
    return ", ".join([scene] * bool(scene) + [_words(key, values.get(key)) for key in keys if key not in SCENE])


def arrange(configs: Sequence[Config], keys: Sequence[str], aspect: float) -> list[tuple[int, int]]:
    """Row and column of each run's panel, whose width over height is ``aspect``.

    Runs that are all combinations of two settings or more make a table of them, the settings shared out between rows
    and columns so that the picture comes nearest to WIDE; others are laid out in their order.
    """
    flat = [_flat(config) for config in configs]
    found = {key: _in_order([row.get(key) for row in flat]) for key in keys}
    cells = [tuple(found[key].index(row.get(key)) for key in keys) for row in flat]
    sizes = [len(values) for values in found.values()]
    if len(keys) < 2 or not prod(sizes) == len(configs) == len(set(cells)):
        columns = min(range(1, len(configs) + 1), key=lambda n: _cost(ceil(len(configs) / n), n, len(configs), aspect))
        return [divmod(k, columns) for k in range(len(configs))]
    across = _across(keys, sizes, aspect)
    down = [k for k in range(len(keys)) if k not in across]
    return [(_place(cell, down, sizes), _place(cell, across, sizes)) for cell in cells]


def _across(keys: Sequence[str], sizes: Sequence[int], aspect: float) -> tuple[int, ...]:
    """Which of the keys go along columns; of equally good choices one with the pressure among them."""

    def cost(across: tuple[int, ...]) -> tuple[float, bool]:
        columns = prod(sizes[k] for k in across)
        rows = prod(sizes) // columns
        return round(_cost(rows, columns, prod(sizes), aspect), 6), "pressure" not in [keys[k] for k in across]

    return min((c for n in range(len(keys) + 1) for c in combinations(range(len(keys)), n)), key=cost)


def _cost(rows: int, columns: int, count: int, aspect: float) -> float:
    """How far a grid is from WIDE and from having no empty places."""
    return abs(log(columns * aspect / rows / WIDE)) + BLANK * (rows * columns / count - 1)


def _place(cell: tuple[int, ...], which: Sequence[int], sizes: Sequence[int]) -> int:
    """Where along rows or columns a cell is, by those of its indices."""
    if not which:
        return 0
    return int(np.ravel_multi_index([cell[k] for k in which], [sizes[k] for k in which]))


def _in_order(values: Sequence[Any]) -> list[Any]:
    """Each value once: numbers rising, others as they came."""
    once = list(dict.fromkeys(values))
    return sorted(once) if all(isinstance(value, int | float) for value in once) else once


def _flat(config: Config) -> dict[str, Any]:
    """All settings that say what was simulated and how it is classified, by "section.key"."""
    plain = {key: value for key, value in runs.plain(config).items() if key not in manifest.WAYS}
    found: dict[str, Any] = {}
    while plain:
        nested = {}
        for key, value in plain.items():
            if isinstance(value, dict):
                nested.update({f"{key}.{inner}": v for inner, v in value.items()})
            else:
                found[key] = str(value) if isinstance(value, list) else value
        plain = nested
    return found


def _words(key: str, value: Any) -> str:
    """A setting and its value in a label."""
    if key == "sintering.name":
        return {"paper": "sintering", "none": "no sintering"}.get(value, f"sintering {value}")
    if key == "indenter.name":
        return f"indented by {value}" if value else "falling"
    shown = f"{value:g}" if isinstance(value, float) else "none" if value is None else str(value)
    return {"shape.name": shown, "floor.name": f"on {shown}"}.get(key, f"{key.removesuffix('.name')} {shown}")
