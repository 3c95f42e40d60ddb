"""Tier 3: the numbers of the paper's figures over seeds, compared with those of the reference.

First seed by seed.  A seed gives the same particles, so as long as nothing changed its run differs from the
reference's run by rounding alone; what rounding does is known from twins, the same runs with fixed-point sums.  The
statistic is the largest mean difference over seeds, of any measure in any cell (sintering, pressure), in units of what
rounding does to a run there, or of LEAST of the measure's spread over seeds where that is more.  Its critical value is
resampled: seeds of the twins are drawn with replacement, all cells and measures of a seed together, for the means and
again for the unit; LEVEL of the draws stay below it.  It is at least one unit.

Beyond it the result has changed.  A second statistic then says whether it changed by more than other seeds would
change it: the largest difference of the means, in units of the spread over seeds; its critical value is drawn from the
reference's own seeds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ..composition.overrides import override_folder
from ..evidence.collect import collect_sweep
from ..store import states
from ..store.run import Run
from ..sweep import todo
from ..sweep.estimate import estimate
from ..sweep.launch import launch
from ..sweep.plan import Plan, make_plan
from .baseline import group_by_name
from .finding import FAILED, NOT_MEASURED, OK, REGRESSED, Finding

FIDELITY = "preview"
SEEDS = 6  # of the reference, and of a full check
FEW_SEEDS = 3  # of a check
MEASURES = (
    "lump_fraction", "crushed_fraction", "loose_fraction", "largest_fragment", "broken_bonds", "fragments",
    "lumps_by_damage", "flattening_end", "impact_speed",
    "density_at_release", "young_at_release", "hardening_at_release",
)  # fmt: skip
CELL = ["sintering", "pressure"]
KEYS = ["experiment", *CELL, "seed", "summation"]
LEVEL = 0.99
RESAMPLES = 2000
RNG_SEED = 7
LEAST = 0.1  # of the spread over seeds: a mean may differ by so much, however little rounding does
TINY = 1e-30
ROUND_OFF = 1e-9  # of a number's size, where seeds make no difference
SHIFT = 0.05  # of the mass in lumps, for which the power is computed


@dataclass(frozen=True)
class Statistic:
    """A statistic with its critical value, and the place where it is largest."""

    value: float
    critical: float
    where: str

    @property
    def is_beyond(self) -> bool:
        """Whether the statistic exceeds its critical value; NaN does."""
        return not self.value <= self.critical


def make_overrides(
    experiment: str, store: str, seeds: int, twins: bool = False, fidelity: str = FIDELITY, workers: int = 0
) -> list[str]:
    """Make the overrides for the runs of an experiment, with ``twins`` also for theirs; ``workers`` 0: all cores."""
    return [
        f"experiment={experiment}",
        f"fidelity={fidelity}",
        f"seed={','.join(map(str, range(seeds)))}",
        *(["solver.summation=in_order,fixed_point"] if twins else []),
        *([f"hydra.launcher.workers={workers}"] if workers else []),
        override_folder("store", str(store)),
        "rerun=[code,environment]",
    ]


def run_missing(overrides: Sequence[str]) -> Plan:
    """Run what this code has not run yet, and return the plan; failed runs are seen by their states."""
    plan = make_plan(overrides, multirun=True)
    decisions = todo.decide(plan)
    if decisions.to_run:
        planned_runs = [decision.planned for decision in decisions.to_run]
        needs = estimate((planned.run.case for planned in planned_runs), plan.runs[0].store)
        launch(plan, planned_runs, needs.memory_mb)
    return plan


def list_failures(runs: Sequence[Run]) -> list[str]:
    """List the runs without a result, each with its state and reason."""
    standings = zip(runs, states.standings(runs), strict=True)
    return [f"{run.id}: {now.state}: {now.reason}" for run, now in standings if now.state != states.DONE]


def tabulate_runs(experiment: str, plan: Plan) -> pd.DataFrame:
    """Tabulate the measures of a plan's runs: columns KEYS and MEASURES."""
    table = collect_sweep(plan).table
    if "solver_summation" not in table:
        table = table.assign(solver_summation=plan.runs[0].case.solver.summation)
    table = table.rename(columns={"solver_summation": "summation"}).assign(experiment=experiment)
    return table[[*KEYS, *MEASURES]].sort_values(KEYS, ignore_index=True)


def compare_with_reference(experiment: str, table: pd.DataFrame, reference: pd.DataFrame) -> Finding:
    """Compare the runs of an experiment with the reference: both tables as ``tabulate_runs`` makes them."""
    name = f"{experiment}, {FIDELITY}"
    reference_runs = reference[reference["experiment"] == experiment]
    seeds = sorted(set(table["seed"]))
    if reference_runs.empty or not set(seeds) <= set(reference_runs["seed"]):
        return Finding(3, name, NOT_MEASURED, "the reference does not have these runs")
    references, twins = (
        pivot_measures(reference_runs[reference_runs["summation"] == kind]) for kind in ("in_order", "fixed_point")
    )
    now = pivot_measures(table)
    if list(now.columns) != list(references.columns):
        return Finding(3, name, NOT_MEASURED, "the reference has other cells or measures than these runs")
    if now.isna().to_numpy().any():
        return Finding(3, name, FAILED, "a measure of a run is not a number")
    rounding = compare_paired(now, references, twins)
    other = compare_unpaired(now, references)
    largest = float(np.abs(now - references.loc[seeds]).to_numpy().max())
    distance = f"{rounding.value:.2g} of what rounding may do, {rounding.where}"
    measured = "every number is the same" if largest == 0.0 else distance
    margin, power = _describe_margin(references, twins, rounding.critical, len(seeds))
    note = f"{len(seeds)} seeds; {margin}; {power}"
    if rounding.is_beyond:
        comparison = f"{'more' if other.is_beyond else 'no more'} than other seeds would do"
        note = f"{comparison} ({other.value:.2g}, critical {other.critical:.2g}, {other.where}); {note}"
    return Finding(3, name, REGRESSED if rounding.is_beyond else OK, measured, f"{rounding.critical:.2g}", note)


def pivot_measures(rows: pd.DataFrame) -> pd.DataFrame:
    """Pivot rows of runs into seeds by (measure, sintering, pressure)."""
    # pivot_table would average two runs of one seed and cell; pivot refuses them
    cells = rows.pivot(index="seed", columns=CELL, values=list(MEASURES))  # noqa: PD010
    return cells.astype(float).sort_index(axis=1)


def compare_paired(now: pd.DataFrame, references: pd.DataFrame, twins: pd.DataFrame) -> Statistic:
    """Find the largest mean difference seed by seed, in units of what rounding does."""
    distances = (np.abs((now - references.loc[now.index]).mean()) / measure_rounding(references, twins)).fillna(np.inf)
    critical = max(1.0, _draw_critical_value(references, twins, len(now)))
    return Statistic(float(distances.max()), critical, _describe_place(distances))


def compare_unpaired(now: pd.DataFrame, references: pd.DataFrame) -> Statistic:
    """Find the largest difference of the means, in units of the spread over seeds."""
    spread = _measure_spread(references.to_numpy(), references.columns)
    distances = (np.abs(now.mean() - references.mean()) / spread).fillna(np.inf)
    rng = np.random.default_rng(RNG_SEED)
    drawn_others, drawn_references = (
        references.to_numpy()[rng.integers(len(references), size=(RESAMPLES, n))] for n in (len(now), len(references))
    )
    units = _measure_spread(drawn_references, references.columns)
    largest = (np.abs(drawn_others.mean(axis=1) - drawn_references.mean(axis=1)) / units).max(axis=1)
    return Statistic(float(distances.max()), float(np.quantile(largest, LEVEL)), _describe_place(distances))


def measure_rounding(references: pd.DataFrame, twins: pd.DataFrame) -> pd.Series:
    """Measure what rounding does to a run in each cell, at least LEAST of what seeds do to its measure."""
    rounding = np.sqrt(((twins - references) ** 2).mean())
    return np.maximum(rounding, LEAST * _measure_spread(references.to_numpy(), references.columns))


def _measure_spread(values: np.ndarray, columns: pd.MultiIndex) -> np.ndarray:
    """Measure the spread of ``values`` (..., seeds, columns) over seeds, mean over the cells of each measure.

    Where seeds make no difference, it is the round-off of such a number.
    """
    measures = columns.get_level_values(0).to_numpy()
    alike = measures[:, None] == measures
    over_cells = alike / alike.sum(axis=0)
    spread = np.sqrt(values.var(axis=-2, ddof=1) @ over_cells)
    return np.maximum(spread, ROUND_OFF * (np.abs(values).mean(axis=-2) @ over_cells) + TINY)


def _draw_critical_value(references: pd.DataFrame, twins: pd.DataFrame, count: int) -> float:
    """Draw the critical value that the largest mean of ``count`` seeds stays below at LEVEL.

    The unit is drawn too, as it is known from few seeds alone.
    """
    differences = (twins - references).to_numpy()
    rng = np.random.default_rng(RNG_SEED)
    of_means, of_units = (rng.integers(len(references), size=(RESAMPLES, n)) for n in (count, len(references)))
    least = LEAST * _measure_spread(references.to_numpy()[of_units], references.columns)
    units = np.maximum(np.sqrt((differences[of_units] ** 2).mean(axis=1)), least)
    largest = np.abs(differences[of_means].mean(axis=1) / units).max(axis=1)
    return float(np.quantile(largest, LEVEL))


def _describe_margin(references: pd.DataFrame, twins: pd.DataFrame, critical: float, count: int) -> tuple[str, str]:
    """Describe the smallest shift of the mass in lumps that is noticed, and the power for one of SHIFT in one cell."""
    scale = measure_rounding(references, twins)["lump_fraction"]
    least = critical * scale
    standard = ((twins - references)["lump_fraction"] / scale).to_numpy()
    drawn_seeds = np.random.default_rng(RNG_SEED + 1).integers(len(references), size=(RESAMPLES, count))
    means = standard[drawn_seeds].mean(axis=1)
    power = (np.abs(means + SHIFT / scale.to_numpy()) > critical).mean()
    span = f"{least.min():.2g}" + (f" to {least.max():.2g}, by cell" if least.max() > 1.01 * least.min() else "")
    return (
        f"margin: a shift of the mass in lumps by {span}",
        f"power: {power:.0%} for one of {SHIFT:g} in one cell",
    )


def _describe_place(distances: pd.Series) -> str:
    """Describe the measure and cell with the largest distance."""
    measure, sintering, pressure = distances.idxmax()
    return f"{measure} at {pressure:g}, {sintering}"


def describe_changes(before: pd.DataFrame, after: pd.DataFrame) -> list[str]:
    """Describe what a new reference changes, a line for each experiment."""
    return [
        f"{name}: {_describe_change(old, new)}" if len(old) else f"{name}: {len(new)} runs, new"
        for name, old, new in group_by_name("experiment", before, after)
    ]


def _describe_change(old: pd.DataFrame, new: pd.DataFrame) -> str:
    """Describe the mass in lumps in each cell, before and now."""
    before, now = (part.groupby(CELL)["lump_fraction"].mean() for part in (old, new))
    texts = [", ".join(f"{value:.3f}" for value in means) for means in (before, now)]
    return f"mass in lumps {texts[0]} -> {texts[1]} (largest change {(now - before).abs().max():.2g})"
