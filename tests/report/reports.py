"""Reports as the command writes them, and stores with numbers as wanted and no snow."""

from collections.abc import Callable

import xarray as xr

from snowrepro.analysis import summary
from snowrepro.config import Config
from snowrepro.report.page import Part, draw, write_page_of
from snowrepro.store import runs
from snowrepro.sweep.plan import Plan

LIKE_THE_PAPER = {340: 0.2, 530: 0.52, 3300: 0.8}


def reported(configs, overrides=()) -> Part:
    """Draw an experiment and write its page; returns what was drawn."""
    part = draw(configs, overrides)
    write_page_of(part)
    return part


def paper_like(config: Config) -> float:
    """Rising with pressure, a little different for each seed; powder without sintering."""
    return LIKE_THE_PAPER[config.pressure] + 0.01 * (config.seed % 3) if config.sintering.enabled else 0.0


def fill(plan: Plan, lumps: Callable[[Config], float | None]) -> Plan:
    """Give each run of a plan a result with these lumps; None: no result."""
    for config in plan.configs:
        value = lumps(config)
        if value is None:
            continue
        runs.save(xr.Dataset(), config)
        row = {"run_id": runs.identify(config), "shape": config.shape.name, "floor": config.floor.name}
        row |= {"sintering": config.sintering.name, "pressure": config.pressure, "seed": config.seed}
        row |= {"lump_fraction": value, "settled": True, "seconds": 1.0}
        runs.save_summary(config, summary._key(config.analysis), row)
    return plan
