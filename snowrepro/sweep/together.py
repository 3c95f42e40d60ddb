"""The process that computes the runs of a sweep side by side: for as long as the sweep's other processes want it."""

import contextlib
import secrets
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ..mpm.service import Address, serve
from .processes import end_processes, start_process, usable_cores
from .scratch import make_scratch_folder


@contextlib.contextmanager
def start_service(threads: int, most: int) -> Iterator[Address]:
    """Start the process, and end it behind the block; yields where it is found.

    ``threads`` that it computes on, 0 for all cores; ``most``: cases side by side.
    """
    with tempfile.TemporaryDirectory(dir=make_scratch_folder()) as folder:
        address = Address(str(Path(folder) / "service"), secrets.token_bytes(32))
        process = start_process(serve, address, threads or usable_cores(), most)
        try:
            yield address
        finally:
            end_processes([process])
