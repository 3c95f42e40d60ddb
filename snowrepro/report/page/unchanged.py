"""Whether a report that was drawn is still what would be drawn: by a digest of all that it is drawn from."""

import hashlib
import json
import os
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ...composition.compose import list_option_files, option_files
from ...foreign import Unreadable, is_own_folder, is_plain_file, list_own
from ...sources import PACKAGE
from ...store import files, lease, provenance
from ...store.folders import SWEEPS, WORK
from ...store.run import ANALYSIS, SUMMARY
from ...sweep import record

STAMP = ".drawn.json"  # in the report's folder
DRAWING = re.compile(r"""\bfile["']?[ ]*[:=][ ]*(?:"([^"\n]+)"|'([^'\n]+)'|([^\s"',#}][^,#}\n]*))""")  # an outline's
ENVIRONMENT = "oc.env"  # an interpolation that takes a setting from there
WRITTEN_BY_READING = {ANALYSIS, SUMMARY}  # beside a result, by whoever reads it first


def draw_if_changed(
    folder: Path, inputs: str | None, draw: Callable[[], tuple[Sequence[str], Sequence[Path]]]
) -> tuple[Sequence[str], bool]:
    """Draw a report unless the one in ``folder`` was drawn from the same inputs and is still whole.

    ``inputs``: see ``digest_inputs``; None draws in any case.  ``draw`` returns the lines to print at the end, and the
    folders that it wrote into.  Returns the lines, and whether it was drawn.
    """
    stamp = files.read_json(folder / STAMP) if is_plain_file(folder / STAMP) else {}
    if inputs and stamp.get("inputs") == inputs and _is_whole(stamp, folder):
        return [str(line) for line in stamp["lines"]], False
    (folder / STAMP).unlink(missing_ok=True)
    lines, folders = draw()
    if inputs:
        content = {"inputs": inputs, "files": dict(_digest_files(folders, folder)), "lines": list(lines)}
        files.write_json(folder / STAMP, content)
    return lines, True


def _is_whole(stamp: dict[str, Any], folder: Path) -> bool:
    """Whether all files of a report are as its stamp says."""
    lines, written = stamp.get("lines"), stamp.get("files")
    if not isinstance(lines, list) or not isinstance(written, dict):
        return False
    return all(_digest_file(folder / name) == digest for name, digest in written.items())


def digest_inputs(overrides: Sequence[str], store: Path) -> str | None:
    """Return a digest of all that a report is drawn from; None while somebody works on a run of the store.

    It covers the program and its packages, the files of all options, ``overrides``, and what the store holds.  No run
    is composed for it, as that takes a minute for all runs of the paper.
    """
    digest = hashlib.sha256()
    for path in (path for path in sorted(PACKAGE.rglob("*")) if "__pycache__" not in path.parts):
        if is_plain_file(path):
            digest.update(f"{path.relative_to(PACKAGE).as_posix()} {_digest_file(path)}\n".encode())
    records, problems = record.read_all(store)
    known = [(each.name, each.overrides, sorted(each.cells.items())) for each in records]
    remembered = [word for each in records for word in each.overrides]
    asked = [provenance.packages(), list(overrides), str(store), known, problems]
    digest.update(json.dumps([*asked, *_describe_options(overrides, remembered)]).encode())
    folders = list(_list_run_folders(store))
    if any(lease.holder(folder) for folder in folders if folder.parent.name == WORK):
        return None
    for folder in folders:
        digest.update(json.dumps([folder.name, list(_list_files(folder, store))]).encode())
    return digest.hexdigest()


def _describe_options(overrides: Sequence[str], remembered: Sequence[str]) -> Iterator[object]:
    """List what options and overrides give to a run: their files, drawings that they name, and the environment."""
    paths = list_option_files(option_files([word for word in overrides if word.startswith("hydra.")]))
    texts = [path.read_text(encoding="utf-8", errors="replace") for path in paths]
    yield list(zip(map(str, paths), texts, strict=True))
    text = "\n".join([*overrides, *remembered, *texts])
    for name in sorted({"".join(groups).strip() for groups in DRAWING.findall(text)}):
        with suppress(OSError, ValueError):  # it names none
            yield name, hashlib.sha256(Path(name).read_bytes()).hexdigest()
    if ENVIRONMENT in text:
        yield sorted(os.environ.items())


def _list_run_folders(store: Path) -> Iterator[Path]:
    """List the folders of all runs of a store, done or not."""
    for part in (store, store / WORK):
        for entry in list_own(part, store):
            if entry.name not in (WORK, SWEEPS) and is_own_folder(Path(entry.path), store):
                yield Path(entry.path)


def _list_files(folder: Path, store: Path) -> Iterator[tuple[str, int, int]]:
    """List the name, size and time of change of each file of a run."""
    for entry in list_own(folder, store):
        status = entry.stat(follow_symlinks=False)
        if entry.name not in WRITTEN_BY_READING:
            yield entry.name, status.st_size, status.st_mtime_ns


def _digest_files(folders: Sequence[Path], base: Path) -> Iterator[tuple[str, str]]:
    """Digest the regular files in folders: their paths from ``base``, and their digests."""
    for folder in folders:
        for path in sorted(folder.iterdir()):
            if path.name != STAMP and is_plain_file(path):
                yield os.path.relpath(path, base), _digest_file(path)


def _digest_file(path: Path) -> str:
    """Digest a file; empty if there is none."""
    try:
        return files.sha256(path)
    except (OSError, Unreadable):
        return ""
