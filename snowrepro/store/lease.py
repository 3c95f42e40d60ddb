"""Who works on a run: a lease that one process holds, renews, and loses when it dies.

A lease is a file ``lease.N`` in the run's work folder; the highest N counts.  Who finds it dead or given back
makes the file N + 1, which only one can.  Numbers only rise, so no lock is needed, and two never take over at once.

On the holder's own host its process says whether it lives, however long it was silent: while Taichi compiles, no thread
gets to renew a lease.  Elsewhere only silence can say it, and clocks jump: so whoever takes over has watched the lease
for a while, by a clock of its own, and seen no sign of life.
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

from .. import foreign
from ..errors import LeaseLost, StoreError
from ..foreign import Unreadable
from . import models
from .files import write_json, writing

BEAT_SECONDS = 10.0
EXPIRY_SECONDS = 600.0  # a holder on another host that was silent for so long is dead
WATCHED_SECONDS = 60.0  # and was watched for so long without a sign of life
WAIT_SECONDS = 0.5
_NAME = re.compile(r"lease\.([0-9]+)")
_GIVEN_BACK = {"given_back": True}


@dataclass(frozen=True)
class Holder:
    """The process that holds a lease.

    ``place``: what process numbers are unique in; ``born``: when the process began, as numbers are given again.
    """

    host: str
    place: str
    pid: int
    born: str = ""

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host}"


def here() -> Holder:
    """The process that asks."""
    return Holder(socket.gethostname(), _place(), os.getpid(), _read_birth(os.getpid()))


def _read_birth(pid: int) -> str:
    """Read when a process of this place began, by a clock that does not jump; empty where the system does not say."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()[19]
    except (OSError, IndexError):
        return ""


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

    def require_held(self) -> None:
        """Raises LeaseLost once another process took the lease over."""
        if self.lost:
            raise LeaseLost(f"another process took over {self.path.parent.name}")

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


class LeaseWatch:
    """What one process has seen of the lease of another host: since when nothing of it has changed."""

    def __init__(self) -> None:
        self._seen: tuple[str, int] | None = None
        self._since = 0.0

    def has_been_still(self, path: Path) -> bool:
        """Look at a lease; whether it has been as it is for ``WATCHED_SECONDS``, by the clock of this process."""
        try:
            seen = (path.name, path.stat().st_mtime_ns)
        except OSError:
            return False
        if seen != self._seen:
            self._seen, self._since = seen, time.monotonic()
        return time.monotonic() - self._since >= WATCHED_SECONDS


def take(folder: Path, watch: LeaseWatch | None = None) -> Lease | None:
    """Take the lease of a work folder, which is made if need be; None if somebody alive holds it, or may do so.

    ``watch``: kept from one try to the next; without it nothing is taken from another host.  Raises StoreError where
    the folder cannot be written to.
    """
    newest = _newest(folder)
    if newest and (holder(folder) is not None or not _is_certain(folder / f"lease.{newest}", watch)):
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
    holding = _look(path) if newest else None
    if holding is None:
        return None
    if holding.place == _place():
        return holding if _lives(holding) else None
    try:
        silent = _now(folder) - path.stat().st_mtime
    except OSError:
        return None
    return holding if abs(silent) <= EXPIRY_SECONDS else None  # one from the future: a clock has jumped


def _is_certain(path: Path, watch: LeaseWatch | None) -> bool:
    """Whether a lease that seems to be nobody's is: it was given back, its process is gone, or it was watched."""
    holding = _look(path)
    needs_no_watch = holding is None or holding.place == _place()
    return needs_no_watch or (watch is not None and watch.has_been_still(path))


def _look(path: Path) -> Holder | None:
    """Who has a lease, as it says; None if it was given back, is gone, or says nothing that can be read."""
    for _ in range(2):  # it may have been written between the two looks
        try:
            return _read(path)
        except Unreadable:
            if not _is_written(path):
                return Holder("unknown", "", 0)
    return None


def _read(path: Path) -> Holder | None:
    """Who a lease says that it belongs to; None if it was given back, or is gone.  Raises Unreadable."""
    try:
        content = foreign.read_json(path, models.MOST_LEASE)
    except FileNotFoundError:
        return None
    if content.get("given_back") is True:
        return None
    lease = models.check(path, models.Lease, content)
    return Holder(lease.host, lease.place, lease.pid, lease.born)


def _is_written(path: Path) -> bool:
    """Whether a lease that says nothing is not just being written, but something else."""
    try:
        return not foreign.is_plain_file(path) or path.stat().st_size > 0
    except OSError:
        return True


def _lives(holder: Holder) -> bool:
    """Whether a process of this place does; one that ended and was not missed yet does not."""
    born = _read_birth(holder.pid)
    if born and holder.born and born != holder.born:  # another process, with the number that it had
        return False
    try:
        return psutil.Process(holder.pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False
    except psutil.Error:  # another user's
        return True


def dead_holder(folder: Path) -> Holder | None:
    """Who died with the lease and did not give it back; None if nobody did."""
    newest = _newest(folder)
    try:
        return _read(folder / f"lease.{newest}") if newest and holder(folder) is None else None
    except Unreadable:
        return None


@contextmanager
def hold_lease(folder: Path) -> Iterator[Lease]:
    """Hold the lease of a work folder, waiting for whoever has it."""
    watch = LeaseWatch()
    lease = take(folder, watch)
    while lease is None:
        time.sleep(WAIT_SECONDS)
        lease = take(folder, watch)
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
