"""What Taichi takes from the environment of the process, put right before it is loaded.

Without a home folder that it can write to, it ends the process.  And what its own variables say, such as TI_ARCH,
would win over the configuration of a run, which alone decides what the run is computed on.
"""

import atexit
import os
import re
import shutil
import tempfile
from pathlib import Path

# Of Taichi's variables those that change nothing that is computed: what it prints, keeps, and how much memory it takes.
HARMLESS = re.compile(
    r"TI_(LOG_LEVEL|OFFLINE_CACHE.*|NUM_COMPILE_THREADS|DEVICE_MEMORY_.*|ENABLE_(CUDA|TORCH|PADDLE|PYBUF)|VISIBLE_DEVICE"
    r"|PRINT_.*|VERBOSE.*|KERNEL_PROFILER|TIMELINE|SKIP_VERSION_CHECK|CI|IN_DOCKER|MANYLINUX2014_OK|GUI_.*)"
)
left_out: dict[str, str] = {}  # what was taken out of the environment, by name


def leave_settings_out() -> None:
    """Take out of the environment what would have Taichi compute otherwise than the configuration says."""
    for name in [name for name in os.environ if name.startswith("TI_") and not HARMLESS.fullmatch(name)]:
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
    """Whether Taichi can keep its compiled kernels below a home folder."""
    if not Path(home).is_absolute():
        return False
    places = (Path(home, ".cache", "taichi"), Path(home, ".cache"), Path(home))
    existing = next((place for place in places if place.is_dir()), None)
    return existing is not None and os.access(existing, os.W_OK | os.X_OK)
