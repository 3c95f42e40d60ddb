"""A home folder for Taichi, which ends the process where it finds none, or none that it can write to."""

import atexit
import os
import shutil
import tempfile
from pathlib import Path


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
