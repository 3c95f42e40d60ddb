"""The paper's claims as statements about numbers, and what a set of runs says of each.

"More lumps than powder" is read as: more than half of the mass is in lumps.
"""

from collections.abc import Callable
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


def judge(table: pd.DataFrame, calibrated: bool) -> list[Verdict]:
    """Judge the claims by a table with columns pressure, sintering and lump_fraction.

    ``calibrated``: the pressures were chosen by the lumps of the sintered runs of this very scene, so
    C1 to C3 and C5 cannot count as tests where they hold.  Several seeds are averaged.
    """
    arms, empty = _arms(table), pd.Series(dtype=float)
    sintered, unsintered = arms.get("paper", empty), arms.get("none", empty)
    contrast = (sintered - unsintered).dropna()
    lowest, highest = sintered.iloc[:1], sintered.iloc[-1:]
    judged = (
        ("C1", "With sintering, lumps grow with pressure.", sintered, 2, _grows, calibrated),
        ("C2", "With sintering, the lowest pressure gives more powder than lumps.", lowest, 1, _powder, calibrated),
        ("C3", "With sintering, the highest pressure gives more lumps than powder.", highest, 1, _lumps, calibrated),
        ("C4", "Without sintering, every pressure gives more powder than lumps.", unsintered, 1, _powder, False),
        ("C5", "What sintering adds to the lumps grows with pressure.", contrast, 2, _grows, calibrated),
    )
    return [_verdict(*claim) for claim in judged]


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
    claim: str, statement: str, values: pd.Series, least: int, holds: Callable[[np.ndarray], bool], fitted: bool
) -> Verdict:
    """Apply ``holds`` to the values by pressure, if there are at least ``least``."""
    measured = ", ".join(f"{value:.2f} at {pressure:g}" for pressure, value in values.items())
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
