"""What could go from a store, and how much room it takes.

Only what lies in the store itself: no link is followed, and where a folder of the store's own is a link, nothing of it
is listed.  ``links`` names all that.
"""

import os
import re
import shutil
from collections.abc import Callable, Container, Iterator
from dataclasses import dataclass
from pathlib import Path

from ..foreign import Unreadable, is_own_folder, list_own, refuse_links
from . import lease, manifest, states
from .files import size_of
from .folders import SWEEPS, TRASH, WORK, discard
from .run import RESULT, read_outcome


@dataclass(frozen=True)
class Leftover:
    """A file or folder that could go."""

    path: Path
    bytes: int
    store: Path

    def remove(self) -> None:
        """Take it out of the store at once, so that no half of it is ever there, then remove it.

        Raises StoreError where it lies behind a link.
        """
        refuse_links(self.path.parent, self.store)
        if not self.path.is_dir() or self.path.is_symlink():
            self.path.unlink(missing_ok=True)
        elif self.path.parent.name == TRASH:
            shutil.rmtree(self.path, ignore_errors=True)
        else:
            discard(self.path)


def find(kind: str, store: Path, asked_for: Container[str]) -> list[Leftover]:
    """What there is of a kind (see ``KINDS``); ``asked_for``: ids of runs that are not unused."""
    return [Leftover(path, size_of(path), store) for path in KINDS[kind](store, asked_for)]


def links(store: Path) -> list[Path]:
    """The links in a store, and among the unfinished runs; all of them are left alone."""
    entries = [entry for place in (store, store / WORK) for entry in list_own(place, store)]
    return sorted(Path(entry.path) for entry in entries if entry.is_symlink())


def _scraps(store: Path, _: Container[str]) -> Iterator[Path]:
    """The trash; work folders of runs that are done; half-written files of processes that are gone."""
    yield from (Path(entry.path) for entry in list_own(store / TRASH, store))
    for work in _idle(store):
        if is_own_folder(store / work.name, store):
            yield work
        else:
            names = (entry.name for entry in list_own(work, store))
            yield from (work / name for name in names if re.search(r"^result\.|\.part$|^\.now-", name))
    for folder in _folders(store):
        yield from (folder / entry.name for entry in list_own(folder, store) if entry.name.endswith(".part"))


def _failed(store: Path, _: Container[str]) -> Iterator[Path]:
    for work in _without_result(store):
        if _outcome(work, store) in (states.FAILED, states.TIMED_OUT):
            yield work


def _unfinished(store: Path, _: Container[str]) -> Iterator[Path]:
    for work in _without_result(store):
        if _outcome(work, store) in (None, states.INTERRUPTED):
            yield work


def _broken(store: Path, _: Container[str]) -> Iterator[Path]:
    for folder in _published(store):
        if manifest.flaw(folder, manifest.read(folder), folder.name, thorough=True):
            yield folder
    for work in _without_result(store):
        if _outcome(work, store) == states.BROKEN:
            yield work


def _unused(store: Path, asked_for: Container[str]) -> Iterator[Path]:
    yield from (folder for folder in _published(store) if folder.name not in asked_for)


def _launchers(store: Path, _: Container[str]) -> Iterator[Path]:
    paths = (store / ".sweep", store / "sweep.log")
    yield from (path for path in paths if path.exists() and not path.is_symlink())


def _folders(store: Path) -> Iterator[Path]:
    """Folders in a store, none of them a link, hidden or not."""
    yield from (Path(entry.path) for entry in list_own(store, store) if entry.is_dir(follow_symlinks=False))


def _published(store: Path) -> Iterator[Path]:
    """Folders of results, whole or not."""
    for folder in _folders(store):
        is_hidden = folder.name.startswith(".") or folder.name == SWEEPS
        if not is_hidden and (os.path.lexists(folder / RESULT) or manifest.read(folder)):
            yield folder


def _idle(store: Path) -> Iterator[Path]:
    """Work folders that nobody works in."""
    for entry in list_own(store / WORK, store):
        if entry.is_dir(follow_symlinks=False) and lease.holder(store / WORK / entry.name) is None:
            yield store / WORK / entry.name


def _without_result(store: Path) -> Iterator[Path]:
    """Those of them whose run is not done."""
    yield from (work for work in _idle(store) if not os.path.lexists(store / work.name))


def _outcome(work: Path, store: Path) -> str | None:
    """How the last attempt of a work folder ended; None if nothing says so."""
    try:
        outcome = read_outcome(work, store)
    except Unreadable:
        return states.BROKEN
    return outcome.state if outcome else None


KINDS: dict[str, Callable[[Path, Container[str]], Iterator[Path]]] = {
    "scraps": _scraps,
    "failed": _failed,
    "unfinished": _unfinished,
    "broken": _broken,
    "unused": _unused,
    "launchers": _launchers,
}
