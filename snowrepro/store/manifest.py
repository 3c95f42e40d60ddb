"""What stands beside a result: its files with checksums, the configuration, and what made it."""

import functools
import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..config import Config
from .files import read_json, sha256, write_json
from .provenance import environment, packages

MANIFEST = "manifest.json"
_encode = json.JSONEncoder(sort_keys=True).encode
# What turns a configuration into numbers, from the package's folder.
SOURCES = ("config.py", "simulation.py", "units.py", "mpm/*.py", "physics/*.py", "scene/*.py")
MOST_FILES = 3  # named of those that changed
# Settings that do not make another run, and still could change its bits if a promise were broken.
WAYS = ("threads", "deterministic")


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
            found = os.stat(folder / name)
        except OSError:
            return f"{name} is missing"
        if found.st_size != promised["bytes"]:
            return f"{name} has {found.st_size} bytes instead of {promised['bytes']}"
        unread = not thorough and found.st_mtime_ns == promised["mtime_ns"]
        if not unread and sha256(folder / name) != promised["sha256"]:
            return f"{name} is not as it was written: its checksum differs"
    return None


def stale(manifest: Mapping[str, Any], config: Config) -> dict[str, str]:
    """By what a result is older than what would make it now: "config", "code" or "environment", and what differs."""
    before, ways = manifest.get("config", {}), {key: getattr(config, key) for key in WAYS}
    kinds = {
        "config": differences({key: before.get(key) for key in WAYS}, ways),
        "code": _changed(manifest.get("code", {}), CODE),
        "environment": differences(manifest.get("environment", {}), environment()),
    }
    return {kind: ", ".join(found) for kind, found in kinds.items() if found}


def differences(before: Mapping[str, Any], now: Mapping[str, Any], under: str = "") -> list[str]:
    """Each value that differs between two nested mappings, as "key before -> now"."""
    found = []
    for key in [*before, *(key for key in now if key not in before)]:
        old, new = before.get(key), now.get(key)
        if isinstance(old, Mapping) and isinstance(new, Mapping):
            found += differences(old, new, f"{under}{key}.")
        elif old != new:
            found.append(f"{under}{key} {_short(old)} -> {_short(new)}")
    return found


def _read_code() -> dict[str, str]:
    """Each source file that a result depends on, and a digest of its text."""
    package = Path(__file__).resolve().parents[1]
    paths = sorted(path for pattern in SOURCES for path in package.glob(pattern))
    return {path.relative_to(package).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()[:16] for path in paths}


CODE = _read_code()  # as this process has loaded it, whatever is written meanwhile


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
    found = path.stat()
    return {"bytes": found.st_size, "mtime_ns": found.st_mtime_ns, "sha256": sha256(path)}


def _checksum(body: Mapping[str, Any]) -> str:
    return hashlib.sha256(_encode(body).encode()).hexdigest()


def _short(value: Any) -> str:
    text = "nothing" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
