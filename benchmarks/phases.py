"""A whole command line in this process, and where its processor time goes, phase by phase.

    python benchmarks/phases.py FILE run fidelity=preview

The seconds go to FILE, as JSON.  What a function does is its own phase; what it calls that has a phase is not counted
twice.
"""

import builtins
import functools
import importlib
import json
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

COMPILERS = ("taichi", "quadrants")
PYTHON, IMPORTS, COMPILER, REST = "Python itself", "imports", "import of the compiler", "all else"
COMPOSITION, START, KERNELS = "composition and validation", "start of the compiler", "scene, kernels, first frame"
FRAMES, WRITING, MEASURING, END = "all other frames", "result written", "result measured", "end of the process"
PHASES = (
    PYTHON, IMPORTS, COMPILER, COMPOSITION, START, KERNELS, FRAMES, WRITING, MEASURING, REST, END,
)  # fmt: skip
FIRST_FRAME = "first frame"  # a moment, not a phase
FUNCTIONS = {  # module and function, or class and function: phase
    ("snowrepro.composition.compose", "compose_raw"): COMPOSITION,
    ("snowrepro.composition.compose", "validate"): COMPOSITION,
    ("snowrepro.simulation", "simulate_case"): KERNELS,
    ("snowrepro.mpm.solver", "start_taichi"): START,
    ("snowrepro.store.run", "Run.save"): WRITING,
    ("snowrepro.summary.row", "read_row"): MEASURING,
}


class Clock:
    """Counts the processor time of each phase [s]; the last of ``under_way`` is the one that it goes to."""

    def __init__(self) -> None:
        self.spent: Counter[str] = Counter({PYTHON: time.process_time()})
        self.counted = time.process_time()
        self.under_way = [REST]
        self.pending = dict(FUNCTIONS)
        self.first_frame = float("nan")

    def count(self) -> None:
        """Give the time since the last call to the phase that is under way."""
        now = time.process_time()
        self.spent[self.under_way[-1]] += now - self.counted
        self.counted = now

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Within it, time goes to this phase."""
        self.count()
        self.under_way.append(name)
        try:
            yield
        finally:
            self.count()
            self.under_way.pop()

    def watch_imports(self) -> None:
        """Count imports from now on; and put a clock on each function of FUNCTIONS before anyone takes it."""
        builtins.__import__ = self._time_import(builtins.__import__)
        importlib.import_module = self._time_import(importlib.import_module)

    def _time_import(self, load: Callable[..., Any]) -> Callable[..., Any]:
        """The function that imports, with a clock on it."""

        @functools.wraps(load)
        def load_timed(name: str, *args: Any, **named: Any) -> Any:
            """Import."""
            before = len(sys.modules)
            phase = COMPILER if name in COMPILERS or self.under_way[-1] == COMPILER else IMPORTS
            if name in sys.modules or phase == self.under_way[-1]:  # most are: a clock would take longer than they do
                module = load(name, *args, **named)
            else:
                with self.phase(phase):
                    module = load(name, *args, **named)
            if len(sys.modules) != before:
                self._put_on_functions()
            return module

        return load_timed

    def _put_on_functions(self) -> None:
        """Put a clock on those functions whose modules are there by now."""
        for (module, name), phase in list(self.pending.items()):
            *owners, last = name.split(".")
            owner: Any = sys.modules.get(module)
            for each in owners:
                owner = vars(owner).get(each) if owner else None
            if owner and last in vars(owner):  # not by getattr, which asks what stands for a module that is not there
                setattr(owner, last, self._time(vars(owner)[last], phase))
                del self.pending[module, name]

    def _time(self, function: Callable[..., Any], phase: str) -> Callable[..., Any]:
        """A function with a clock on it."""

        @functools.wraps(function)
        def timed(*args: Any, **named: Any) -> Any:
            """Call it."""
            if phase == KERNELS:
                case, on_frame, *others = args
                args = (case, self._note_first(on_frame), *others)
            with self.phase(phase):
                return function(*args, **named)

        return timed

    def _note_first(self, on_frame: Callable[[Any], None]) -> Callable[[Any], None]:
        """What is called after each frame, with a note of the first that was computed: frame 1."""

        def note(progress: Any) -> None:
            """Call it."""
            on_frame(progress)
            if progress.frame == 1:
                self.count()
                self.first_frame = time.process_time()
                self.under_way[-1] = FRAMES

        return note


def main() -> None:
    """Do what the command line says, and write down what took how long."""
    clock = Clock()
    path, *words = sys.argv[1:]
    clock.watch_imports()
    sys.argv = ["snowrepro", *words]
    try:
        from snowrepro.cli import main as execute

        execute()
    finally:
        clock.count()
        assert not clock.pending, clock.pending
        Path(path).write_text(json.dumps({**clock.spent, FIRST_FRAME: clock.first_frame}), encoding="utf-8")


if __name__ == "__main__":
    main()
