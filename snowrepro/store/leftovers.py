"""What could go from a store, and how much room it takes."""

import re
import shutil
from collections.abc import Callable, Container, Iterator
from dataclasses import dataclass
from pathlib import Path

from . import lease, manifest, states
from .files import read_json, size_of
from .run import OUTCOME, RESULT, TRASH, WORK, discard


@dataclass(frozen=True)
class Leftover:
    """A file or folder that could go."""

    path: Path
    bytes: int

    def remove(self) -> None:
        """Take it out of the store at once, so that no half of it is ever there, then remove it."""
        if self.path.is_dir() and self.path.parent.name != TRASH:
            discard(self.path)
        elif self.path.is_dir():
            shutil.rmtree(self.path, ignore_errors=True)
        else:
            self.path.unlink(missing_ok=True)


def find(kind: str, store: Path, asked_for: Container[str]) -> list[Leftover]:
    """What there is of a kind (see ``KINDS``); ``asked_for``: ids of runs that are not unused."""
    return [Leftover(path, size_of(path)) for path in KINDS[kind](store, asked_for)]


def _scraps(store: Path, _: Container[str]) -> Iterator[Path]:
    """The trash; work folders of runs that are done; half-written files of processes that are gone."""
    yield from (store / TRASH).glob("*")
    for work in _idle(store):
        if (store / work.name).is_dir():
            yield work
        else:
            yield from (path for path in work.iterdir() if re.search(r"^result\.|\.part$|^\.now-", path.name))
    yield from store.glob("*/*.part")


def _failed(store: Path, _: Container[str]) -> Iterator[Path]:
    for work in _without_result(store):
        if _outcome(work) in (states.FAILED, states.TIMED_OUT):
            yield work


def _unfinished(store: Path, _: Container[str]) -> Iterator[Path]:
    for work in _without_result(store):
        if _outcome(work) in (None, states.INTERRUPTED):
            yield work


def _broken(store: Path, _: Container[str]) -> Iterator[Path]:
    for folder in _published(store):
        if manifest.flaw(folder, manifest.read(folder), folder.name, thorough=True):
            yield folder


def _unused(store: Path, asked_for: Container[str]) -> Iterator[Path]:
    yield from (folder for folder in _published(store) if folder.name not in asked_for)


def _launchers(store: Path, _: Container[str]) -> Iterator[Path]:
    yield from (path for path in (store / ".sweep", store / "sweep.log") if path.exists())


def _published(store: Path) -> Iterator[Path]:
    """Folders of results, whole or not."""
    for folder in sorted(store.glob("*")):
        if not folder.name.startswith(".") and ((folder / RESULT).exists() or manifest.read(folder)):
            yield folder


def _idle(store: Path) -> Iterator[Path]:
    """Work folders that nobody works in."""
    for work in sorted((store / WORK).glob("*")):
        if lease.holder(work) is None:
            yield work


def _without_result(store: Path) -> Iterator[Path]:
    """Those of them whose run is not done."""
    yield from (work for work in _idle(store) if not (store / work.name).is_dir())


def _outcome(work: Path) -> str | None:
    return read_json(work / OUTCOME).get("state")


KINDS: dict[str, Callable[[Path, Container[str]], Iterator[Path]]] = {
    "scraps": _scraps,
    "failed": _failed,
    "unfinished": _unfinished,
    "broken": _broken,
    "unused": _unused,
    "launchers": _launchers,
}
