"""What stands beside a result: its files with checksums, the configuration, and what made it."""

import functools
import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import foreign
from ..foreign import Unreadable
from ..own_law import find_changes
from ..settings.case import MODEL_VERSION
from ..settings.execution import COULD_CHANGE_BITS, Execution
from ..sources import digests_of
from . import models
from .files import sha256, write_json
from .identity import is_id_of
from .provenance import environment, packages

MANIFEST = "manifest.json"
RESULT = "run.nc"
_encode = json.JSONEncoder(sort_keys=True).encode
MOST_FILES = 3  # named of those that changed


def write(folder: Path, names: list[str], content: Mapping[str, Any]) -> None:
    """Write the manifest of a folder whose files are ``names``; it is the last file to be written."""
    files = {name: _describe(folder / name) for name in names}
    made = {"code": CODE, "environment": environment(), "packages": packages()}
    body = {**content, **made, "files": files}
    write_json(folder / MANIFEST, {**body, "checksum": _checksum(body)})


def read(folder: Path) -> dict[str, Any]:
    """The manifest of a folder; empty if there is none that can be read."""
    try:
        return load(folder)
    except Unreadable:
        return {}


def load(folder: Path, name: str = MANIFEST) -> dict[str, Any]:
    """The manifest of a folder, whose own keys have the types of ``models.Manifest``; others belong to its checksum.

    Raises Unreadable where there is none, or it says what no manifest does.
    """
    path = folder / name
    foreign.refuse_links(path, folder.parent)
    try:
        content = foreign.read_json(path, models.MOST_MANIFEST)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise Unreadable(path, "is missing") from error
    models.check(path, models.Manifest, content)
    return content


def is_intact(manifest: Mapping[str, Any]) -> bool:
    """Whether a manifest says what it said when it was written."""
    return manifest.get("checksum") == _checksum({key: value for key, value in manifest.items() if key != "checksum"})


def flaw(folder: Path, manifest: Mapping[str, Any], run_id: str, thorough: bool = False) -> str | None:
    """What is wrong with a folder that should hold a run's whole result; None if it is as it was written.

    A file whose size and time are those of the manifest is taken to be the same; ``thorough`` reads it all.
    """
    if not manifest:
        return _why_unread(folder)
    if not is_intact(manifest):
        return f"{MANIFEST} is not as it was written: its checksum differs"
    if manifest.get("run_id") != run_id:
        return f"{MANIFEST} is that of {manifest.get('run_id')}"
    if is_of_this_version(manifest) and not is_id_of(run_id, manifest["config"]):
        return f"{MANIFEST} is of another run: its configuration has another id"
    if RESULT not in manifest["files"]:
        return f"{MANIFEST} has no {RESULT}"
    return _flaw_of_files(folder, manifest["files"], thorough)


def is_of_this_version(manifest: Mapping[str, Any]) -> bool:
    """Whether what a manifest says of its configuration is said in the words of this version."""
    return manifest.get("model_version") == MODEL_VERSION and bool(manifest.get("config"))


def _why_unread(folder: Path) -> str:
    """Why there is no manifest to go by."""
    try:
        load(folder)
    except Unreadable as error:
        return f"{MANIFEST} is missing or cannot be read ({error.detail})"
    return f"{MANIFEST} was missing"


def _flaw_of_files(folder: Path, files: Mapping[str, Any], thorough: bool) -> str | None:
    """What is wrong with the files of a folder; None if they are as its manifest says."""
    for name, promised in files.items():
        try:
            status = (folder / name).lstat()
        except OSError:
            return f"{name} is missing"
        if not foreign.is_plain_file(folder / name):
            return f"{name} is a link, or no regular file"
        if status.st_size != promised["bytes"]:
            return f"{name} has {status.st_size} bytes instead of {promised['bytes']}"
        is_trusted = not thorough and status.st_mtime_ns == promised["mtime_ns"]
        if not is_trusted and _sha256(folder / name) != promised["sha256"]:
            return f"{name} is not as it was written: its checksum differs"
    return None


def _sha256(path: Path) -> str:
    """Checksum of a file; empty where it cannot be read."""
    try:
        return sha256(path)
    except (OSError, Unreadable):
        return ""


def stale(manifest: Mapping[str, Any], execution: Execution) -> dict[str, str]:
    """By what a result is older than what would make it now, and what differs.

    "config", "code", "environment" or, of a law that is somebody else's, "law".
    """
    before, now = manifest.get("config") or {}, {key: getattr(execution, key) for key in COULD_CHANGE_BITS}
    kinds = {
        "config": differences({key: before.get(key) for key in COULD_CHANGE_BITS}, now),
        "code": _changed(manifest.get("code", {}), CODE),
        "environment": differences(manifest.get("environment", {}), environment()),
        "law": find_changes(before),
    }
    return {kind: ", ".join(changes) for kind, changes in kinds.items() if changes}


def differences(before: Mapping[str, Any], now: Mapping[str, Any], under: str = "") -> list[str]:
    """Each value that differs between two nested mappings, as "key before -> now"."""
    changes = []
    for key in [*before, *(key for key in now if key not in before)]:
        old, new = before.get(key), now.get(key)
        if isinstance(old, Mapping) and isinstance(new, Mapping):
            changes += differences(old, new, f"{under}{key}.")
        elif old != new:
            changes.append(f"{under}{key} {_short(old)} -> {_short(new)}")
    return changes


CODE = digests_of("simulation")  # as this process has loaded it, whatever is written meanwhile


@functools.cache
def code_digest() -> str:
    """All of the code and the environment in one word."""
    return _checksum({"code": CODE, "environment": environment()})[:16]


def _changed(before: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    """The files that differ, in a phrase; none if none does."""
    names = sorted(name for name in {*before, *now} if before.get(name) != now.get(name))
    more = f" and {len(names) - MOST_FILES} more files" if len(names) > MOST_FILES else ""
    return [f"{', '.join(names[:MOST_FILES])}{more} changed"] if names else []


def _describe(path: Path) -> dict[str, Any]:
    status = path.stat()
    return {"bytes": status.st_size, "mtime_ns": status.st_mtime_ns, "sha256": sha256(path)}


def _checksum(body: Mapping[str, Any]) -> str:
    return hashlib.sha256(_encode(body).encode()).hexdigest()


def _short(value: Any) -> str:
    text = "nothing" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
