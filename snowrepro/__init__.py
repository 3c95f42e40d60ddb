"""Experiment sweeps and reproduction of "Snow Simulation Considering Pressure Sintering"."""

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

for name in ("TAICHI", "QUADRANTS"):  # either may compile
    os.environ.setdefault(f"ENABLE_{name}_HEADER_PRINT", "0")
for name in ("TI", "QD"):
    os.environ.setdefault(f"{name}_ENABLE_PYBUF", "0")  # else it tells every notebook about its streams

if TYPE_CHECKING:
    from .composition.compose import compose
    from .evidence.collect import open_sweep, sweep_table
    from .notebook.animate import animate
    from .notebook.particles import classify, summarise
    from .notebook.plot import plot
    from .notebook.show import show
    from .notebook.sweeping import run_sweep
    from .run import simulate
    from .store.find import open_run

    __version__: str

__all__ = [
    "__version__", "animate", "classify", "compose", "open_run", "open_sweep", "plot", "run_sweep", "show", "simulate",
    "summarise", "sweep_table",
]  # fmt: skip

_HOMES = {
    "animate": ".notebook.animate",
    "classify": ".notebook.particles",
    "compose": ".composition.compose",
    "open_run": ".store.find",
    "open_sweep": ".evidence.collect",
    "plot": ".notebook.plot",
    "run_sweep": ".notebook.sweeping",
    "show": ".notebook.show",
    "simulate": ".run",
    "summarise": ".notebook.particles",
    "sweep_table": ".evidence.collect",
}


def __getattr__(name: str) -> Any:
    """Import on first use, so that ``import snowrepro`` does not start Taichi."""
    if name == "__version__":
        return import_module(".version", __name__).find_version()
    if name not in _HOMES:
        raise AttributeError(f"module 'snowrepro' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name], __name__), name)


def __dir__() -> list[str]:
    """What the package offers, whether it was used already or not."""
    return list(__all__)
