"""Reports as the command writes them, and stores with numbers as wanted and hardly any snow."""

from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

from snowrepro.report.page.page import ExperimentReport, draw_experiment, write_experiment_page
from snowrepro.store.run import ARRAYS, Run
from snowrepro.summary import row as summary
from snowrepro.sweep.enumeration import Planned
from snowrepro.sweep.plan import Plan

LIKE_THE_PAPER = {340: 0.2, 530: 0.52, 3300: 0.8}
PRESSURES = f"pressure={','.join(map(str, LIKE_THE_PAPER))}"  # whatever those of an experiment are


def reported(runs: Sequence[Run], overrides: Sequence[str] = ()) -> ExperimentReport:
    """Draw an experiment and write its page; returns what was drawn."""
    planned = tuple(Planned(run, ()) for run in runs)
    part = draw_experiment(Plan(planned, True, tuple(overrides)))
    write_experiment_page(part)
    return part


def paper_like(run: Run) -> float:
    """Rising with pressure, a little different for each seed; powder without sintering."""
    return LIKE_THE_PAPER[run.case.pressure] + 0.01 * (run.case.seed % 3) if run.case.sintering.enabled else 0.0


def make_grain() -> xr.Dataset:
    """Make a result of one particle and one frame that has all arrays of a result."""
    dims = {"frame": ("frame",), "time": ("frame",), "snapshot": ("snapshot",), "mass": ("particle",)}
    dims |= dict.fromkeys(("position", "velocity"), ("snapshot", "particle", "axis"))
    sizes = {"frame": 1, "snapshot": 1, "particle": 1, "axis": 2}
    usual = ("snapshot", "particle")
    return xr.Dataset(
        {name: (dims.get(name, usual), np.zeros([sizes[dim] for dim in dims.get(name, usual)])) for name in ARRAYS}
    )


def fill(plan: Plan, lumps: Callable[[Run], float | None]) -> Plan:
    """Give each run of a plan a result with these lumps; None: no result."""
    for run in plan.runs:
        value = lumps(run)
        if value is None:
            continue
        run.save(make_grain())
        row = {"run_id": run.id, "shape": run.case.shape.name, "floor": run.case.floor.name}
        row |= {"sintering": run.case.sintering.name, "pressure": run.case.pressure, "seed": run.case.seed}
        row |= {"lump_fraction": value, "crushed_fraction": 0.0, "loose_fraction": 1.0 - value}
        row |= {"settled": True, "seconds": 1.0}
        run.save_row(summary.make_key(run.config.question.analysis), row)
    return plan
