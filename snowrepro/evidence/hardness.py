"""Whether lumps follow hardness: falls and hardness tests of the same snow in pairs, and rank correlations."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import rankdata

from ..settings.case import ARMS
from ..store.run import Run
from ..summary.measure import measure_hardness
from ..summary.row import ARM

KEYS = [ARM, "sintering", "pressure", "seed"]
ARM_LABELS = dict(zip(ARMS, ("with sintering", "without sintering"), strict=True))
MEASURES = {
    "hardness": "hardness",
    "flattening_most": "flattening at most",
    "flattening_end": "flattening at the end",
    "rebound": "rebound",
    "lump_fraction": "mass in lumps",
}
OTHERS = {
    "indentation_work": "work of indentation",
    "factor_at_release": "hardening factor at release",
    "density_at_release": "density at release",
}
DEPTHS = (0.25, 0.5, 1.0)  # parts of the test's depth at which its hardness is read
APART = 0.1  # difference in lumps by which snows of equal hardness show that hardness alone does not decide
LEVEL = 0.05  # of the test of a rank correlation
SHUFFLES = 9999  # of the pairs, by which chance is judged
DIGITS = 3  # by which snows are different: those that pressing did not change are one and the same
LEAST = 4  # pairs: fewer have no correlation


@dataclass(frozen=True)
class RankCorrelation:
    """Spearman's rank correlation of lumps with a measure over ``count`` snows.

    ``p``: the chance of a correlation as large as ``rho`` if there were none.
    """

    rho: float
    p: float
    count: int

    @property
    def is_beyond_chance(self) -> bool:
        """Whether lumps rise with the measure, and not by chance."""
        return self.rho > 0 and self.p <= LEVEL

    def __str__(self) -> str:
        return (
            f"{self.rho:+.2f} (p = {self.p:.1g}, {self.count} snows)"
            if np.isfinite(self.rho)
            else f"not known ({self.count} snows)"
        )


def pair_falls_with_tests(table: pd.DataFrame) -> pd.DataFrame:
    """Pair the fall and the hardness test of each snow (sintering, pressure, seed) in a row; NaN where one is missing.

    ``table``: rows of runs.
    """
    columns = [*MEASURES, *OTHERS]
    return table.reindex(columns=[*KEYS, *columns]).groupby(KEYS, sort=False)[columns].first().astype(float)


def correlate_ranks(lumps: pd.Series, measure: pd.Series) -> RankCorrelation:
    """Correlate the ranks of lumps and of a measure over the different snows that have both.

    There is no correlation (NaN) with fewer than LEAST snows, or where one of the two never changes.
    """
    both = pd.concat([lumps, measure], axis=1).dropna().map(round_to_digits).drop_duplicates()
    if len(both) < LEAST or (both.nunique() < 2).any():
        return RankCorrelation(float("nan"), float("nan"), len(both))
    ranks = rankdata(both, axis=0)
    one, other = ((ranks - ranks.mean(axis=0)) / ranks.std(axis=0)).T
    rho = float((one * other).mean())
    shuffled = np.random.default_rng(0).permuted(np.tile(other, (SHUFFLES, 1)), axis=1) @ one / len(one)
    count_as_far = int((np.abs(shuffled) >= abs(rho) - 1e-9).sum())
    return RankCorrelation(rho, (1 + count_as_far) / (1 + SHUFFLES), len(both))


def round_to_digits(value: float) -> float:
    """Round a number to DIGITS significant digits."""
    return float(f"{value:.{DIGITS}g}")


def select_arm_pairs(arm: str, pairs: pd.DataFrame) -> pd.DataFrame:
    """Select the pairs of one arm, by pressure and seed; empty if it was not simulated."""
    rows = pairs[pairs.index.get_level_values(ARM) == arm]
    return rows.droplevel([ARM, "sintering"]).sort_index()


def write_sentence(pairs: pd.DataFrame, unit: str = "") -> str:
    """Write in words whether lumps follow hardness.  ``unit``: of pressure and hardness."""
    sintered = select_arm_pairs(ARMS[0], pairs)
    own = correlate_ranks(sintered["lump_fraction"], sintered["hardness"])
    every = correlate_ranks(pairs["lump_fraction"], pairs["hardness"])
    if not (np.isfinite(own.rho) and np.isfinite(every.rho)):
        return "Too few runs have a fall and a hardness test to say whether lumps follow hardness."
    alike = find_equal_hardness(pairs)
    apart = alike[(alike["unsintered"] - alike["sintered"]).abs() > APART]
    word = "Lumps do not follow hardness"
    if own.is_beyond_chance or every.is_beyond_chance:
        word = "Lumps follow hardness only in part"
    if own.is_beyond_chance and every.is_beyond_chance and apart.empty:
        word = "Lumps follow hardness"
    text = f"{word}: Spearman's rank correlation is {own} with sintering and {every} in all."
    if len(apart):
        text += f" Hardness alone does not make them: {describe_equal_hardness(apart)}."
    told = f"{text} {_describe_ranges(pairs)}".rstrip()
    return f"{told} Pressure and hardness are in {unit}." if unit else told


def _describe_ranges(pairs: pd.DataFrame) -> str:
    """Describe how hard the snow of each arm is at the lowest and highest pressure, and how much of it is in lumps."""
    parts = []
    for arm, label in ARM_LABELS.items():
        rows = select_arm_pairs(arm, pairs).dropna(subset=["hardness", "lump_fraction"])
        if len(rows) > 1:
            (low, *_), (high, *_) = rows.index[0], rows.index[-1]
            first, last = rows.iloc[0], rows.iloc[-1]
            parts.append(
                f"{label} hardness goes from {round_to_digits(first['hardness']):,.0f} to "
                f"{round_to_digits(last['hardness']):,.0f} and lumps from "
                f"{first['lump_fraction']:.2f} to {last['lump_fraction']:.2f} between pressures {low:g} and {high:g}"
            )
    text = "; ".join(parts)
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def find_equal_hardness(pairs: pd.DataFrame) -> pd.DataFrame:
    """Find unsintered snows that are as hard as sintered ones, a row each with the mass in lumps of both.

    Columns ``pressure``, ``hardness``, ``unsintered``, and ``sintered``: between the neighbours in hardness, over its
    logarithm.
    """
    sintered, unsintered = (select_arm_pairs(arm, pairs).dropna(subset=["hardness", "lump_fraction"]) for arm in ARMS)
    sintered, unsintered = sintered.sort_values("hardness"), unsintered.reset_index()
    comparable = unsintered[unsintered["hardness"].between(sintered["hardness"].min(), sintered["hardness"].max())]
    logs = np.log(sintered["hardness"].to_numpy())
    sintered_lumps = (
        np.interp(np.log(comparable["hardness"]), logs, sintered["lump_fraction"]) if len(comparable) else []
    )
    columns = comparable[["pressure", "hardness", "lump_fraction"]].rename(columns={"lump_fraction": "unsintered"})
    return columns.assign(sintered=sintered_lumps)


def describe_equal_hardness(alike: pd.DataFrame) -> str:
    """Describe snows of equal hardness in words."""
    return "; ".join(
        f"unsintered snow of pressure {row.pressure:g} and hardness {round_to_digits(row.hardness):,.0f} has "
        f"{row.unsintered:.2f} of its mass in lumps, sintered snow as hard {row.sintered:.2f}"
        for row in alike.itertuples()
    )


def tabulate_correlations(pairs: pd.DataFrame) -> pd.DataFrame:
    """Tabulate Spearman's rank correlation of lumps with each measure: sintered snow, unsintered snow, all snow."""
    names = {**MEASURES, **{name: f"hardness at {name}" for name in pairs if name not in MEASURES}, **OTHERS}
    rows = []
    for name, measure in names.items():
        if name == "lump_fraction":
            continue
        groups = {label: select_arm_pairs(arm, pairs) for arm, label in ARM_LABELS.items()} | {"all": pairs}
        correlations = {
            group: str(correlate_ranks(snows["lump_fraction"], snows[name])) for group, snows in groups.items()
        }
        rows.append({"measure": measure, **correlations})
    return pd.DataFrame(rows)


def tabulate_hardness_by_depth(runs: Sequence[Run]) -> pd.DataFrame:
    """Tabulate the hardness at parts of the whole depth, a row for each snow."""
    rows = []
    for run in runs:
        test = run.case.indenter
        assert test is not None
        with run.open() as dataset:
            hardness_at = {
                f"{part * test.depth:g} cells": measure_hardness(dataset, part * test.depth) for part in DEPTHS[:-1]
            }
        key = (run.case.arm, run.case.sintering.name, run.case.pressure, run.case.seed)
        rows.append({**dict(zip(KEYS, key, strict=True)), **hardness_at})
    return pd.DataFrame(rows, columns=None if rows else KEYS).set_index(KEYS)
