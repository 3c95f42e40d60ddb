"""What Taichi really computes on, as it says itself."""

from contextvars import ContextVar

import taichi as ti

from ..errors import ConfigError

_elsewhere = ContextVar("_elsewhere", default="")  # what another process computes on for this one


def note_elsewhere(device: str) -> None:
    """Take note of what another process computes on for this one, as its ``read_device`` says."""
    _elsewhere.set(device)


def read_device() -> str:
    """The architecture that Taichi has started on, such as x64, arm64 or cuda; empty before it has started."""
    program = ti.lang.impl.get_runtime().prog
    return _elsewhere.get() or (str(program.config().arch.name) if program else "")


def require_device(device: str) -> None:
    """Check that Taichi computes on the device that ``solver.device`` asks for: cpu or cuda.  Raises ConfigError."""
    asked = (ti.cuda if device == "cuda" else ti.cpu).name
    if read_device() != asked:
        raise ConfigError(
            f"solver.device={device} asks for {asked}, and Taichi computes on {read_device() or 'nothing'}: "
            "look for what else in this process or its environment starts Taichi"
        )
