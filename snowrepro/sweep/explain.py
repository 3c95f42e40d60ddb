"""Why a run is done, stale, failed or not run, in words; its log below."""

import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..composition.compose import config_from
from ..errors import ConfigError, StoreError
from ..foreign import Unreadable, is_own_folder, is_plain_name, list_own, read_tail, refuse_links
from ..store import lease, manifest, states
from ..store.find import find_id
from ..store.folders import WORK
from ..store.run import LOG, Run, read_config
from . import record

LOG_LINES = 15


def explain(name: str, store: str | Path) -> list[str]:
    """Lines on the run whose id is, begins with or ends in ``name``.  Raises ConfigError if it is none or several."""
    run_id, store = id_of_run(name, store), Path(store)
    try:
        lines = _explain_run(_find_run(run_id, store))
    except (ConfigError, StoreError) as error:  # what the store has of it does not say what it is
        lines = [f"{run_id}: {states.BROKEN}", f"  {error}"]
    records, problems = record.read_all(store)
    asking = [each.name for each in records if run_id in each.cells.values()]
    lines.append(f"  asked for by: {', '.join(asking) or 'no sweep that the store remembers'}")
    lines += [f"  not looked at: {problem}" for problem in problems]
    for folder in (store / run_id, store / WORK / run_id):
        lines += _read_log(folder, store)
    return lines


def _explain_run(run: Run) -> list[str]:
    """Lines on where a run stands, and why."""
    standing = states.standing(run, thorough=True)
    lines = [f"{run.id}: {standing.state}", f"  {standing.reason}"]
    if standing.state == states.DONE:
        lines += _made(run.manifest())
        lines += [f"  stale by {kind}: {what}; {_say_remedy(kind)}" for kind, what in standing.stale.items()]
    if standing.final:
        lines.append("  not run again: this code would fail again; 'snowrepro retry' tries all the same")
    if standing.state in (states.BROKEN, states.FAILED, states.TIMED_OUT) and not standing.final:
        lines.append("  the next 'snowrepro run' of it runs it again")
    if standing.state == states.INTERRUPTED:
        lines.append("  the next 'snowrepro run' of it goes on from what was kept")
    died = lease.dead_holder(run.work) if is_own_folder(run.work, run.store) else None
    return [*lines, f"  last worked on by {died}, which died"] if died else lines


def _say_remedy(kind: str) -> str:
    """What makes a result anew that is stale by one kind: another law is another run."""
    return "asked for again it is another run, of another id" if kind == "law" else f"rerun=[{kind}] runs it again"


def _read_log(folder: Path, store: Path) -> list[str]:
    """The end of a run's log, under its path; nothing where there is none."""
    log = folder / LOG
    try:
        refuse_links(log, store)
        return [f"  {log}:", *(f"    {line}" for line in read_tail(log, LOG_LINES))]
    except FileNotFoundError:
        return []
    except (OSError, Unreadable) as error:
        return [f"  no log: {error}"]


def id_of_run(name: str, store: str | Path) -> str:
    """The id of the one run of a store whose id is, begins with or ends in ``name``.  Raises ConfigError."""
    run_id = find_id(name, _known(Path(store)), store)
    if run_id is None:
        sweep = record.find_sweep(name, store, is_name=True)
        hint = (
            f"; of the sweep '{sweep}' they are named by: snowrepro status --list {shlex.quote(sweep)}" if sweep else ""
        )
        raise ConfigError(f"'{name}' should name one run of the store '{store}'; no run is{hint}")
    return run_id


def run_named(name: str, store: str | Path, or_sweep: bool = False) -> Run:
    """The run that the store holds, works on, or was asked for by a name: see ``id_of_run``.

    ``or_sweep``: whether the name might have been a sweep's, for the message.  Raises ConfigError; StoreError where
    what the store holds of it is of another run, or cannot be read.
    """
    try:
        return _find_run(id_of_run(name, store), Path(store))
    except ConfigError as error:
        if not or_sweep:
            raise
        raise ConfigError(f"{error}; sweeps are: {record.name_nearest(name, store)}") from error


def _find_run(run_id: str, store: Path) -> Run:
    """The run of an id, by its manifest, its configuration in the work folder, or a sweep that asks for it.

    Raises ConfigError and StoreError.
    """
    unread: list[str] = []
    for where, plain in ((store / run_id, _config_of_result), (store / WORK / run_id, read_config)):
        try:
            config = plain(where, store)
            if config:
                run = Run(config_from(config, store=str(store)))
                if run.id == run_id:
                    return run
                unread.append(f"{where} has the configuration of another run, {run.id}")
        except (ConfigError, StoreError) as error:
            unread.append(str(error))
    for each in record.read_all(store)[0]:
        if run_id in each.cells.values():
            for run in record.plan_remembered(each.name, store).runs:
                if run.id == run_id:
                    return run
            unread.append(f"'{run_id}' was asked for by the sweep '{each.name}', which has other runs now")
    raise ConfigError("; ".join(unread) or f"nothing in the store '{store}' says what the run '{run_id}' is")


def _config_of_result(folder: Path, store: Path) -> dict[str, Any]:
    """The configuration in a manifest; empty where there is none.  Raises Unreadable."""
    refuse_links(folder, store)
    return manifest.load(folder).get("config") or {} if folder.is_dir() else {}


def _made(written: dict) -> Iterator[str]:
    """What made a result, and what it took."""
    yield f"  took {written.get('wall_seconds', 0):.4g} s and at most {written.get('peak_memory_mb', '?')} MB"
    yield f"  made by commit {written.get('git_state')} on {written.get('machine')}"
    yield f"  with {written.get('versions')}{_computed_on(written)}"


def _computed_on(written: dict) -> str:
    """What the run was computed on; older manifests do not say."""
    return f", computed on {written['device']}" if written.get("device") else ""


def _known(store: Path) -> set[str]:
    """Ids of all runs that a store holds, works on, or was asked for."""
    ids = {run_id for each in record.read_all(store)[0] for run_id in each.cells.values()}
    for folder in (store, store / WORK):
        entries = [entry for entry in list_own(folder, store) if entry.is_dir() or entry.is_symlink()]
        ids.update(entry.name for entry in entries if is_plain_name(entry.name))
    return ids - {record.SWEEPS, "sweep.log"}
