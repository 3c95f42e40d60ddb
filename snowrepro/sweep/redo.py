"""A run done again from what its manifest says, and whether that came to the same bits."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..composition import config_from
from ..config import Config
from ..errors import ConfigError, StoreError
from ..store import manifest, runs
from ..store.bits import digests
from ..store.files import read_json, sha256
from .differences import (
    ArrayChange,
    NumberChange,
    array_line,
    compare_runs,
    listed,
    made_otherwise,
    number_line,
    pairs,
)
from .explain import id_of_run

KINDS = ("config", "code", "environment")  # whatever changed since a run was redone, it is redone anew


@dataclass(frozen=True)
class Original:
    """A run as the manifest at ``path`` tells of it; its result may be beside."""

    path: Path
    said: Mapping[str, Any]


@dataclass(frozen=True)
class Redone:
    """How a redone run differs from the original.

    ``made``: in code and environment, "key before -> now"; ``numbers``: in its summary, None where the original's
    result is not there; ``arrays``: names of all that either has, and ``changes`` those that are not the same bits.
    """

    original: Original
    path: Path
    made: list[str]
    numbers: list[NumberChange] | None
    arrays: list[str]
    changes: list[ArrayChange]

    @property
    def is_compared(self) -> bool:
        """Whether there was anything to compare with: the original's result, or checksums of its arrays."""
        return self.numbers is not None or "arrays" in self.original.said


def original_of(name: str, store: str | Path) -> Original:
    """The run that ``name`` means: a manifest, the folder or result beside one, or an id in ``store`` or an end of one.

    Raises ConfigError where there is no such run, StoreError where its manifest is missing or broken.
    """
    path = Path(name)
    if path.is_dir():
        path = path / manifest.MANIFEST
    elif path.name == runs.RESULT:
        path = path.with_name(manifest.MANIFEST)
    elif not path.is_file():
        path = Path(store) / id_of_run(name, store) / manifest.MANIFEST
    said = read_json(path)
    if not said:
        raise StoreError(f"{path} is missing or cannot be read; only a finished run has a manifest")
    if not manifest.is_intact(said):
        raise StoreError(f"{path} is not as it was written: its checksum differs")
    if not (isinstance(said.get("config"), dict) and "run_id" in said):
        raise StoreError(f"{path} is no manifest of a run")
    return Original(path, said)


def config_to_redo(original: Original, into: str | Path) -> Config:
    """The original's configuration, in a store of its own.

    Raises ConfigError where this version does not take it, or where the original itself is in that store.
    """
    config = config_from({**original.said["config"], "store": str(into), "rerun": KINDS})
    if manifest.read(runs.run_dir(config)).get("checksum") == original.said["checksum"]:
        raise ConfigError(f"the run itself is in '{into}': redo it in another folder, --into FOLDER")
    return config


def compare(original: Original, config: Config) -> Redone:
    """Compare the original with the redone run of ``config``, by its result where that is there, and by checksums."""
    path = runs.result_path(config)
    with runs.open_run(path) as dataset:
        now = digests(dataset)
    before = original.said.get("arrays", {})
    made = made_otherwise(original.said, manifest.read(path.parent))
    result = original.path.with_name(runs.RESULT)
    found = compare_runs(result, path) if _is_whole(result, original) else None
    changes = {change.name: change for change in found.arrays} if found else {}
    for name in before:
        if before[name] != now.get(name) and name not in changes:
            changes[name] = ArrayChange(name, "other bits than the manifest says" if name in now else "lost")
    if before:
        changes |= {name: ArrayChange(name, "new") for name in now if name not in {*before, *changes}}
    return Redone(
        original, path, made, found.numbers if found else None, sorted({*before, *now}), list(changes.values())
    )


def redo_lines(found: Redone) -> list[str]:
    """What came of a run that was redone, as text; the verdict is the last line."""
    said = found.original.said
    lines = [
        f"run: {said['run_id']}, made {said.get('created', 'some time ago')}",
        f"redone: {found.path}",
        *listed("code and environment", pairs(found.made), "the same code and environment"),
    ]
    if not said["config"].get("deterministic", True):
        lines.append("its configuration promises no bits: deterministic=false")
    if not found.is_compared:
        why = f"no {runs.RESULT} as the manifest describes it is beside it, and it has no checksums of arrays"
        return [*lines, f"nothing to compare with: {why}"]
    if not found.changes:
        return [*lines, f"the same bits: {len(found.arrays)} arrays"]
    lines += listed("summary", [number_line(number) for number in found.numbers or ()])
    lines += listed("arrays", [array_line(change) for change in found.changes])
    if found.numbers is None:
        lines.append(f"by how much cannot be told: {runs.RESULT} as the manifest describes it is not beside it")
    return [*lines, f"not the same bits: {len(found.changes)} of {len(found.arrays)} arrays"]


def _is_whole(result: Path, original: Original) -> bool:
    """Whether the original's result is there, as its manifest describes it."""
    promised = original.said.get("files", {}).get(runs.RESULT, {}).get("sha256")
    return result.is_file() and sha256(result) == promised
