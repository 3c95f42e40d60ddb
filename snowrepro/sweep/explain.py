"""Why a run is done, stale, failed or not run, in words; its log below."""

from collections.abc import Iterator
from pathlib import Path

from ..composition.compose import config_from
from ..errors import ConfigError
from ..store import lease, manifest, states
from ..store.files import read_json
from ..store.run import CONFIG, LOG, WORK, Run
from . import record

LOG_LINES = 15
MOST_NAMED = 10


def explain(name: str, store: str | Path) -> list[str]:
    """Lines on the run whose id is, begins with or ends in ``name``.  Raises ConfigError if it is none or several."""
    run = run_named(name, store)
    standing = states.standing(run, thorough=True)
    lines = [f"{run.id}: {standing.state}", f"  {standing.reason}"]
    if standing.state == states.DONE:
        lines += _made(run.manifest())
        lines += [f"  stale by {kind}: {what}; rerun=[{kind}] runs it again" for kind, what in standing.stale.items()]
    if standing.final:
        lines.append("  not run again: this code would fail again; 'snowrepro retry' tries all the same")
    if standing.state in (states.BROKEN, states.FAILED, states.TIMED_OUT, states.INTERRUPTED) and not standing.final:
        lines.append("  the next 'snowrepro run' of it runs it again")
    died = lease.dead_holder(run.work)
    lines += [f"  last worked on by {died}, which died"] if died else []
    asking = [name for name in record.list_sweeps(store) if run.id in record.read_record(name, store).cells.values()]
    lines.append(f"  asked for by: {', '.join(asking) or 'no sweep that the store remembers'}")
    for log in (run.folder / LOG, run.work / LOG):
        if log.exists():
            lines += [f"  {log}:", *(f"    {line}" for line in log.read_text("utf-8").splitlines()[-LOG_LINES:])]
    return lines


def id_of_run(name: str, store: str | Path) -> str:
    """The id of the one run of a store whose id is, begins with or ends in ``name``.  Raises ConfigError."""
    known = sorted(run_id for run_id in _known(Path(store)) if run_id.startswith(name) or run_id.endswith(name))
    if name in known:
        known = [name]
    if len(known) != 1:
        several = f"{len(known)} runs are: {', '.join(known[:MOST_NAMED])}" if known else "no run is"
        raise ConfigError(f"'{name}' should name one run of the store '{store}'; {several}")
    return known[0]


def run_named(name: str, store: str | Path) -> Run:
    """The run that the store holds, works on, or was asked for by a name: see ``id_of_run``.  Raises ConfigError."""
    run_id = id_of_run(name, store)
    work = Path(store) / WORK / run_id
    plain = manifest.read(Path(store) / run_id).get("config") or read_json(work / CONFIG)
    if plain:
        return Run(config_from({**plain, "store": str(store)}))
    sweep = next(name for name in record.list_sweeps(store) if run_id in record.read_record(name, store).cells.values())
    for run in record.plan_remembered(sweep, store).runs:
        if run.id == run_id:
            return run
    raise ConfigError(f"'{run_id}' was asked for by the sweep '{sweep}', which has other runs now")


def _made(written: dict) -> Iterator[str]:
    """What made a result, and what it took."""
    yield f"  took {written.get('wall_seconds', 0):.4g} s and at most {written.get('peak_memory_mb', '?')} MB"
    yield f"  made by commit {written.get('git_state')} on {written.get('machine')}"
    yield f"  with {written.get('versions')}"


def _known(store: Path) -> set[str]:
    """Ids of all runs that a store holds, works on, or was asked for."""
    ids = {run_id for name in record.list_sweeps(store) for run_id in record.read_record(name, store).cells.values()}
    for folder in (store, store / WORK):
        if folder.is_dir():
            ids.update(path.name for path in folder.iterdir() if path.is_dir() and not path.name.startswith("."))
    return ids - {record.SWEEPS}
