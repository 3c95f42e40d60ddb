"""Files that are whole or absent."""

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..errors import StoreError


def require_writable(folder: str | Path) -> None:
    """Make a folder and check that files can be made in it.  Raises StoreError if not."""
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise StoreError(f"cannot write into the folder '{folder}': {error.strerror or error}") from error


def read_json(path: Path) -> dict[str, Any]:
    """What a JSON file holds; empty if it is not there or broken."""
    try:
        read = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return read if isinstance(read, dict) else {}


def write_json(path: Path, content: Any, durable: bool = True) -> None:
    """Write a JSON file, whole or not at all."""
    with published(path, durable) as partial:
        partial.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def sha256(path: Path) -> str:
    """Checksum of a file's content."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def size_of(folder: Path) -> int:
    """Bytes in all files of a folder or in one file; files that vanish meanwhile do not count."""
    total = 0
    for path in folder.rglob("*") if folder.is_dir() else [folder]:
        try:
            total += path.stat().st_size if path.is_file() else 0
        except OSError:
            continue
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
    partial = path.with_name(f"{path.name}.{os.getpid()}.part")
    with writing(path):
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            yield partial
            if durable:
                flush(partial)
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)
