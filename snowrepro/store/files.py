"""Files that are whole or absent."""

import hashlib
import json
import os
import shutil
import stat
import tempfile
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from .. import foreign
from ..errors import StoreError
from ..foreign import MIB, Unreadable, open_plain

MOST_JSON = 64 * MIB


def require_writable(folder: str | Path) -> None:
    """Make a folder and check that files can be made in it.  Raises StoreError if not."""
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise StoreError(f"cannot write into the folder '{folder}': {error.strerror or error}") from error


def require_no_links(folder: Path) -> None:
    """Check that a folder that is written into is no link, and has none in it.  Raises StoreError that names it."""
    inside = (Path(place, name) for place, folders, names in os.walk(folder) for name in (*folders, *names))
    for path in (folder, *inside):
        if path.is_symlink():
            raise StoreError(f"{path} is a link, through which nothing is written: remove it")


def read_json(path: Path) -> dict[str, Any]:
    """What a JSON file holds; empty if it is not there or broken.  What a store holds is read by ``models``."""
    try:
        return foreign.read_json(path, MOST_JSON)
    except (OSError, Unreadable):
        return {}


def write_json(path: Path, content: Any, durable: bool = True) -> None:
    """Write a JSON file, whole or not at all."""
    with published(path, durable) as partial:
        partial.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def sha256(path: Path) -> str:
    """Checksum of a regular file's content.  Raises Unreadable if it is none; FileNotFoundError."""
    digest = hashlib.sha256()
    with open_plain(path) as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def size_of(folder: Path) -> int:
    """Bytes in all files of a folder or in one file; neither what links lead to counts, nor files that vanish."""
    is_folder = folder.is_dir() and not folder.is_symlink()
    inside = (Path(place, name) for place, _, names in os.walk(folder) for name in names)
    total = 0
    for path in inside if is_folder else [folder]:
        with suppress(OSError):
            status = path.lstat()
            total += status.st_size if stat.S_ISREG(status.st_mode) else 0
    return total


def flush(path: Path) -> None:
    """Have a file, or a folder's list of names, on the disk before going on."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turns what goes wrong in the block into a StoreError that names ``path`` and the room on its disk."""
    try:
        yield
    except (OSError, RuntimeError) as error:  # netCDF4 raises RuntimeError on a full disk
        home = next((parent for parent in path.parents if parent.exists()), Path())
        free = shutil.disk_usage(home).free
        reason = f"{getattr(error, 'strerror', None) or error} ({free / 1e6:.0f} MB free on its disk)"
        raise StoreError(f"cannot write {path}: {reason}") from error


@contextmanager
def published(path: Path, durable: bool = True) -> Iterator[Path]:
    """A scratch file that becomes ``path`` in one rename if the block ends well, and vanishes if not."""
    partial = path.with_name(f"{path.name}.{uuid.uuid4().hex[:12]}.part")  # that nobody can have put there
    with writing(path):
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            yield partial
            if durable:
                flush(partial)
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)
