"""Experiment sweeps and reproduction of "Snow Simulation Considering Pressure Sintering"."""

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")

if TYPE_CHECKING:
    from .composition.compose import compose
    from .evidence.collect import open_sweep, sweep_table
    from .run import simulate
    from .store.run import open_run
    from .summary.classify import classify
    from .summary.row import summarise

__all__ = ["classify", "compose", "open_run", "open_sweep", "simulate", "summarise", "sweep_table"]

_HOMES = {
    "classify": ".summary.classify",
    "compose": ".composition.compose",
    "open_run": ".store.run",
    "open_sweep": ".evidence.collect",
    "simulate": ".run",
    "summarise": ".summary.row",
    "sweep_table": ".evidence.collect",
}


def __getattr__(name: str) -> Any:
    """Import on first use, so that ``import snowrepro`` does not start Taichi."""
    if name not in _HOMES:
        raise AttributeError(f"module 'snowrepro' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name], __name__), name)
