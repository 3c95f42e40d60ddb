"""Choose the three pressures that the paper does not print, on one scene and by one rule."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy.optimize import isotonic_regression


def calibrate(table: pd.DataFrame, targets: Sequence[float]) -> list[float | None]:
    """Pressures at which the sintered lump fraction first reaches each target.

    A rising curve is fitted to lump fraction over log pressure (isotonic regression; seeds are
    averaged) and read off by linear interpolation; two significant digits.  None where the ladder
    never crosses a target.
    """
    sintered = table[table["sintering"] != "none"]
    means = sintered.groupby("pressure")["lump_fraction"].mean().sort_index()
    logs = np.log(means.index.to_numpy())
    rising = isotonic_regression(means.to_numpy()).x
    return [_crossing(logs, rising, target) for target in targets]


def _crossing(logs: np.ndarray, rising: np.ndarray, target: float) -> float | None:
    above = np.flatnonzero(rising >= target)
    if len(above) == 0 or above[0] == 0:
        return None
    i = above[0]
    share = (target - rising[i - 1]) / (rising[i] - rising[i - 1])
    return float(f"{np.exp(logs[i - 1] + share * (logs[i] - logs[i - 1])):.2g}")
