"""Short-lived files of a process: near the root, as the paths of sockets are short, and gone after a kill too."""

import fcntl
import functools
import os
import shutil
import tempfile
from contextlib import suppress
from multiprocessing import forkserver, util
from pathlib import Path

PREFIX = "snowrepro-sweep-"
LOCK = "lock"
LONGEST = 60  # letters of the folder that it lies in; a socket's whole path has at most 107
USUAL = ("/tmp", "/var/tmp", "/dev/shm")  # noqa: S108 (folders in them are made for this user alone)


@functools.cache
def make_scratch_folder() -> Path:
    """Make a folder for this process alone, which goes at its end; remove those that killed processes left.

    A process holds a lock in its folder, which ends with it however it ends.
    """
    parent = _choose_parent()
    for left in parent.glob(f"{PREFIX}*"):
        _remove_if_left(left)
    folder = Path(tempfile.mkdtemp(prefix=PREFIX, dir=parent))
    unnamed = folder / f"{LOCK}.new"
    lock = unnamed.open("w")
    fcntl.flock(lock, fcntl.LOCK_EX)
    unnamed.rename(folder / LOCK)  # others see it only when it is held
    # Behind multiprocessing's own tidying up, which has files in it; and in no process that was forked from this one.
    util.Finalize(None, _remove, args=(folder, lock), exitpriority=-200)
    return folder


def start_server() -> None:
    """Start the server that processes are forked from, its socket in the scratch folder."""
    before = tempfile.tempdir
    tempfile.tempdir = str(make_scratch_folder())
    try:
        util.get_temp_dir()  # chosen once a process
    finally:
        tempfile.tempdir = before
    forkserver.ensure_running()


def _choose_parent() -> Path:
    """The usual folder for temporary files, or another one if its path is too long."""
    usual = tempfile.gettempdir()
    places = [usual, *USUAL] if len(usual) <= LONGEST else [*USUAL, usual]
    return Path(next(place for place in places if os.access(place, os.W_OK | os.X_OK) or place == usual))


def _remove(folder: Path, _lock: object) -> None:
    """Remove a folder; its lock is held until then."""
    shutil.rmtree(folder, ignore_errors=True)


def _remove_if_left(folder: Path) -> None:
    """Remove a folder of this user whose process is gone."""
    with suppress(OSError):
        if folder.is_symlink() or folder.stat().st_uid != os.getuid():
            return
        with (folder / LOCK).open("r+") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(folder, ignore_errors=True)
