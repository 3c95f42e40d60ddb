"""Do a run again from its manifest, and see whether it gives the same bits."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..composition.compose import config_from
from ..errors import ConfigError, StoreError
from ..foreign import Unreadable, refuse_links
from ..store import manifest
from ..store.bits import digests
from ..store.files import sha256
from ..store.run import RESULT, Run
from ..sweep.explain import id_of_run
from .differences import (
    ArrayChange,
    NumberChange,
    add_colons,
    compare_origins,
    compare_runs,
    describe_array,
    describe_number,
    list_under_title,
)

KINDS = ("config", "code", "environment")  # whatever changed since a run was repeated, it is repeated anew


@dataclass(frozen=True)
class Original:
    """A run as described by its manifest: file and ``content``; its result may be in the same folder."""

    path: Path
    content: Mapping[str, Any]


@dataclass(frozen=True)
class Repetition:
    """A run that was done again, with its differences from the original.

    ``path``: of its result; ``made``: differences in code and environment, "key before -> now"; ``numbers``: in the row
    of numbers, None where the original's result is not there; ``arrays``: names of all arrays of both, ``changes``:
    those whose bits are not the same.
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
        return self.numbers is not None or "arrays" in self.original.content


def find_original(name: str, store: str | Path) -> Original:
    """Find the run that ``name`` means: a manifest, the folder or result beside one, or an id in ``store``.

    The end of an id is enough where it is of one run alone.

    Raises ConfigError where there is no such run, StoreError where its manifest is missing or broken.
    """
    path = Path(name).resolve()  # a link that the caller names is one that the caller knows
    if path.is_dir():
        path = path / manifest.MANIFEST
    elif path.name == RESULT:
        path = path.with_name(manifest.MANIFEST)
    elif not path.is_file():
        path = Path(store) / id_of_run(name, store) / manifest.MANIFEST
        refuse_links(path, Path(store))
    try:
        content = manifest.load(path.parent, path.name)
    except Unreadable as error:
        reason = f"is missing or cannot be read ({error.detail})"
        raise StoreError(f"{path} {reason}; only a finished run has a manifest") from error
    if not manifest.is_intact(content):
        raise StoreError(f"{path} is not as it was written: its checksum differs")
    if not content.get("config"):
        raise StoreError(f"{path} is no manifest of a run")
    return Original(path, content)


def make_repetition(original: Original, into: str | Path) -> Run:
    """Make the run that repeats the original in the store ``into``.

    Raises ConfigError where this version does not take it, or where the original itself is in that store; StoreError
    where its id is not that of its configuration.
    """
    run = Run(config_from(original.content["config"], store=str(into), rerun=KINDS))
    if manifest.is_of_this_version(original.content) and original.content["run_id"] != run.id:
        raise StoreError(f"{original.path} is of another run: its configuration has the id {run.id}")
    if run.manifest().get("checksum") == original.content["checksum"]:
        raise ConfigError(f"the run itself is in '{into}': redo it in another folder, --into FOLDER")
    return run


def compare_with_original(original: Original, run: Run) -> Repetition:
    """Compare a repeated ``run`` with the original: by its result where that is there, and by checksums."""
    path = run.result
    with run.open() as dataset:
        digests_now = digests(dataset)
    digests_before = original.content.get("arrays", {})
    origin = compare_origins(original.content, run.manifest())
    result = original.path.with_name(RESULT)
    differences = compare_runs(result, path) if _is_intact(result, original) else None
    changes = {change.name: change for change in differences.arrays} if differences else {}
    for name in digests_before:
        if digests_before[name] != digests_now.get(name) and name not in changes:
            changes[name] = ArrayChange(name, "other bits than the manifest says" if name in digests_now else "lost")
    if digests_before:
        changes |= {name: ArrayChange(name, "new") for name in digests_now if name not in {*digests_before, *changes}}
    return Repetition(
        original,
        path,
        origin,
        differences.numbers if differences else None,
        sorted({*digests_before, *digests_now}),
        list(changes.values()),
    )


def describe_repetition(repetition: Repetition) -> list[str]:
    """Describe a repetition and its differences as lines; the last is the verdict."""
    content = repetition.original.content
    lines = [
        f"run: {content['run_id']}, made {content.get('created', 'some time ago')}",
        f"redone: {repetition.path}",
        *list_under_title("code and environment", add_colons(repetition.made), "the same code and environment"),
    ]
    if not content["config"].get("deterministic", True):
        lines.append("its configuration promises no bits: deterministic=false")
    if not repetition.is_compared:
        why = f"no {RESULT} as the manifest describes it is beside it, and it has no checksums of arrays"
        return [*lines, f"nothing to compare with: {why}"]
    if not repetition.changes:
        return [*lines, f"the same bits: {len(repetition.arrays)} arrays"]
    lines += list_under_title("summary", [describe_number(number) for number in repetition.numbers or ()])
    lines += list_under_title("arrays", [describe_array(change) for change in repetition.changes])
    if repetition.numbers is None:
        lines.append(f"by how much cannot be told: {RESULT} as the manifest describes it is not beside it")
    return [*lines, f"not the same bits: {len(repetition.changes)} of {len(repetition.arrays)} arrays"]


def _is_intact(result: Path, original: Original) -> bool:
    """Return whether the original's result is there, as its manifest describes it."""
    promised = original.content.get("files", {}).get(RESULT, {})
    try:
        return result.stat().st_size == promised.get("bytes") and sha256(result) == promised.get("sha256")
    except (OSError, Unreadable):
        return False
