"""One process that computes the cases of many others side by side, and what these others see of it.

A process that makes a run asks for frames as ``solver.frames`` gives them, and gets the same bits.  Those that ask
within PATIENCE of each other, and that the solver is compiled alike for, are one batch; who comes later waits for the
next.  Particles and forces go through memory that all share, a frame of each case at a time: a case goes on when its
process says so.
"""

import contextlib
import mmap
import os
import queue
import selectors
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from multiprocessing import AuthenticationError
from multiprocessing.connection import Client, Connection, Listener
from multiprocessing.reduction import recv_handle, send_handle
from typing import Any, BinaryIO

import numpy as np

from ..compiler import keep_kernels
from ..errors import RunsFailed, SnowreproError
from ..scene.build import Scene
from ..settings.case import Case
from .batch import Batch, Follower, Values, kind_of
from .device import note_elsewhere, read_device
from .frame import Frame
from .state import list_quantities

PATIENCE = 5.0  # seconds without a new case before a batch begins that is not full
STARTING = 120.0  # seconds that it may take until it is there
REFUSING = 5.0  # seconds that one which is starting may refuse to be asked; longer only one that has ended
GO_ON, WHOLE = "go on", "whole"  # what a process asks for behind a frame


@dataclass(frozen=True)
class Address:
    """Where the service is found: the path of its socket, and the key that it is asked with."""

    path: str
    key: bytes


def frames(
    address: Address, case: Case, scene: Scene, resume: Mapping[str, np.ndarray] | None = None
) -> Iterator[Frame]:
    """Yield the frames of a case as ``solver.frames`` does.  Raises what that does; RunsFailed if the service ends."""
    try:
        yield from _follow(address, case, scene, resume)
    except (EOFError, ConnectionError) as error:
        raise RunsFailed("the process that computes the batch ended") from error


def _follow(address: Address, case: Case, scene: Scene, resume: Mapping[str, np.ndarray] | None) -> Iterator[Frame]:
    """Yield the frames of a case.  Raises what the service says; EOFError or ConnectionError where it is gone."""
    with _connect(address) as connection:
        connection.send((case, scene, resume and _select_state(case, resume)))
        force, size, computes_on, cases = _receive(connection)
        note_elsewhere(computes_on, cases)
        with os.fdopen(recv_handle(connection), "r+b", buffering=0) as memory:
            table = _map_table(memory, size)
        follower = Follower(case, scene, table, force, partial(_ask_whole, connection))
        while True:
            frame = follower.take(_receive(connection))
            if not (resume and frame.number == int(resume["frame"])):  # that one is known
                yield frame
            if frame.number == case.frames:
                return
            follower.press()
            connection.send(GO_ON)


def _select_state(case: Case, resume: Mapping[str, np.ndarray]) -> Values:
    """Of a checkpoint what the service needs.  Raises KeyError or ValueError where it is none of this case."""
    count = len(resume["mass"])
    state = {
        quantity.name: np.reshape(resume[quantity.name], (count, *quantity.shape)) for quantity in list_quantities(case)
    }
    return {**state, "frame": resume["frame"], "top_speed2": resume["top_speed2"]}


def _ask_whole(connection: Connection) -> Values:
    """Ask the service for all quantities of the case, which waits there."""
    connection.send(WHOLE)
    return _receive(connection)


def _connect(address: Address) -> Connection:
    """Connect to the service, which may have started at the same time.  Raises RunsFailed or ConnectionError."""
    began = time.monotonic()
    while True:
        try:
            return Client(address.path, authkey=address.key)
        except FileNotFoundError as error:
            if time.monotonic() > began + STARTING:
                late = f"the process that computes the batch has not started within {STARTING:g} s"
                raise RunsFailed(late) from error
        except ConnectionRefusedError:
            if time.monotonic() > began + STARTING + REFUSING:
                raise
            began = min(began, time.monotonic() - STARTING)
        time.sleep(0.05)


def _receive(connection: Connection) -> Any:
    """What the service answers.  Raises what it sends as the reason of a failure."""
    answer = connection.recv()
    if isinstance(answer, Exception):
        raise answer
    return answer


@dataclass
class _Client:
    """A process that asks for the frames of a case."""

    connection: Connection
    case: Case
    scene: Scene
    resume: Mapping[str, np.ndarray] | None
    kind: Any = None


class _WaitingRoom:
    """Where processes come in, and wait for a batch."""

    def __init__(self, listener: Listener) -> None:
        self.arrivals: queue.SimpleQueue[_Client] = queue.SimpleQueue()
        self.waiting: list[_Client] = []
        threading.Thread(target=self._admit, args=(listener,), daemon=True).start()

    def _admit(self, listener: Listener) -> None:
        """Let in who asks, for as long as this process lives."""
        gone_or_strange = (OSError, EOFError, AuthenticationError)
        while True:
            with contextlib.suppress(*gone_or_strange):
                connection = listener.accept()
                client = _Client(connection, *connection.recv())
                try:
                    client.kind = kind_of(client.case)
                except Exception as error:  # of a law that is somebody else's
                    _send(connection, RunsFailed(f"its laws cannot be made: {error}"))
                    continue
                self.arrivals.put(client)

    def gather(self, most: int) -> list[_Client]:
        """Wait until nobody new has come for a while; return those that the solver is compiled alike for."""
        if not self.waiting:
            self.waiting.append(self.arrivals.get())
        with contextlib.suppress(queue.Empty):
            while len(self.waiting) < most:
                self.waiting.append(self.arrivals.get(timeout=PATIENCE))
        first, *others = self.waiting
        alike = [first, *(client for client in others if client.kind == first.kind)]
        self.waiting = [*(client for client in others if client.kind != first.kind), *alike[most:]]
        return alike[:most]


def serve(address: Address, threads: int, most: int) -> None:
    """Compute batches of at most ``most`` cases for who asks, until this process is ended."""
    room = _WaitingRoom(Listener(address.path, family="AF_UNIX", backlog=most, authkey=address.key))
    while True:
        group = room.gather(most)
        try:
            _serve_batch(group, threads)
        except Exception as error:
            reason = error if isinstance(error, SnowreproError) else RunsFailed(f"the batch failed: {error}")
            for client in group:
                _send(client.connection, reason)
            if not isinstance(error, SnowreproError):
                raise  # the device may be in no state to go on
        finally:
            for client in group:
                client.connection.close()
            keep_kernels()  # nothing else does so for a process that is ended


def _serve_batch(group: list[_Client], threads: int) -> None:
    """Compute a batch, each case for as long as its process wants it."""
    with _open_memory() as memory:
        cases, scenes, resumes = zip(*((a.case, a.scene, a.resume) for a in group), strict=True)
        batch = Batch(cases, scenes, resumes, threads, partial(_map_table, memory))
        for i, client in enumerate(group):
            force = batch.place_block(batch.force, i)
            _send(client.connection, (force, batch.table.size, read_device(), len(group)))
            with contextlib.suppress(OSError):
                send_handle(client.connection, memory.fileno(), None)
    reports = batch.start()
    with selectors.DefaultSelector() as selector:
        for i, client in enumerate(group):
            selector.register(client.connection, selectors.EVENT_READ, i)
        while selector.get_map():
            batch.launch()  # and meanwhile
            for i, report in reports.items():
                _send(group[i].connection, report)
            chosen = _answer_clients(selector, batch, must_wait=not batch.is_under_way())
            reports = batch.collect()
            batch.begin(chosen)


def _open_memory() -> BinaryIO:
    """Open memory without a name, which is gone when no process has it any more; where there is none, such a file."""
    if hasattr(os, "memfd_create"):
        return os.fdopen(os.memfd_create("snowrepro"), "r+b", buffering=0)
    return tempfile.TemporaryFile(buffering=0)


def _map_table(memory: BinaryIO, size: int) -> np.ndarray:
    """So many numbers in memory that other processes see too."""
    length = size * np.dtype(float).itemsize
    memory.truncate(length)
    return np.frombuffer(mmap.mmap(memory.fileno(), length))


def _answer_clients(selector: selectors.BaseSelector, batch: Batch, must_wait: bool) -> list[int]:
    """Answer what processes ask for; return the cases that are to go on.

    One that is gone is listened to no more.
    """
    chosen = []
    for key, _ in selector.select(None if must_wait else 0):
        connection: Any = key.fileobj
        try:
            wish = connection.recv()
        except (EOFError, OSError):
            selector.unregister(connection)
            continue
        if wish == WHOLE:
            _send(connection, batch.read_case(key.data))
        else:
            chosen.append(key.data)
    return chosen


def _send(connection: Connection, message: Any) -> None:
    """Send a message to a process that may be gone."""
    with contextlib.suppress(OSError):
        connection.send(message)
