"""Results by their names: ids and their ends, files and folders, of this program or another code."""

import importlib
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from .. import foreign
from ..errors import ConfigError, StoreError
from ..foreign import Unreadable
from ..text import make_printable
from . import manifest
from .files import sha256
from .folders import WORK
from .manifest import RESULT

if TYPE_CHECKING:
    import xarray as xr

MOST_NAMED = 10  # runs in a message


def open_run(id_or_path: str | Path, store: str | Path = "runs") -> "xr.Dataset":
    """Open a run by its id in ``store`` or by the path of its file or folder, as ``simulate`` gave it.

    The beginning or end of an id is enough where it is of one run alone.  Another code's file is opened as it is.
    Raises StoreError if there is no such file or it cannot be read, ConfigError if several runs are meant.
    """
    return open_particles(id_or_path, store)


def open_particles(id_or_path: str | Path, store: str | Path = "runs", group: str | None = None) -> "xr.Dataset":
    """Open a run as ``open_run`` does, or the particles of another code in a file or in a ``group`` of it."""
    path = find_result(id_or_path, store)
    _require_as_written(path)
    arrays = importlib.import_module(".arrays", __package__)  # with xarray, which a search for an id does without
    opened: xr.Dataset = arrays.read_result(path, group)
    return opened


def find_result(id_or_path: str | Path, store: str | Path) -> Path:
    """Find the file of a run by the path of its file or folder, or by its id in ``store``: see ``find_id``.

    It may be no regular file; only its reader can say so.  Raises StoreError if there is nothing, ConfigError if there
    are several.
    """
    if not isinstance(id_or_path, str | Path):
        raise ConfigError(f"a run is named by its id or its path, not by {type(id_or_path).__name__}")
    name, places = str(id_or_path), []
    with suppress(OSError, ValueError):  # a name too long, a folder that may not be entered, a name with a zero
        if os.path.lexists(id_or_path):
            places.append(Path(id_or_path).resolve())  # a link that the caller names is one that the caller knows
    if foreign.is_plain_name(name) and foreign.is_own_folder(Path(store) / name, Path(store)):
        places.append(Path(store) / name)
    for place in places:
        path = place / RESULT if place.is_dir() else place
        if os.path.lexists(path):
            return path
    if run_id := find_id(name, _list_results(Path(store)), store):
        return Path(store) / run_id / RESULT
    with suppress(OSError):
        if begun := find_id(name, [entry.name for entry in foreign.list_own(Path(store) / WORK, Path(store))], store):
            raise StoreError(
                f"the run '{begun}' has no result: it is not at its end, or it failed; 'snowrepro explain {begun}' "
                "says more, and the command that began it goes on with it"
            )
    raise StoreError(
        f"there is no run '{make_printable(name)}': neither a file, nor an id in the folder '{make_printable(store)}', "
        "nor the beginning or end of one"
    )


def find_id(name: str, ids: Iterable[str], store: str | Path) -> str | None:
    """Which of some ids is ``name``, or else begins with or ends in it; None if none does.

    ``store``: whose they are, for the message.  Raises ConfigError if several do.
    """
    known = sorted(run_id for run_id in ids if name and (run_id.startswith(name) or run_id.endswith(name)))
    if name in known:
        return name
    if len(known) > 1:
        more = f" and {len(known) - MOST_NAMED} more" if len(known) > MOST_NAMED else ""
        several = f"{len(known)} runs are: {', '.join(known[:MOST_NAMED])}{more}"
        raise ConfigError(f"'{make_printable(name)}' should name one run of the store '{store}'; {several}")
    return known[0] if known else None


def _list_results(store: Path) -> list[str]:
    """The ids of the runs that have a result in a store."""
    names = [entry.name for entry in foreign.list_own(store, store) if entry.is_dir(follow_symlinks=False)]
    return [name for name in names if foreign.is_plain_name(name) and os.path.lexists(store / name / RESULT)]


def _require_as_written(path: Path) -> None:
    """Check that a result is what a manifest beside it says, if there is one.  Raises Unreadable."""
    content = manifest.read(path.parent)
    place = path.parent / manifest.MANIFEST
    if path.name == RESULT and os.path.lexists(place) and not manifest.is_intact(content):
        raise Unreadable(place, "is not as it was written, so the result beside it is not used: see snowrepro explain")
    promised = content.get("files", {}).get(path.name)
    if promised and (path.lstat().st_size != promised["bytes"] or sha256(path) != promised["sha256"]):
        raise Unreadable(path, "cannot be read: it is not as it was written, its checksum differs")
