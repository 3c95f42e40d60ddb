"""What matters in a sweep: how far each setting decides each measure, and where runs fail."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import combinations

import numpy as np
import pandas as pd
from pandas.api.types import is_numeric_dtype

from ..errors import ConfigError
from ..store import states
from ..sweep.design import STEP, get_block
from ..text import offer_names
from .collect import POINT, CollectedSweep
from .indices import (
    estimate,
    list_forms,
    make_bins,
    make_separate_bins,
    measure_blocks,
    measure_effects,
    measure_first_order,
    measure_variance,
    pair_halves,
)
from .margins import find_claim, list_margins, read_margins

FAILED = "failed"  # a measure: 1 of a run that failed, 0 of one with a result
FIRST, TOTAL, EFFECT, SPREAD = "first order", "total order", "mean effect", "spread of effects"
LEAST_UNITS = 8  # points, blocks or paths
REGIONS = 4  # bins in which failures are counted
_MEASURES: dict[str, Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]] = {
    "morris": measure_effects,
    "saltelli": measure_blocks,
}
COLUMNS = ("measure", "setting", "index", "value", "low", "high")


@dataclass(frozen=True)
class Influence:
    """How far each setting decides a measure.

    ``table``: COLUMNS, a row for each setting and index, with its interval of 95 %; ``used``: runs with a value;
    ``runs``: of all.  ``note``: why there are no numbers; empty if there are.  ``mixed``: pairs of which the
    runs do not tell whether it is the first that matters, a setting, or the second, one or two of them.
    """

    measure: str
    table: pd.DataFrame
    used: int
    runs: int
    note: str = ""
    mixed: tuple[tuple[str, str], ...] = ()

    def rank(self, index: str) -> list[str]:
        """List the settings, the one with the largest index of a kind first."""
        rows = self.table[self.table["index"] == index].sort_values("value", ascending=False)
        return rows["setting"].tolist()


def measure_influence(sweep: CollectedSweep, measure: str) -> Influence:
    """Measure how far each setting that varies in a sweep decides a measure, the margin of a claim, or FAILED.

    By the design where it was made for that: Saltelli's gives first and total order, Morris's the effects of steps;
    there other settings that vary are averaged over.  Else, and in any other sweep, the first order from the runs that
    have a value.  Raises ConfigError for a column without numbers.
    """
    y = read_measure(sweep, measure)
    design = sweep.sample.design.name if sweep.sample else ""
    used = int(y.notna().sum())
    rows: list[tuple] = []
    note = ""
    mixed: list[tuple[str, str]] = []
    if y.dropna().nunique() < 2:
        note = "it is the same in all runs" if used else "no run has a value"
    elif design in ("morris", "saltelli"):
        rows, note = _measure_by_design(sweep, y)
    else:
        rows, note, mixed = _measure_any(sweep, y)
    table = pd.DataFrame([(measure, *row) for row in rows], columns=COLUMNS)
    return Influence(measure, table, used, len(y), note, tuple(mixed))


def read_measure(sweep: CollectedSweep, measure: str) -> pd.Series:
    """Read a measure of each run, NaN where there is none.  Raises ConfigError where it holds no numbers.

    The margin of a claim is of all runs of a point, and stands with the first of them.
    """
    if measure == FAILED:
        known = sweep.table["state"].isin((states.DONE, states.FAILED))
        return (sweep.table["state"] == states.FAILED).astype(float).where(known)
    if claim := find_claim(sweep, measure):
        return read_margins(sweep, claim)
    if measure not in sweep.columns or not is_numeric_dtype(sweep.table[measure]):
        numbers = [str(name) for name in sweep.columns if is_numeric_dtype(sweep.table[name])]
        hint = offer_names(measure, numbers)
        raise ConfigError(
            f"measure: '{measure}' is no column of numbers that runs give; {hint} {_offer_margins(sweep)}"
        )
    return sweep.table[measure].astype(float)


def _offer_margins(sweep: CollectedSweep) -> str:
    """Name the claims whose margins would be measures too, or say what they need."""
    names = list_margins(sweep)
    if names:
        return f"Measures too are the margins of the claims {', '.join(names)}"
    return "Margins of claims need pressures and sintering=paper,none listed beside what is sampled"


def tabulate_failures(sweep: CollectedSweep) -> pd.DataFrame:
    """Tabulate where runs fail: for each part of each setting its runs, those that failed, and their share.

    Columns: setting, part, runs, failed, share.  Runs that were not run, or were stopped, are not counted.
    """
    failed = read_measure(sweep, FAILED)
    known = sweep.table[failed.notna()]
    rows = []
    for name in sweep.varied:
        values = _read_values(known[name])
        bins = make_bins(values, REGIONS) if values.dtype.kind in "iuf" else make_bins(values)
        for part in np.unique(bins):
            inside = bins == part
            count = int(failed[known.index[inside]].sum())
            label = _describe_part(values[inside])
            rows.append((sweep.key_of(name), label, int(inside.sum()), count, count / inside.sum()))
    return pd.DataFrame(rows, columns=["setting", "part", "runs", "failed", "share"])


def _measure_any(sweep: CollectedSweep, y: pd.Series) -> tuple[list[tuple], str, list[tuple[str, str]]]:
    """Measure the first order of each setting from the runs that have a value.

    Returns rows, why there are none, and the pairs of settings that these runs do not tell apart.
    """
    known = sweep.table[y.notna()]
    points = known[POINT] if POINT in known else pd.Series(range(len(known)), known.index)
    _, first, point = np.unique(points, return_index=True, return_inverse=True)
    if len(first) < LEAST_UNITS:
        return [], f"{len(first)} points have a value, and {LEAST_UNITS} are needed", []
    values = y[known.index].to_numpy()
    means = np.bincount(point, values) / np.bincount(point)

    def measure(bins: np.ndarray, is_sampled: bool, weights: np.ndarray) -> float:
        """Return the first order of a setting; of a sampled one, which a point has once, by the means of the points."""
        if not is_sampled:
            return measure_first_order(bins, values, weights[point])
        variance = measure_variance(values, weights[point])
        if variance == 0:  # of the few points that a bootstrap drew
            return np.nan
        share = measure_variance(means, weights) / variance
        return share * measure_first_order(bins, means, weights) if share else 0.0

    varied = [name for name in sweep.varied if len(known[name].unique()) > 1]  # a claim looks at all pressures at once
    sampled = {name: _read_values(known[name])[first] for name in varied if name in sweep.factors}
    others = _list_forms({sweep.key_of(name): values for name, values in sampled.items()})
    rows, mixed = [], []
    for name in varied:
        if name in sampled:
            bins, unclear = _separate(sweep.key_of(name), sampled[name], others)
            mixed += [(sweep.key_of(name), other) for other in unclear]
        else:
            bins = make_bins(_read_values(known[name]))
        value, half = estimate(partial(measure, bins, name in sampled), len(first))
        rows.append((sweep.key_of(name), FIRST, float(value), float(value - half), float(value + half)))
    return rows, "", mixed


@dataclass(frozen=True)
class _Forms:
    """What a result may depend on: ``values`` (k, n), and of each the settings that it is of, one or two."""

    values: np.ndarray
    settings: tuple[tuple[str, ...], ...]


def _list_forms(sampled: Mapping[str, np.ndarray]) -> _Forms:
    """List what a result may depend on of sampled settings (n,): parts of each, and each two together."""
    forms: dict[tuple[str, ...], np.ndarray] = {(key,): list_forms(values) for key, values in sampled.items()}
    forms |= {(a, b): pair_halves(sampled[a], sampled[b])[None] for a, b in combinations(sampled, 2)}
    settings = tuple(of for of, values in forms.items() for _ in values)
    return _Forms(np.concatenate([*forms.values()]) if forms else np.empty((0, 0)), settings)


def _separate(key: str, values: np.ndarray, forms: _Forms) -> tuple[np.ndarray, list[str]]:
    """Number the bins of a setting, so that it is told from all others; and name those that it is not told from."""
    others = [i for i, settings in enumerate(forms.settings) if key not in settings]
    if not others:
        return make_bins(values), []
    bins, mixed = make_separate_bins(values, forms.values[others])
    found = dict.fromkeys(forms.settings[others[i]] for i in mixed)
    alone = {each[0] for each in found if len(each) == 1}
    return bins, [" with ".join(each) for each in found if len(each) == 1 or alone.isdisjoint(each)]


def _measure_by_design(sweep: CollectedSweep, y: pd.Series) -> tuple[list[tuple], str]:
    """Measure the indices that Morris's or Saltelli's design is made for; rows, and why there are none."""
    assert sweep.sample is not None, "a design sampled it"
    sample, keys = sweep.sample, sweep.sample.keys
    means = y.groupby(sweep.table[POINT]).mean().reindex(range(len(sample))).to_numpy()
    blocks = means.reshape(-1, get_block(sample.design, len(keys)))
    if sample.design.name == "morris":
        places = sample.places.reshape(*blocks.shape, len(keys))
        blocks, names, index = _list_effects(blocks, places), (EFFECT, SPREAD), _MEASURES["morris"]
        blocks = blocks[~np.isnan(blocks).all(axis=1)]
    else:
        names, index = (FIRST, TOTAL), _MEASURES["saltelli"]
        blocks = blocks[~np.isnan(blocks).any(axis=1)]
    if len(blocks) < LEAST_UNITS:
        return [], f"{len(blocks)} paths or blocks have all values, and {LEAST_UNITS} are needed"
    values, halves = estimate(lambda weights: np.stack(index(blocks, weights)), len(blocks))
    return [
        (key, name, *map(float, (values[i, j], values[i, j] - halves[i, j], values[i, j] + halves[i, j])))
        for i, name in enumerate(names)
        for j, key in enumerate(keys)
    ], ""


def _list_effects(values: np.ndarray, places: np.ndarray) -> np.ndarray:
    """List the effect of each setting in each path, over its whole range: (paths, settings)."""
    moved = np.diff(places, axis=1)  # (path, step, setting), one setting a step
    slopes = np.diff(values, axis=1)[:, :, None] * np.sign(np.round(moved / STEP)) / STEP
    step_of = np.abs(moved).argmax(axis=1)  # (path, setting)
    return np.take_along_axis(slopes, step_of[:, None, :], axis=1)[:, 0]


def _read_values(values: pd.Series) -> np.ndarray:
    """Read a setting: as numbers if all its values are, also written ones; else as text."""
    numbers = pd.to_numeric(values, errors="coerce")
    return numbers.to_numpy(float) if numbers.notna().all() else values.astype(str).to_numpy(str)


def _describe_part(values: np.ndarray) -> str:
    """Describe a part of a setting: its value, or from where to where it goes."""
    if values.dtype.kind not in "iuf":
        return str(values[0])
    low, high = f"{values.min():.4g}", f"{values.max():.4g}"
    return low if low == high else f"{low} to {high}"
