"""Reading what somebody else may have made.

A store, a manifest, a record or a crate can come from anywhere, so what is in it is data: a file is read only if it is
a regular file of a bounded size, no link below the store is followed, and JSON is read without any of its surprises.
What is not read so is said by ``Unreadable``, which names the file.  Which keys and types a file may have, say the
models of ``store.models``.
"""

import json
import os
import re
import stat
from pathlib import Path
from typing import Any, BinaryIO

from .errors import StoreError

KIB, MIB = 1 << 10, 1 << 20
MOST_BRACKETS = 2_000_000  # lists and dictionaries of a file: some hundred bytes of memory each
MOST_DEPTH = 50
MOST_TAIL = 64 * KIB
# One part of a path, as every system takes it: no separators, no control characters, nothing hidden.
PLAIN_NAME = r"^\w[\w .,=+~()@-]*$"
_PLAIN = re.compile(PLAIN_NAME)
MOST_LETTERS = 250
LINK = "is a link, and links in a store are not followed"


class Unreadable(StoreError):
    """A file or folder that is not read, with the reason.  ``reason``: without its path; ``detail``: the bare cause."""

    def __init__(self, path: str | Path, reason: str) -> None:
        super().__init__(f"{path} {reason}")
        self.reason = reason
        self.detail = reason.removeprefix("cannot be read: ")


def is_plain_name(name: str) -> bool:
    """Whether a name is one part of a path, of letters that every file system takes."""
    return len(name.encode("utf-8", "replace")) <= MOST_LETTERS and bool(_PLAIN.match(name)) and name[-1:] not in " .\n"


def refuse_links(path: Path, store: Path) -> None:
    """Check that no part of a path below its store is a link.  Raises Unreadable that names the one that is."""
    place = store
    for part in path.relative_to(store).parts:
        place = place / part
        if place.is_symlink():
            raise Unreadable(place, LINK)


def is_own_folder(path: Path, store: Path) -> bool:
    """Whether a path below a store is a folder, reached without any link."""
    try:
        refuse_links(path, store)
    except Unreadable:
        return False
    return path.is_dir()


def list_own(folder: Path, store: Path) -> list[os.DirEntry]:
    """List what is in a folder of a store, by name; nothing where the folder is not there, or is reached by a link."""
    try:
        refuse_links(folder, store)
        with os.scandir(folder) as entries:
            return sorted(entries, key=lambda entry: entry.name)
    except (OSError, Unreadable):
        return []


def open_plain(path: Path, most: int | None = None) -> BinaryIO:
    """Open a regular file for reading; a link, a folder, a pipe or a device is none.

    ``most``: bytes that it may have.  Raises Unreadable with the reason; FileNotFoundError where nothing is there.
    """
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError:
        raise
    except (OSError, ValueError) as error:
        is_link = isinstance(error, OSError) and path.is_symlink()
        raise Unreadable(path, LINK if is_link else f"cannot be read: {_reason(error)}") from error
    status = os.fstat(handle)
    if not stat.S_ISREG(status.st_mode):
        os.close(handle)
        raise Unreadable(path, "is no regular file")
    if most is not None and status.st_size > most:
        os.close(handle)
        raise Unreadable(path, f"has {status.st_size:,} bytes, and may have {most:,}")
    return os.fdopen(handle, "rb")


def is_plain_file(path: Path) -> bool:
    """Whether a path is a regular file, and no link to one."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except (OSError, ValueError):
        return False


def read_plain(path: Path, most: int) -> bytes:
    """Read a regular file of at most so many bytes.  Raises Unreadable; FileNotFoundError where nothing is there."""
    with open_plain(path, most) as file:
        try:
            content = file.read(most + 1)
        except OSError as error:
            raise Unreadable(path, f"cannot be read: {_reason(error)}") from error
    if len(content) > most:
        raise Unreadable(path, f"has more than {most:,} bytes")
    return content


def read_tail(path: Path, lines: int) -> list[str]:
    """Read the last lines of a text file, whatever letters it has.  Raises Unreadable."""
    with open_plain(path) as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - MOST_TAIL))
        text = file.read(MOST_TAIL).decode("utf-8", "replace")
    return text.splitlines()[-lines:]


def copy_plain(source: Path, target: Path) -> None:
    """Copy a regular file's content into a new file.  Raises Unreadable."""
    with open_plain(source) as file, target.open("xb") as copy:
        while block := file.read(MIB):
            copy.write(block)


def read_json(path: Path, most: int) -> dict[str, Any]:
    """Read a dictionary from a JSON file.  Raises Unreadable; FileNotFoundError where nothing is there."""
    try:
        return parse_json(read_plain(path, most))
    except ValueError as error:
        raise Unreadable(path, f"cannot be read: {error}") from error


def parse_json(content: bytes | str) -> dict[str, Any]:
    """Read a dictionary from JSON.  Raises ValueError with the reason, also for valid JSON that is no data of ours."""
    try:
        text = content.decode("utf-8") if isinstance(content, bytes) else content
        if text.count("[") + text.count("{") > MOST_BRACKETS:
            raise ValueError("it has too many lists")
        read = json.loads(text, object_pairs_hook=_pair_once)
    except UnicodeDecodeError as error:
        raise ValueError(f"it is no text in UTF-8 (byte {error.start})") from error
    except json.JSONDecodeError as error:
        raise ValueError(f"it is no JSON ({error.msg} in line {error.lineno})") from error
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error
    if not isinstance(read, dict):
        raise ValueError(f"it holds no dictionary but {_article(read)}")  # noqa: TRY004 - as all else that is wrong
    if _is_deep(read):
        raise ValueError("it is nested too deeply")
    return read


def _pair_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Make a dictionary of pairs.  Raises ValueError where a key is there twice."""
    made = dict(pairs)
    if len(made) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"it has the key '{twice}' twice")
    return made


def _is_deep(value: Any) -> bool:
    """Whether lists and dictionaries are in one another deeper than in any file of ours."""
    inner = [value]
    for _ in range(MOST_DEPTH):
        values = (each.values() if isinstance(each, dict) else each for each in inner)
        inner = [each for several in values for each in several if isinstance(each, dict | list)]
        if not inner:
            return False
    return True


def _article(value: Any) -> str:
    """What kind of value JSON holds, in words."""
    kinds = {list: "a list", str: "a text", bool: "a yes or no", type(None): "nothing"}
    return kinds.get(type(value), "a number")


def _reason(error: Exception) -> str:
    """Why the system did not give a file."""
    return getattr(error, "strerror", None) or str(error)
