"""What laws and constants do: runs with one left out, or one alone, beside the runs with all."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from .collect import CollectedSweep

VARIANT = "variant"
STATES = ("lump_fraction", "crushed_fraction", "loose_fraction")
MEASURES = (*STATES, "flattening_end")
LUMPS = STATES[0]
LEAST_CHANGE = 0.05  # of the mass in lumps; less is called no change


@dataclass(frozen=True)
class Ablation:
    """The variants of an experiment, of which the first is the whole.

    ``table``: a row for each variant and pressure, with the means over seeds of MEASURES, NaN without a result, and the
    ``least`` and ``most`` mass in lumps of a seed, ``done`` and ``asked``: numbers of runs.
    """

    table: pd.DataFrame

    @property
    def variants(self) -> list[str]:
        """The names of the variants, in order."""
        return list(self.table[VARIANT].unique())

    @property
    def pressures(self) -> list[float]:
        """The pressures, rising."""
        return sorted(self.table["pressure"].unique())

    @property
    def whole(self) -> str:
        """The name of the variant without any change."""
        return self.variants[0]

    def row(self, variant: str, pressure: float) -> pd.Series:
        """Return the row of a variant at a pressure."""
        rows = self.table[(self.table[VARIANT] == variant) & (self.table["pressure"] == pressure)]
        return rows.iloc[0]

    def measure_change(self, variant: str, pressure: float) -> float:
        """Return by how much the mass in lumps differs from that of the whole; 0 where that says nothing.

        It says nothing if it is less than LEAST_CHANGE, or if seeds of both lie among each other.  NaN without a
        result.
        """
        one, whole = self.row(variant, pressure), self.row(self.whole, pressure)
        change = one[LUMPS] - whole[LUMPS]
        if one["least"] <= whole["most"] and whole["least"] <= one["most"]:
            change = 0.0 * change
        return float(change) if not abs(change) < LEAST_CHANGE else 0.0


def tabulate_ablation(sweep: CollectedSweep) -> Ablation:
    """Tabulate the variants of a sweep: see ``Ablation``."""
    names = sweep.table.get(VARIANT, pd.Series("base", sweep.table.index))
    rows = []
    for (variant, pressure), cell in sweep.table.groupby([names, "pressure"], sort=False):
        lumps = cell[LUMPS].astype(float)
        means = {measure: float(cell[measure].astype(float).mean()) for measure in MEASURES}
        counts = {"done": int(lumps.notna().sum()), "asked": len(cell)}
        rows.append(
            {VARIANT: variant, "pressure": pressure, **means, "least": lumps.min(), "most": lumps.max(), **counts}
        )
    return Ablation(pd.DataFrame(rows))


def split_variants(ablation: Ablation, variants: Sequence[str], pressure: float) -> dict[str, list[str]]:
    """Split variants by what they do to the mass in lumps at a pressure.

    "halved": it loses half or more of the whole's; "less" and "more": it changes otherwise; "same": it does not;
    "unknown": without a result.
    """
    split: dict[str, list[str]] = {kind: [] for kind in ("halved", "less", "more", "same", "unknown")}
    whole = ablation.row(ablation.whole, pressure)[LUMPS]
    for variant in variants:
        change = ablation.measure_change(variant, pressure)
        if math.isnan(change):
            kind = "unknown"
        elif change < 0:
            kind = "halved" if change <= -whole / 2 else "less"
        else:
            kind = "more" if change > 0 else "same"
        split[kind].append(variant)
    return split
