"""The folders of a store: how one comes to its place, whole, and how one leaves it."""

import os
import shutil
import uuid
from pathlib import Path

from .. import foreign
from .files import flush, writing

WORK = ".work"
TRASH = ".trash"
SWEEPS = "sweeps"
# What a store has beside the folders of its runs, and is never a link.
OWN = (WORK, TRASH, SWEEPS, ".sweep", "sweep.log")


def publish(folder: Path, place: Path) -> None:
    """Move a whole folder to its place by one rename; what was there before goes to the trash.

    Raises StoreError; where the folder was removed by another process, what is at its place stays there.
    """
    with writing(place):
        flush(folder)
        before = _put_aside(place) if os.path.lexists(place) else None
        try:
            folder.rename(place)
        except OSError:
            if before and not os.path.lexists(place):
                before.rename(place)
            raise
        flush(place.parent)
        if before:
            shutil.rmtree(before, ignore_errors=True)


def discard(folder: Path) -> None:
    """Take a folder out of the store, by one rename; its files are then removed.  Of a link, only the link is.

    Raises StoreError where the trash, or a folder on the way, is a link.
    """
    aside = _put_aside(folder)
    if aside:
        shutil.rmtree(aside, ignore_errors=True)


def _put_aside(folder: Path) -> Path | None:
    """Move a folder into the trash; returns where it is.  A link is removed."""
    store = folder.parent.parent if folder.parent.name == WORK else folder.parent
    foreign.refuse_links(folder.parent, store)
    if folder.is_symlink():
        folder.unlink()
        return None
    foreign.refuse_links(store / TRASH, store)
    trash = store / TRASH / f"{folder.name[:200]}.{uuid.uuid4().hex[:8]}"
    trash.parent.mkdir(exist_ok=True)
    folder.rename(trash)
    return trash


def require_own_folders(store: Path) -> None:
    """Check that nothing that a store has beside its runs is a link.  Raises StoreError that names the one that is."""
    for name in OWN:
        foreign.refuse_links(store / name, store)
