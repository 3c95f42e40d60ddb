"""Imports whose modules are imported when they are first used.

A verb has its imports at the top of its file like any other.  But to show its help, to complete a word or to refuse an
option nothing of Hydra, xarray or Taichi is needed, which take seconds.  So while a verb's file is imported, stand-ins
take the places of the modules of this package that it imports.  Without that all would work likewise, but slowly.

The standard library's LazyLoader would not do: its modules stay in sys.modules, and Taichi, which looks at the source
of kernels by ``inspect``, touches all that are there, also in the middle of an import.
"""

import gc
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any, cast

PACKAGE = __package__.partition(".")[0]
# What is wanted, and what imports nothing else.
AT_ONCE = (f"{__package__}.verbs.", f"{__package__}.arguments", f"{__package__}.candidates", f"{PACKAGE}.errors")


@contextmanager
def imports_kept() -> Iterator[None]:
    """Within it, and of what was made in it, no garbage is collected.

    What is imported is kept to the end, and Python would look through all of it several times: for 0.4 s in a run.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        gc.freeze()


class _StandIn(ModuleType):
    """Stands for a module of the same name, which is imported when something is taken out of it."""

    def __getattr__(self, name: str) -> Any:
        """What the module itself has of that name."""
        if name.startswith("__"):  # what the import system asks of every module
            raise AttributeError(name)
        if sys.modules.get(self.__name__) is self:
            raise ImportError(f"take '{name}' out of {self.__name__} when it is used: import the module")
        with imports_kept():
            return getattr(import_module(self.__name__), name)


class _Deferring:
    """Finds the modules of this package, but not packages, and loads a stand-in for each."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Where a stand-in comes from; None for what is imported as ever."""
        if not name.startswith(f"{PACKAGE}.") or name.startswith(AT_ONCE):
            return None
        spec = PathFinder.find_spec(name, path, target)
        if spec is None or spec.submodule_search_locations is not None:
            return None
        self.names.append(name)
        return ModuleSpec(name, cast("Any", self), origin=spec.origin)

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """The stand-in."""
        return _StandIn(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """Nothing: it stays empty."""


@contextmanager
def deferred_imports() -> Iterator[None]:
    """Within it, an import of a module of this package gives a stand-in; behind it, the module, to whoever asks."""
    finder = _Deferring()
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)
        for name in finder.names:
            package, _, module = name.rpartition(".")
            sys.modules.pop(name, None)
            vars(sys.modules[package]).pop(module, None)
