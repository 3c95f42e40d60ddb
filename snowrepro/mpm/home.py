"""What the compiler takes from the environment of the process, put right before it is loaded.

Without a home folder that it can write to, Taichi ends the process.  And what its own variables say, such as TI_ARCH
(of Quadrants: QD_ARCH), would win over the configuration of a run, which alone decides what the run is computed on.
"""

import atexit
import os
import re
import shutil
import tempfile
from pathlib import Path

from ..compiler import COMPILERS, name_compiler

# Of its variables those that change nothing that is computed: what it prints, keeps, and how much memory it takes.
HARMLESS = re.compile(
    r"(LOG_LEVEL|OFFLINE_CACHE.*|NUM_COMPILE_THREADS|DEVICE_MEMORY_.*|ENABLE_(CUDA|TORCH|PADDLE|PYBUF)|VISIBLE_DEVICE"
    r"|PRINT_.*|VERBOSE.*|KERNEL_PROFILER|TIMELINE|SKIP_VERSION_CHECK|CI|IN_DOCKER|MANYLINUX2014_OK|GUI_.*)"
)
left_out: dict[str, str] = {}  # what was taken out of the environment, by name


def leave_settings_out() -> None:
    """Take out of the environment what would have the compiler compute otherwise than the configuration says."""
    start = COMPILERS[name_compiler()]
    for name in [n for n in os.environ if n.startswith(start) and not HARMLESS.fullmatch(n.removeprefix(start))]:
        left_out[name] = os.environ.pop(name)


def provide_home() -> None:
    """Set HOME, if it is not set or cannot be written to, to the user's own or else to one for this process alone."""
    if os.name != "posix" or _can_keep_a_cache(os.environ.get("HOME", "")):
        return
    os.environ.pop("HOME", None)
    own = str(Path.home())  # without HOME: by the system's list of users
    if not _can_keep_a_cache(own):
        own = tempfile.mkdtemp(prefix="snowrepro-home-")
        atexit.register(shutil.rmtree, own, ignore_errors=True)
    os.environ["HOME"] = own


def _can_keep_a_cache(home: str) -> bool:
    """Whether the compiler can keep its kernels below a home folder."""
    if not Path(home).is_absolute():
        return False
    places = (Path(home, ".cache", name_compiler()), Path(home, ".cache"), Path(home))
    existing = next((place for place in places if place.is_dir()), None)
    return existing is not None and os.access(existing, os.W_OK | os.X_OK)
