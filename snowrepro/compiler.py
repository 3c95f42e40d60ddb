"""The compiler of the kernels: Taichi, or Quadrants, its maintained fork, which gives the same bits.

What is compiled has ``from ..compiler import ti``, which loads the compiler; nothing else here does.  Kernels are
decorated as their modules are imported, so a process has one compiler from its start to its end.
"""

import functools
import inspect
import os
import sys
from collections.abc import Mapping
from importlib import import_module
from importlib.util import find_spec
from typing import Any, TypeVar

from .errors import ConfigError, NoSolver

COMPILERS = {"taichi": "TI_", "quadrants": "QD_"}  # package: how its variables in the environment begin
IMPORTING = "<frozen importlib._bootstrap>"  # what Python calls the file of its import system
VARIABLE = "SNOWREPRO_COMPILER"  # names one, where both are installed

Made = TypeVar("Made")


@functools.cache
def name_compiler() -> str:
    """The package that compiles in this process: that which VARIABLE names, else the first of COMPILERS that is there.

    Where none is, the first.  Raises ConfigError where VARIABLE names what is no compiler, or is not installed.
    """
    asked = os.environ.get(VARIABLE)
    if not asked:
        return next(filter(find_spec, COMPILERS), next(iter(COMPILERS)))
    if asked not in COMPILERS:
        raise ConfigError(f"{VARIABLE}={asked}: there is no such compiler; there are: {', '.join(COMPILERS)}")
    if not find_spec(asked):
        raise ConfigError(f"{VARIABLE}={asked}: it is not installed: pip install {asked}")
    return asked


def is_asked_for() -> bool:
    """Whether the environment names the compiler."""
    return bool(os.environ.get(VARIABLE))


def is_of_another(function: Any) -> bool:
    """Whether a function of a law was made for a compiler by another one than that of this process."""
    return any(hasattr(function, f"_is_{name}_function") for name in COMPILERS if name != name_compiler())


def as_template(made: type[Made]) -> type[Made]:
    """Have a frozen dataclass be one that functions of kernels take: Quadrants takes what has fields apart.

    It keeps how it is made, compared and hashed; ``dataclasses.replace`` and ``asdict`` do not know it any more.
    """
    del made.__dataclass_fields__  # type: ignore[attr-defined]
    return made


def __getattr__(name: str) -> Any:
    """Load the compiler, as ``ti``, when it is first asked for.  Raises NoSolver where none is installed."""
    if name != "ti":
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    asking = inspect.currentframe()
    if asking and asking.f_back:
        _spare_searches(asking.f_back.f_globals)
    try:
        return import_module(name_compiler())
    except ModuleNotFoundError as error:
        if error.name not in COMPILERS:
            raise
        raise NoSolver from error


def keep_kernels() -> None:
    """Have the compiler, if it is loaded, keep the kernels that it made for other processes; its fields are gone then.

    By itself it does so when Python takes all objects apart at the end of a process, which those of ours do not wait
    for: the next one would compile for seconds what this one has.
    """
    for name in COMPILERS:
        if loaded := sys.modules.get(name):  # None where somebody forbids it
            loaded.reset()


def _spare_searches(module: Mapping[str, Any]) -> None:
    """Tell ``inspect`` which files are of this module, and that the file of the import system is of none.

    The compiler asks it for one of the two with each function that it decorates.  What it was not told it looks for in
    all modules that are loaded: beside those of a run that takes a millisecond, and a start decorates 250 functions.
    """
    inspect.modulesbyfile[IMPORTING] = ""
    if "__file__" in module:  # a notebook has none
        inspect.modulesbyfile[module["__file__"]] = module["__name__"]
