"""What the compiler really computes on, as it says itself."""

from contextvars import ContextVar

from ..compiler import name_compiler, ti
from ..errors import ConfigError
from .taichi_private import find_program

# What another process computes on for this one, and how many cases it computes side by side.
_elsewhere: ContextVar[tuple[str, int]] = ContextVar("_elsewhere", default=("", 1))


def note_elsewhere(device: str, cases: int) -> None:
    """Take note of what another process computes on for this one, as its ``read_device`` says, and for how many."""
    _elsewhere.set((device, cases))


def count_sharers() -> int:
    """How many cases are computed side by side with that of this process, itself included."""
    return _elsewhere.get()[1]


def read_device() -> str:
    """The architecture that the compiler has started on, such as x64, arm64 or cuda; empty before it has started."""
    program = find_program()
    return _elsewhere.get()[0] or (str(program.config().arch.name) if program else "")


def require_device(device: str) -> None:
    """Check that the compiler computes on what ``solver.device`` asks for: cpu or cuda.  Raises ConfigError."""
    asked = (ti.cuda if device == "cuda" else ti.cpu).name
    if read_device() != asked:
        raise ConfigError(
            f"solver.device={device} asks for {asked}, and {name_compiler()} computes on {read_device() or 'nothing'}: "
            "look for what else in this process or its environment starts it"
        )
