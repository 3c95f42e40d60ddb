"""The map: what becomes of the snow over impact number and press number, and where the paper's claims hold."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ..composition.compose import compose
from ..store import states
from ..summary.scales import measure_scales
from .calibration import Crossing, bracket_half_of_runs
from .choices import CHOICE
from .collect import CollectedSweep

STATES = ("lump_fraction", "crushed_fraction", "loose_fraction")
LUMPS = STATES[0]
IMPACT, PRESS = "impact_number", "press_number"
PLACE = ("floor", IMPACT)
NEVER = (states.PENDING, states.RUNNING, states.INTERRUPTED)  # states that say nothing of the snow
# Readings that are marked on the map, each with what it changes.  Those of legacy Taichi: its early examples have a
# gravity of 20, and its scripts make drops of 60 to 100 cells likely.
READINGS = {
    "default reading": (),
    "SI units": ("reading=si",),
    "legacy Taichi, gravity 20": ("reading.gravity=20",),
    "legacy Taichi, drop of 100 cells": ("reading.drop_height=100",),
    "legacy Taichi, both": ("reading.gravity=20", "reading.drop_height=100"),
}


@dataclass(frozen=True)
class ImpactMap:
    """The runs of a map.

    ``table``: a row for each run, with its floor, arm, pressure, IMPACT and PRESS, its state and the reason of it, and
    STATES, settled and seconds, NaN without a result.
    """

    table: pd.DataFrame

    @property
    def floors(self) -> list[str]:
        """The floors, in their order."""
        return list(self.table["floor"].unique())

    @property
    def pressures(self) -> list[float]:
        """The pressures, rising."""
        return sorted(self.table["pressure"].unique())

    def spread(self, floor: str, arm: str, column: str) -> pd.DataFrame:
        """Spread a column of numbers over (impact number, press number), both rising; mean over seeds."""
        own = self.table[(self.table["floor"] == floor) & (self.table["arm"] == arm)]
        values = own.astype({column: float}).pivot_table(index=IMPACT, columns=PRESS, values=column)
        axes = (sorted(self.table[IMPACT].unique()), sorted(self.table[PRESS].unique()))
        return values.reindex(index=axes[0], columns=axes[1])

    def spread_failures(self, floor: str, arm: str) -> pd.DataFrame:
        """Spread over the same numbers whether a run there failed."""
        marked = ImpactMap(self.table.assign(failed=has_failed(self.table).astype(float)))
        return marked.spread(floor, arm, "failed") > 0

    def bracket_half(self, floor: str, arm: str, impact: float) -> Crossing:
        """Bracket the pressure at which half of the mass is in lumps, at an impact number."""
        t = self.table
        return bracket_half_of_runs(t[(t["floor"] == floor) & (t["arm"] == arm) & (t[IMPACT] == impact)])


def tabulate_map(sweep: CollectedSweep) -> ImpactMap:
    """Tabulate the runs of a sweep as a map; what scales a run is known of those without a result too."""
    scales = pd.DataFrame([measure_scales(run.case) for run in sweep.runs], sweep.table.index)
    arms = pd.Series([run.case.arm for run in sweep.runs], sweep.table.index, name="arm")
    kept = ["floor", "pressure", "seed", "state", "reason", *STATES, "settled", "seconds", "run_id"]
    return ImpactMap(pd.concat([arms, scales[[IMPACT, PRESS]], sweep.table.reindex(columns=kept)], axis=1))


def has_failed(table: pd.DataFrame) -> pd.Series:
    """Tell the runs that were tried and gave no result from those with one, and from those that were not run."""
    return ~table["state"].isin((states.DONE, *NEVER))


def name_cause(reason: str) -> str:
    """Name the cause in the reason of a failure: without the frame, the particle and their numbers."""
    cause = reason.partition("; last good state")[0]
    cause = re.sub(r"^diverged in frame .*?: ", "diverged: ", cause)
    cause = re.sub(r"particle \d+ at \([^)]*\)", "a particle", cause)
    return re.sub(r"fell to \S+ s, with which", "fell so far that", re.sub(r"\d+% of the", "many", cause))


def tabulate_failures(table: pd.DataFrame) -> pd.DataFrame:
    """Tabulate the runs that failed by cause and arm: how many, and from which to which IMPACT and PRESS."""
    failed = table[has_failed(table)]
    causes = (failed["state"] + ": " + failed["reason"].map(name_cause)).str.removesuffix(": ")
    rows = [
        {
            "cause": cause, "arm": arm, "runs": len(own), "floors": ", ".join(own["floor"].unique()),
            **{name: _describe_range(own[name]) for name in (IMPACT, PRESS)},
        }
        for (cause, arm), own in failed.groupby([causes, failed["arm"]], sort=False)
    ]  # fmt: skip
    return pd.DataFrame(rows)


def _describe_range(values: pd.Series) -> str:
    """Describe numbers by their least and largest."""
    low, high = f"{values.min():.2g}", f"{values.max():.2g}"
    return low if low == high else f"{low} to {high}"


def share_choices(mapped: ImpactMap, choices: pd.DataFrame, name: str) -> pd.DataFrame:
    """Return which part of the choices that a pressure belongs to agree with all claims: (PLACE, pressure).

    ``choices``: of ``judge_choices`` at PLACE; ``name``: BY_LUMPS or BY_BOTH.  Of those that are known; NaN if none is.
    So the pressures are chosen anew at each impact number, in favour of the paper.
    """
    long = choices.melt([*PLACE, name], list(CHOICE), value_name="pressure")
    values = long.assign(**{name: long[name].astype("Float64").astype(float)})
    shares = values.pivot_table(index=list(PLACE), columns="pressure", values=name)
    places = pd.MultiIndex.from_product([mapped.floors, sorted(mapped.table[IMPACT].unique())], names=PLACE)
    return shares.reindex(index=places, columns=mapped.pressures)


def place_readings(figure_pressures: Sequence[float]) -> pd.DataFrame:
    """Place READINGS on the map: reading, IMPACT, PRESS, a row for each of some pressures."""
    rows = []
    for name, overrides in READINGS.items():
        case = compose(overrides).case
        scales = measure_scales(case)
        rows += [
            {"reading": name, IMPACT: scales[IMPACT], PRESS: pressure / case.material.E}
            for pressure in figure_pressures
        ]
    return pd.DataFrame(rows)


def sum_core_hours(table: pd.DataFrame) -> float:
    """Sum the wall time of the runs with a result, each on one core [h]."""
    return float(np.nansum(table["seconds"].astype(float))) / 3600.0
