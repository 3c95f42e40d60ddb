"""The paper's claims as statements about numbers, and what a set of runs says of each.

"More lumps than powder" is read as: more than half of the mass is in lumps.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

REPRODUCED = "REPRODUCED"
CONTRADICTED = "CONTRADICTED"
BY_CALIBRATION = "HOLDS BY CALIBRATION"
NOT_RUN = "NOT RUN"


@dataclass(frozen=True)
class Verdict:
    """A claim, what was measured, and the word for it."""

    claim: str
    statement: str
    measured: str
    word: str


def judge(table: pd.DataFrame, calibrated: bool, missing: Collection[tuple[str, float]] = ()) -> list[Verdict]:
    """Judge the claims by a table with columns pressure, sintering and lump_fraction.

    ``missing``: sintering and pressure of runs that were asked for and have no result; a claim about
    them is not judged by the others.
    ``calibrated``: the pressures were chosen by the lumps of the sintered runs of this very scene, so
    C1 to C3 and C5 cannot count as tests where they hold.  Several seeds are averaged.
    """
    arms, empty = _arms(table), pd.Series(dtype=float)
    sintered, unsintered = arms.get("paper", empty), arms.get("none", empty)
    contrast = (sintered - unsintered).dropna()
    lowest, highest = sintered.iloc[:1], sintered.iloc[-1:]
    judged = (
        ("C1", "With sintering, lumps grow with pressure.", sintered, 2, _grows),
        ("C2", "With sintering, the lowest pressure gives more powder than lumps.", lowest, 1, _powder),
        ("C3", "With sintering, the highest pressure gives more lumps than powder.", highest, 1, _lumps),
        ("C4", "Without sintering, every pressure gives more powder than lumps.", unsintered, 1, _powder),
        ("C5", "What sintering adds to the lumps grows with pressure.", contrast, 2, _grows),
    )
    about = {"C4": ("none",), "C5": ("paper", "none")}  # the others: sintered runs
    verdicts = []
    for claim, *rest in judged:
        lost = [f"{pressure:g}" for arm, pressure in missing if arm in about.get(claim, ("paper",))]
        verdicts.append(_verdict(claim, *rest, calibrated and claim != "C4", lost))
    return verdicts


def sentence(table: pd.DataFrame, verdicts: list[Verdict]) -> str:
    """The numbers and the verdicts in words."""
    parts = []
    for name, means in _arms(table).items():
        listed = ", ".join(f"{value:.2f}" for value in means)
        pressures = ", ".join(f"{pressure:g}" for pressure in means.index)
        how = "with" if name == "paper" else "without"
        parts.append(f"{how} sintering the mass in lumps is {listed} at pressures {pressures}")
    words = (
        (REPRODUCED, "reproduced"),
        (BY_CALIBRATION, "held only because the pressures were calibrated on it"),
        (CONTRADICTED, "contradicted"),
        (NOT_RUN, "not run"),
    )
    for word, text in words:
        claims = ", ".join(v.claim for v in verdicts if v.word == word)
        if claims:
            parts.append(f"{text}: {claims}")
    text = "; ".join(parts)
    return f"{text[0].upper()}{text[1:]}."


def _arms(table: pd.DataFrame) -> dict[str, pd.Series]:
    """Mean lump fraction by pressure, rising, for each arm that was run: "paper" and "none"."""
    if table.empty:
        return {}
    means = table.groupby(["sintering", "pressure"])["lump_fraction"].mean().sort_index()
    return {name: means[name] for name in ("paper", "none") if name in means.index.get_level_values(0)}


def _verdict(
    claim: str,
    statement: str,
    values: pd.Series,
    least: int,
    holds: Callable[[np.ndarray], bool],
    fitted: bool,
    lost: Sequence[str],
) -> Verdict:
    """Apply ``holds`` to the values by pressure, if there are at least ``least`` and none is ``lost``."""
    measured = ", ".join(f"{value:.2f} at {pressure:g}" for pressure, value in values.items())
    if lost:
        return Verdict(claim, statement, f"{measured or 'no runs'}; no result at {', '.join(lost)}", NOT_RUN)
    if len(values) < least:
        return Verdict(claim, statement, measured or "no runs", NOT_RUN)
    if not holds(values.to_numpy()):
        return Verdict(claim, statement, measured, CONTRADICTED)
    return Verdict(claim, statement, measured, BY_CALIBRATION if fitted else REPRODUCED)


def _grows(values: np.ndarray) -> bool:
    return bool((np.diff(values) > 0).all())


def _powder(values: np.ndarray) -> bool:
    return bool((values < 0.5).all())


def _lumps(values: np.ndarray) -> bool:
    return bool((values > 0.5).all())
