"""Tier 3: the numbers of the paper's figures over seeds, beside those of the reference.

Paired first.  A seed gives the same particles, so its run differs from the reference's run by rounding alone, as long
as nothing changed; what rounding does is known from twins, the same runs with fixed-point sums.  The statistic is the
largest mean difference over seeds, of any measure in any cell (sintering, pressure), in units of what rounding does to
a run there, or of LEAST of the measure's spread over seeds where that is more.  Its critical value is resampled: seeds
of the twins are drawn with replacement, all cells and measures of a seed together, for the means and again for the
unit; LEVEL of the draws stay below it.  It is one unit at least.

Beyond it the result has changed.  A second statistic then says whether by more than other seeds would: the largest
difference of the means, in units of the spread over seeds, beside the critical value that draws of the reference's own
seeds give.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ..config import Config
from ..store import states
from ..store.runs import identify
from ..sweep import record, todo
from ..sweep.collect import collect
from ..sweep.estimate import estimate
from ..sweep.launch import launch
from ..sweep.plan import Plan, make_plan
from .baseline import by_name
from .finding import FAILED, NOT_MEASURED, OK, REGRESSED, Finding

EXPERIMENTS = ("fig5", "fig6")
FIDELITY = "preview"
SEEDS = 6  # of the reference, and of a full check
FEW_SEEDS = 3  # of a check
MEASURES = (
    "lump_fraction", "largest_fragment", "broken_bonds", "fragments", "lumps_by_damage", "flattening_end",
    "impact_speed", "density_at_release", "young_at_release", "hardening_at_release",
)  # fmt: skip
CELL = ["sintering", "pressure"]
KEYS = ["experiment", *CELL, "seed", "summation"]
LEVEL = 0.99
RESAMPLES = 2000
RNG_SEED = 7
LEAST = 0.1  # of the spread over seeds: a mean may differ by so much, however little rounding does
TINY = 1e-30
ROUND_OFF = 1e-9  # of a number's size, where seeds make no difference
SHIFT = 0.05  # of the mass in lumps, that the power is told for


@dataclass(frozen=True)
class Test:
    """A statistic beside its critical value, and where it is largest."""

    value: float
    critical: float
    where: str

    @property
    def is_beyond(self) -> bool:
        """Whether the statistic is larger than chance would make it."""
        return not self.value <= self.critical


def overrides(
    experiment: str, store: str, seeds: int, twins: bool = False, fidelity: str = FIDELITY, workers: int = 0
) -> list[str]:
    """What asks for an experiment's runs, for those of the twins too if they are wanted; ``workers`` 0: all cores."""
    return [
        f"experiment={experiment}",
        f"fidelity={fidelity}",
        f"seed={','.join(map(str, range(seeds)))}",
        *(["solver.summation=in_order,fixed_point"] if twins else []),
        *([f"hydra.launcher.workers={workers}"] if workers else []),
        record.store_override(store),
        "rerun=[code,environment]",
    ]


def run(wanted: Sequence[str]) -> Plan:
    """Run what this code has not yet run; what failed the plan's states tell."""
    plan = make_plan(wanted, multirun=True)
    decided = todo.decide(plan)
    if decided.to_run:
        chosen = [decision.planned for decision in decided.to_run]
        launch(plan, chosen, estimate((planned.config for planned in chosen), plan.configs[0].store).memory_mb)
    return plan


def lost(configs: Sequence[Config]) -> list[str]:
    """The runs without a result, and why."""
    found = zip(configs, states.standings(configs), strict=True)
    return [f"{identify(c)}: {s.state}: {s.reason}" for c, s in found if s.state != states.DONE]


def table(experiment: str, plan: Plan) -> pd.DataFrame:
    """The measures of a plan's runs: columns KEYS and MEASURES."""
    found = collect(plan).table
    if "solver_summation" not in found:
        found = found.assign(solver_summation=plan.configs[0].solver.summation)
    found = found.rename(columns={"solver_summation": "summation"}).assign(experiment=experiment)
    return found[[*KEYS, *MEASURES]].sort_values(KEYS, ignore_index=True)


def compare(experiment: str, found: pd.DataFrame, reference: pd.DataFrame) -> Finding:
    """The runs of an experiment beside the reference."""
    name = f"{experiment}, {FIDELITY}"
    own = reference[reference["experiment"] == experiment]
    seeds = sorted(set(found["seed"]))
    if own.empty or not set(seeds) <= set(own["seed"]):
        return Finding(3, name, NOT_MEASURED, "the reference does not have these runs")
    ours, twins = (cube(own[own["summation"] == kind]) for kind in ("in_order", "fixed_point"))
    now = cube(found)
    if list(now.columns) != list(ours.columns):
        return Finding(3, name, NOT_MEASURED, "the reference has other cells or measures than these runs")
    if now.isna().to_numpy().any():
        return Finding(3, name, FAILED, "a measure of a run is not a number")
    rounding = paired(now, ours, twins)
    other = unpaired(now, ours)
    largest = float(np.abs(now - ours.loc[seeds]).to_numpy().max())
    told = f"{rounding.value:.2g} of what rounding may do, {rounding.where}"
    measured = "every number is the same" if largest == 0.0 else told
    margin, power = _margin(ours, twins, rounding.critical, len(seeds))
    note = f"{len(seeds)} seeds; {margin}; {power}"
    if rounding.is_beyond:
        than = f"{'more' if other.is_beyond else 'no more'} than other seeds would do"
        note = f"{than} ({other.value:.2g}, critical {other.critical:.2g}, {other.where}); {note}"
    return Finding(3, name, REGRESSED if rounding.is_beyond else OK, measured, f"{rounding.critical:.2g}", note)


def cube(rows: pd.DataFrame) -> pd.DataFrame:
    """Seeds by (measure, sintering, pressure)."""
    return rows.pivot(index="seed", columns=CELL, values=list(MEASURES)).astype(float).sort_index(axis=1)


def paired(now: pd.DataFrame, ours: pd.DataFrame, twins: pd.DataFrame) -> Test:
    """The largest mean difference seed by seed, beside what rounding does."""
    away = (np.abs((now - ours.loc[now.index]).mean()) / rounding_scale(ours, twins)).fillna(np.inf)
    return Test(float(away.max()), max(1.0, _critical(ours, twins, len(now))), _where(away))


def unpaired(now: pd.DataFrame, ours: pd.DataFrame) -> Test:
    """The largest difference of the means, beside what other seeds do."""
    away = (np.abs(now.mean() - ours.mean()) / _seed_scale(ours.to_numpy(), ours.columns)).fillna(np.inf)
    rng = np.random.default_rng(RNG_SEED)
    others, own = (ours.to_numpy()[rng.integers(len(ours), size=(RESAMPLES, n))] for n in (len(now), len(ours)))
    units = _seed_scale(own, ours.columns)
    largest = (np.abs(others.mean(axis=1) - own.mean(axis=1)) / units).max(axis=1)
    return Test(float(away.max()), float(np.quantile(largest, LEVEL)), _where(away))


def rounding_scale(ours: pd.DataFrame, twins: pd.DataFrame) -> pd.Series:
    """What rounding does to a run in each cell, but at least LEAST of what seeds do to its measure."""
    rounding = np.sqrt(((twins - ours) ** 2).mean())
    return np.maximum(rounding, LEAST * _seed_scale(ours.to_numpy(), ours.columns))


def _seed_scale(values: np.ndarray, columns: pd.MultiIndex) -> np.ndarray:
    """Spread of ``values`` (..., seeds, columns) over seeds, mean over the cells of each measure.

    Where seeds make no difference it is what is round-off in such a number.
    """
    measures = columns.get_level_values(0).to_numpy()
    alike = measures[:, None] == measures
    over_cells = alike / alike.sum(axis=0)
    spread = np.sqrt(values.var(axis=-2, ddof=1) @ over_cells)
    return np.maximum(spread, ROUND_OFF * (np.abs(values).mean(axis=-2) @ over_cells) + TINY)


def _critical(ours: pd.DataFrame, twins: pd.DataFrame, count: int) -> float:
    """What the largest mean of ``count`` seeds stays below at LEVEL, where the unit is known as badly as here."""
    differences = (twins - ours).to_numpy()
    rng = np.random.default_rng(RNG_SEED)
    of_means, of_units = (rng.integers(len(ours), size=(RESAMPLES, n)) for n in (count, len(ours)))
    least = LEAST * _seed_scale(ours.to_numpy()[of_units], ours.columns)
    units = np.maximum(np.sqrt((differences[of_units] ** 2).mean(axis=1)), least)
    largest = np.abs(differences[of_means].mean(axis=1) / units).max(axis=1)
    return float(np.quantile(largest, LEVEL))


def _margin(ours: pd.DataFrame, twins: pd.DataFrame, critical: float, count: int) -> tuple[str, str]:
    """How small a shift of the mass in lumps is noticed, and how surely one of SHIFT in one cell is."""
    scale = rounding_scale(ours, twins)["lump_fraction"]
    least = critical * scale
    standard = ((twins - ours)["lump_fraction"] / scale).to_numpy()
    drawn = standard[np.random.default_rng(RNG_SEED + 1).integers(len(ours), size=(RESAMPLES, count))].mean(axis=1)
    noticed = (np.abs(drawn + SHIFT / scale.to_numpy()) > critical).mean()
    span = f"{least.min():.2g}" + (f" to {least.max():.2g}, by cell" if least.max() > 1.01 * least.min() else "")
    return (
        f"margin: a shift of the mass in lumps by {span}",
        f"power: {noticed:.0%} for one of {SHIFT:g} in one cell",
    )


def _where(away: pd.Series) -> str:
    measure, sintering, pressure = away.idxmax()
    return f"{measure} at {pressure:g}, {sintering}"


def changes(before: pd.DataFrame, after: pd.DataFrame) -> list[str]:
    """What a new reference changes, in words."""
    return [
        f"{name}: {_change(old, new)}" if len(old) else f"{name}: {len(new)} runs, new"
        for name, old, new in by_name("experiment", before, after)
    ]


def _change(old: pd.DataFrame, new: pd.DataFrame) -> str:
    """The mass in lumps in each cell, before and now."""
    before, now = (part.groupby(CELL)["lump_fraction"].mean() for part in (old, new))
    told = [", ".join(f"{value:.3f}" for value in means) for means in (before, now)]
    return f"mass in lumps {told[0]} -> {told[1]} (largest change {(now - before).abs().max():.2g})"
