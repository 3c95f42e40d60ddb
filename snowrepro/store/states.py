"""Where runs stand, read from the disk alone."""

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ..foreign import Unreadable, is_own_folder, is_plain_file, list_own
from . import lease, manifest
from .folders import WORK
from .run import CHECKPOINT, OUTCOME, Run, has_failed_for_good, read_progress

PENDING, RUNNING, DONE, FAILED = "pending", "running", "done", "failed"
TIMED_OUT, INTERRUPTED, BROKEN = "timed out", "interrupted", "broken"
STATES = (DONE, RUNNING, PENDING, INTERRUPTED, TIMED_OUT, FAILED, BROKEN)


@dataclass(frozen=True, slots=True)
class Standing:
    """The state of a run and, in a phrase, what it rests on.

    ``stale``: of a run that is done, by what it is older than what would make it now.
    ``final``: of one that failed, whether it would fail again.
    """

    state: str
    reason: str = ""
    stale: Mapping[str, str] = field(default_factory=dict)
    final: bool = False


_NEVER = Standing(PENDING, "never run")


def standings(runs: Iterable[Run], thorough: bool = False) -> Iterator[Standing]:
    """Where each run stands; of runs that left nothing in the store, without a look at the disk.

    ``thorough``: read every result, and not just its size and time.
    """
    listed: dict[Path, tuple[frozenset[str], frozenset[str]]] = {}
    for run in runs:
        store = run.store
        if store not in listed:
            listed[store] = _names(store, store), _names(store / WORK, store)
        published, worked_on = listed[store]
        if run.id in published or run.id in worked_on:
            yield standing(run, thorough)
        else:
            yield _NEVER


def standing(run: Run, thorough: bool = False) -> Standing:
    """Where one run stands."""
    holder = lease.holder(run.work) if is_own_folder(run.work, run.store) else None
    flaw, written = run.examine(thorough)
    if flaw is None:
        stale = manifest.stale(written, run.config.execution)
        redone = f"; {holder} makes it anew" if holder else ""
        return Standing(DONE, f"made {written.get('created', 'some time ago')}{redone}", stale)
    if holder:
        progress = read_progress(run.work)
        frame = f", frame {progress.frame} of {progress.frames}" if progress else ""
        return Standing(RUNNING, f"{holder}{frame}")
    if flaw:
        return Standing(BROKEN, flaw)
    return _ended(run)


def _ended(run: Run) -> Standing:
    """Where a run stands that nobody works on and that has no result."""
    if not is_own_folder(run.work, run.store):
        is_there = os.path.lexists(run.work)
        return Standing(BROKEN, "its work folder is a link, which is not followed") if is_there else _NEVER
    try:
        outcome = run.outcome()
    except Unreadable as error:
        return Standing(BROKEN, f"{OUTCOME} {error.reason}")
    died = lease.dead_holder(run.work)
    if died:  # after whatever was recorded
        return Standing(INTERRUPTED, f"{died} died{_checkpoint_of(run)}")
    if outcome is None:
        return Standing(INTERRUPTED, f"stopped{_checkpoint_of(run)}")
    checkpoint = "" if outcome.state == FAILED else _checkpoint_of(run)
    return Standing(outcome.state, f"{outcome.message}{checkpoint}", final=has_failed_for_good(outcome))


def _checkpoint_of(run: Run) -> str:
    """Whether there is a checkpoint, in words behind others."""
    return ", kept a checkpoint" if is_plain_file(run.work / CHECKPOINT) else ""


def _names(folder: Path, store: Path) -> frozenset[str]:
    return frozenset(entry.name for entry in list_own(folder, store))
