"""Experiment sweeps and reproduction of "Snow Simulation Considering Pressure Sintering"."""

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")

if TYPE_CHECKING:
    from .analysis.classify import classify
    from .analysis.summary import summarise
    from .composition import compose
    from .simulation import simulate
    from .store.runs import open_run
    from .sweep.collect import open_sweep, sweep_table

__all__ = ["classify", "compose", "open_run", "open_sweep", "simulate", "summarise", "sweep_table"]

_HOMES = {
    "classify": ".analysis.classify",
    "compose": ".composition",
    "open_run": ".store.runs",
    "open_sweep": ".sweep.collect",
    "simulate": ".simulation",
    "summarise": ".analysis.summary",
    "sweep_table": ".sweep.collect",
}


def __getattr__(name: str) -> Any:
    """Import on first use, so that ``import snowrepro`` does not start Taichi."""
    if name not in _HOMES:
        raise AttributeError(f"module 'snowrepro' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name], __name__), name)
