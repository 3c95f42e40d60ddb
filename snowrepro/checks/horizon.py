"""Tier 2: a few numbers of every quantity in short runs, within what rounding does to them.

The tolerance is measured: the same case is simulated several times with each particle moved by some units in the last
place in every frame (``cases.observe_run``), and FACTOR times the largest deviation is allowed.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from ..mpm.ledger import TOTALS
from ..scene.build import build_scene
from ..settings.case import Case
from .baseline import group_by_name
from .cases import State, observe_run, order_by_start
from .finding import NOT_MEASURED, OK, REGRESSED, Finding

TWINS = 8  # runs with other rounding
FACTOR = 10.0
FLOOR = 1e-13  # of a quantity's largest value: what a sum over the particles may be rounded by
KEYS = ["case", "frame", "number"]


def tabulate_numbers(states: Mapping[int, State], start: np.ndarray) -> pd.DataFrame:
    """Tabulate mean, spread and means along x and y of each component of each quantity: frame, number, value, scale.

    ``start`` (n, 2): places of the particles at the start; ``scale``: the largest value behind a number.
    """
    coordinates = (start - start.mean(axis=0)) / start.std(axis=0)
    rows = []
    for frame, state in states.items():
        for name, values in state.items():
            if name == "totals":
                rows += [(frame, total, value, abs(value)) for total, value in zip(TOTALS, values, strict=True)]
                continue
            for index, column in enumerate(values.reshape(len(values), -1).T):
                label = f"{name} {index}" if values.ndim > 1 else name
                scale = float(np.abs(column).max())
                along = {
                    f"along {axis}": (column * places).mean() for axis, places in zip("xy", coordinates.T, strict=True)
                }
                numbers = {"mean": column.mean(), "spread": column.std(), **along}
                rows += [(frame, f"{label} {number}", float(value), scale) for number, value in numbers.items()]
    return pd.DataFrame(rows, columns=["frame", "number", "value", "scale"])


def find_start(short_run: Case) -> np.ndarray:
    """Find the places (n, 2) of the particles at the start, in the order of ``cases.observe_run``."""
    scene = build_scene(short_run)
    return scene.positions[order_by_start(scene)]


def make_reference(case: str, short_run: Case, states: Mapping[int, State]) -> pd.DataFrame:
    """Make the reference of a case: its numbers with the tolerance of each, columns KEYS, value, tolerance."""
    start = find_start(short_run)
    numbers = tabulate_numbers(states, start)
    twins = [
        tabulate_numbers(observe_run(short_run, np.random.default_rng(seed)), start)["value"] for seed in range(TWINS)
    ]
    spread = np.abs(np.stack(twins) - numbers["value"].to_numpy()).max(axis=0)
    tolerance = np.maximum(FACTOR * spread, FLOOR * numbers["scale"])
    return numbers.assign(case=case, tolerance=tolerance)[[*KEYS, "value", "tolerance"]]


def compare_with_reference(case: str, numbers: pd.DataFrame, reference: pd.DataFrame) -> Finding:
    """Compare the numbers of a case with the reference: the largest deviation, in tolerances."""
    reference_numbers = reference[reference["case"] == case]
    if reference_numbers.empty:
        return Finding(2, case, NOT_MEASURED, "the reference does not have this case", "1 tolerance")
    both = reference_numbers.merge(numbers, on=["frame", "number"], how="outer", suffixes=("", "_now"))
    distance = np.abs(both["value_now"] - both["value"]).to_numpy()
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(distance == 0.0, 0.0, distance / both["tolerance"])
    ratio = np.nan_to_num(ratio, nan=np.inf)
    worst = both.iloc[int(ratio.argmax())]
    state = OK if ratio.max() <= 1.0 else REGRESSED
    where = f" at {worst['number']}, frame {worst['frame']}" if ratio.max() > 0 else ""
    beyond = f"{worst['value']:.6g} -> {worst['value_now']:.6g}; {(ratio > 1).sum()} of {len(both)} beyond"
    note = beyond if state == REGRESSED else ""
    return Finding(2, case, state, f"{ratio.max():.2g} tolerances{where}", "1 tolerance", note)


def describe_changes(before: pd.DataFrame, after: pd.DataFrame) -> Sequence[str]:
    """Describe what a new reference changes, a line for each case."""
    lines = []
    for case, old, new in group_by_name("case", before, after):
        finding = compare_with_reference(case, new, old) if len(old) else None
        note = f"; {finding.note}" if finding and finding.note else ""
        lines.append(
            f"{case}: {finding.measured} of the old reference{note}" if finding else f"{case}: {len(new)} numbers, new"
        )
    return lines
