"""Where runs stand, read from the disk alone."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..config import Config
from . import lease, manifest, runs

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


def standings(configs: Sequence[Config], thorough: bool = False) -> Iterator[Standing]:
    """Where each run stands; of runs that left nothing in the store, without a look at the disk.

    ``thorough``: read every result, and not just its size and time.
    """
    listed: dict[str, tuple[frozenset[str], frozenset[str]]] = {}
    for config in configs:
        if config.store not in listed:
            store = Path(config.store)
            listed[config.store] = _names(store), _names(store / runs.WORK)
        published, worked_on = listed[config.store]
        name = runs.identify(config)
        if name in published or name in worked_on:
            yield standing(config, thorough)
        else:
            yield _NEVER


def standing(config: Config, thorough: bool = False) -> Standing:
    """Where one run stands."""
    folder, work = runs.run_dir(config), runs.work_dir(config)
    holder = lease.holder(work)
    written = manifest.read(folder)
    flaw = manifest.flaw(folder, written, folder.name, thorough) if folder.is_dir() else ""
    if flaw is None:
        stale = manifest.stale(written, config)
        redone = f"; {holder} makes it anew" if holder else ""
        return Standing(DONE, f"made {written.get('created', 'some time ago')}{redone}", stale)
    if holder:
        said = runs.progress(work)
        frame = f", frame {said['frame']} of {said['frames']}" if said else ""
        return Standing(RUNNING, f"{holder}{frame}")
    if flaw:
        return Standing(BROKEN, flaw)
    return _ended(config, work)


def _ended(config: Config, work: Path) -> Standing:
    """Where a run stands that nobody works on and that has no result."""
    said, died = runs.outcome(config), lease.dead_holder(work)
    if died:  # after whatever was said
        return Standing(INTERRUPTED, f"{died} died{_kept(work)}")
    if not said:
        return Standing(INTERRUPTED, f"stopped{_kept(work)}") if work.is_dir() else _NEVER
    final = runs.has_failed_for_good(said)
    kept = "" if said["state"] == FAILED else _kept(work)
    return Standing(said["state"], f"{said['message']}{kept}", final=final)


def _kept(work: Path) -> str:
    return ", kept a checkpoint" if (work / runs.CHECKPOINT).exists() else ""


def _names(folder: Path) -> frozenset[str]:
    try:
        return frozenset(os.listdir(folder))
    except OSError:
        return frozenset()
