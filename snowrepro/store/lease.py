"""Who works on a run: a lease that one process holds, renews, and loses when it dies.

A lease is a file ``lease.N`` in the run's work folder; the highest N counts.  Who finds it dead or given back
makes the file N + 1, which only one can.  Numbers only rise, so no lock is needed, and two never take over at once.
"""

import json
import os
import re
import socket
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import psutil

from ..errors import StoreError
from .files import read_json, write_json, writing

BEAT_SECONDS = 10.0
EXPIRY_SECONDS = 120.0  # a holder on another host that was silent for so long is dead
WAIT_SECONDS = 0.5
_NAME = re.compile(r"lease\.(\d+)")
_GIVEN_BACK = {"given_back": True}


@dataclass(frozen=True)
class Holder:
    """The process that holds a lease.  ``place``: what process numbers are unique in."""

    host: str
    place: str
    pid: int

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host}"


def here() -> Holder:
    """The process that asks."""
    return Holder(socket.gethostname(), _place(), os.getpid())


def _place() -> str:
    """Host, its boot, and the container: two containers may share a host's name and count processes each from 1."""
    parts = [socket.gethostname()]
    with suppress(OSError):
        parts.append(Path("/proc/sys/kernel/random/boot_id").read_text().strip())
        parts.append(str(Path("/proc/self/ns/pid").readlink()))
    return " ".join(parts)


class Lease:
    """A lease that this process holds; ``lost`` once another process took it over."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.generation = int(path.name.split(".")[1])
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._beat, daemon=True, name="lease")
        self._thread.start()

    @property
    def lost(self) -> bool:
        """Whether the file is gone or a later one is there."""
        return _newest(self.path.parent) != self.generation

    def release(self) -> None:
        """Give the lease back."""
        self._stop.set()
        self._thread.join()
        if not self.lost:
            with suppress(StoreError):  # a full disk: the next will find this process dead
                write_json(self.path, _GIVEN_BACK, durable=False)

    def _beat(self) -> None:
        while not self._stop.wait(BEAT_SECONDS):
            with suppress(OSError):
                os.utime(self.path)


def take(folder: Path) -> Lease | None:
    """Take the lease of a work folder, which is made if need be; None if somebody alive holds it.

    Raises StoreError where the folder cannot be written to.
    """
    newest = _newest(folder)
    if newest and holder(folder) is not None:
        return None
    path = folder / f"lease.{newest + 1}"
    with writing(path):
        folder.mkdir(parents=True, exist_ok=True)
        try:
            with path.open("x", encoding="utf-8") as file:
                json.dump(vars(here()), file)
        except FileExistsError:
            return None
        except OSError:
            path.unlink(missing_ok=True)
            raise
    if _newest(folder) != newest + 1:  # others came and went since the look at who holds it
        path.unlink(missing_ok=True)
        return None
    (folder / f"lease.{newest}").unlink(missing_ok=True)
    return Lease(path)


def holder(folder: Path) -> Holder | None:
    """Who holds the lease of a work folder; None if nobody does, or whoever did is dead."""
    newest = _newest(folder)
    path = folder / f"lease.{newest}"
    try:
        silent = _now(folder) - path.stat().st_mtime if newest else 0.0
    except OSError:
        return None
    if not newest or silent > EXPIRY_SECONDS:
        return None
    read = read_json(path)
    if read == _GIVEN_BACK:
        return None
    if not read:  # just being written
        return Holder("unknown", "", 0)
    holding = Holder(**read)
    return None if holding.place == _place() and not _lives(holding.pid) else holding


def _lives(pid: int) -> bool:
    """Whether a process of this place does; one that ended and was not missed yet does not."""
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False
    except psutil.Error:  # another user's
        return True


def dead_holder(folder: Path) -> Holder | None:
    """Who died with the lease and did not give it back; None if nobody did."""
    newest = _newest(folder)
    read = read_json(folder / f"lease.{newest}") if newest and holder(folder) is None else _GIVEN_BACK
    return Holder(**read) if read and read != _GIVEN_BACK else None


@contextmanager
def hold_lease(folder: Path) -> Iterator[Lease]:
    """Hold the lease of a work folder, waiting for whoever has it."""
    lease = take(folder)
    while lease is None:
        time.sleep(WAIT_SECONDS)
        lease = take(folder)
    try:
        yield lease
    finally:
        lease.release()


def _newest(folder: Path) -> int:
    """The highest number of a lease in the folder; 0 if there is none."""
    try:
        matches = [_NAME.fullmatch(path.name) for path in folder.iterdir()]
    except OSError:
        return 0
    return max((int(match[1]) for match in matches if match), default=0)


def _now(folder: Path) -> float:
    """The time by the clock that stamps the folder's files: that of another host, on a shared file system."""
    try:
        with tempfile.NamedTemporaryFile(dir=folder, prefix=".now-") as file:
            return os.fstat(file.fileno()).st_mtime
    except OSError:  # may only be read
        return time.time()
