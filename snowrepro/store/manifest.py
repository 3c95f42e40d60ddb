"""What stands beside a result: its files with checksums, the configuration, and what made it."""

import functools
import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..settings.execution import COULD_CHANGE_BITS, Execution
from ..sources import digests_of
from .files import read_json, sha256, write_json
from .provenance import environment, packages

MANIFEST = "manifest.json"
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
    return read_json(folder / MANIFEST)


def is_intact(manifest: Mapping[str, Any]) -> bool:
    """Whether a manifest says what it said when it was written."""
    return manifest.get("checksum") == _checksum({key: value for key, value in manifest.items() if key != "checksum"})


def flaw(folder: Path, manifest: Mapping[str, Any], run_id: str, thorough: bool = False) -> str | None:
    """What is wrong with a folder that should hold a run's whole result; None if it is as it was written.

    A file whose size and time are those of the manifest is taken to be the same; ``thorough`` reads it all.
    """
    if not manifest:
        return f"{MANIFEST} is missing or cannot be read"
    if not is_intact(manifest):
        return f"{MANIFEST} is not as it was written: its checksum differs"
    if manifest.get("run_id") != run_id:
        return f"{MANIFEST} is that of {manifest.get('run_id')}"
    for name, promised in manifest["files"].items():
        try:
            status = (folder / name).stat()
        except OSError:
            return f"{name} is missing"
        if status.st_size != promised["bytes"]:
            return f"{name} has {status.st_size} bytes instead of {promised['bytes']}"
        unread = not thorough and status.st_mtime_ns == promised["mtime_ns"]
        if not unread and sha256(folder / name) != promised["sha256"]:
            return f"{name} is not as it was written: its checksum differs"
    return None


def stale(manifest: Mapping[str, Any], execution: Execution) -> dict[str, str]:
    """By what a result is older than what would make it now: "config", "code" or "environment", and what differs."""
    before, now = manifest.get("config", {}), {key: getattr(execution, key) for key in COULD_CHANGE_BITS}
    kinds = {
        "config": differences({key: before.get(key) for key in COULD_CHANGE_BITS}, now),
        "code": _changed(manifest.get("code", {}), CODE),
        "environment": differences(manifest.get("environment", {}), environment()),
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
