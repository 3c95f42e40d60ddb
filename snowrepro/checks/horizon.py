"""Tier 2: a few numbers of every quantity in short runs, within what rounding does to them.

The tolerance is measured: the same run is made several times with each particle moved by some units in the last place
in every frame (``cases.observe``), and FACTOR times the largest deviation is allowed.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from ..config import Config
from ..mpm.state import TOTALS
from ..scene.build import build_scene
from .baseline import by_name
from .cases import State, by_start, observe
from .finding import NOT_MEASURED, OK, REGRESSED, Finding

TWINS = 8  # runs with other rounding
FACTOR = 10.0
FLOOR = 1e-13  # of a quantity's largest value: what a sum over the particles may be rounded by
KEYS = ["case", "frame", "number"]


def numbers(states: Mapping[int, State], start: np.ndarray) -> pd.DataFrame:
    """Of each component of each quantity the mean, the spread, and the means along x and y; rows frame, number, value.

    ``start`` (n, 2): where the particles started.  ``scale``: the largest value behind a number.
    """
    place = (start - start.mean(axis=0)) / start.std(axis=0)
    rows = []
    for frame, state in states.items():
        for name, values in state.items():
            if name == "totals":
                rows += [(frame, total, value, abs(value)) for total, value in zip(TOTALS, values, strict=True)]
                continue
            for index, column in enumerate(values.reshape(len(values), -1).T):
                label = f"{name} {index}" if values.ndim > 1 else name
                scale = float(np.abs(column).max())
                along = {f"along {axis}": (column * places).mean() for axis, places in zip("xy", place.T, strict=True)}
                found = {"mean": column.mean(), "spread": column.std(), **along}
                rows += [(frame, f"{label} {what}", float(value), scale) for what, value in found.items()]
    return pd.DataFrame(rows, columns=["frame", "number", "value", "scale"])


def start_of(config: Config) -> np.ndarray:
    """Where the particles of a run start, in the order of ``observe``."""
    scene = build_scene(config)
    return scene.positions[by_start(scene)]


def reference(case: str, config: Config, states: Mapping[int, State]) -> pd.DataFrame:
    """The numbers of a run with the tolerance of each: columns KEYS, value, tolerance."""
    start = start_of(config)
    own = numbers(states, start)
    twins = [numbers(observe(config, np.random.default_rng(seed)), start)["value"] for seed in range(TWINS)]
    spread = np.abs(np.stack(twins) - own["value"].to_numpy()).max(axis=0)
    tolerance = np.maximum(FACTOR * spread, FLOOR * own["scale"])
    return own.assign(case=case, tolerance=tolerance)[[*KEYS, "value", "tolerance"]]


def compare(case: str, found: pd.DataFrame, reference: pd.DataFrame) -> Finding:
    """The largest deviation of a case's numbers, in tolerances."""
    own = reference[reference["case"] == case]
    if own.empty:
        return Finding(2, case, NOT_MEASURED, "the reference does not have this case", "1 tolerance")
    both = own.merge(found, on=["frame", "number"], how="outer", suffixes=("", "_now"))
    away = np.abs(both["value_now"] - both["value"]).to_numpy()
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(away == 0.0, 0.0, away / both["tolerance"])
    ratio = np.nan_to_num(ratio, nan=np.inf)
    worst = both.iloc[int(ratio.argmax())]
    state = OK if ratio.max() <= 1.0 else REGRESSED
    where = f" at {worst['number']}, frame {worst['frame']}" if ratio.max() > 0 else ""
    beyond = f"{worst['value']:.6g} -> {worst['value_now']:.6g}; {(ratio > 1).sum()} of {len(both)} beyond"
    note = beyond if state == REGRESSED else ""
    return Finding(2, case, state, f"{ratio.max():.2g} tolerances{where}", "1 tolerance", note)


def changes(before: pd.DataFrame, after: pd.DataFrame) -> Sequence[str]:
    """What a new reference changes, case by case, in words."""
    lines = []
    for case, old, new in by_name("case", before, after):
        found = compare(case, new, old) if len(old) else None
        note = f"; {found.note}" if found and found.note else ""
        lines.append(
            f"{case}: {found.measured} of the old reference{note}" if found else f"{case}: {len(new)} numbers, new"
        )
    return lines
