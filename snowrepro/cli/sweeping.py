"""What verbs do with the runs of a plan: run what is missing, and require that all have results."""

import shlex
import time
from collections.abc import Sequence

from ..errors import ConfigError, ExitCode, RunsFailed, StoreError
from ..evidence.collect import CSV, find_varied_columns, write_results
from ..report.figures.kinds import needs_runs
from ..store import states
from ..store.files import require_writable
from ..store.folders import require_own_folders
from ..summary.row import read_row
from ..sweep import record, todo
from ..sweep.launch import launch
from ..sweep.plan import Plan
from ..sweep.table import clock
from .costs import describe_todo, estimate_todo
from .screen import say

MOST_NAMED = 5  # runs without a result, at the end of a sweep


def run_missing(plan: Plan, is_whole: bool = True) -> None:
    """Run what is not done of a sweep, which the store then remembers if it ``is_whole``.

    A sweep that is refused is not remembered, unless it was before.  Raises ConfigError, RunsFailed, StoreError.
    """
    require_own_folders(plan.runs[0].store)
    require_writable(plan.runs[0].store)
    decided = todo.decide(plan)
    expected = estimate_todo(plan, decided)
    for line in describe_todo(plan, decided, expected):
        say(line)
    is_new = is_whole and record.name_sweep(plan.overrides) not in record.list_sweeps(plan.runs[0].store)
    if is_whole:
        record.write_record(plan)
    if decided.to_run:
        started = time.monotonic()
        try:
            launch(plan, [decision.planned for decision in decided.to_run], expected.memory_mb)
        except ConfigError:
            if is_new:
                record.forget_record(plan)
            raise
        say(_describe_cost(plan, len(decided.to_run), time.monotonic() - started))


def write_table(plan: Plan) -> None:
    """Put the table of a sweep's numbers beside its record; where that cannot be, say so."""
    try:
        write_results(plan)
    except StoreError as error:
        say(f"no table of results: {error}")


def describe_sweep(plan: Plan) -> list[str]:
    """Lines on how a sweep is called, where its table is, and what can be done with it next."""
    name = record.name_sweep(plan.overrides)
    table = record.locate_sweep(name, plan.runs[0].store) / CSV
    store = [word for word in plan.overrides if word.startswith("store=")]
    measure = "hardness" if all(run.case.indenter for run in plan.runs) else "lump_fraction"
    x, *colours = _choose_axes(plan)
    colour = [f"colour={colours[0]}"] if colours else []
    commands = [
        ["snowrepro", "report", name, *store],
        ["snowrepro", "plot", name, f"x={x}", f"y={measure}", *colour, *store],
    ]
    if plan.sample:
        commands.insert(1, ["snowrepro", "sensitivity", name, *store])
    lines = [f"sweep: {name}", *([f"table: {table}"] if table.exists() else [])]
    return [*lines, *(f"next:  {shlex.join(words)}" for words in commands)]


def _choose_axes(plan: Plan) -> Sequence[str]:
    """The columns to draw a sweep over, the first a number if there is any; seeds only where nothing else varies."""
    varied = find_varied_columns(plan)
    names = [name for name in varied if name != "seed"]
    numbers = [name for name in names if all(map(_is_number, varied[name]))]
    return list(dict.fromkeys([*numbers[:1], *names])) or [*varied] or ["pressure"]


def _is_number(value: object) -> bool:
    """Whether a value of a column is a number, or the text of one."""
    try:
        float(str(value))
    except ValueError:
        return False
    return True


def require_results(plan: Plan) -> ExitCode:
    """Fine if every run of a plan has a result.  Raises RunsFailed with the reasons if one has none."""
    if not needs_runs(plan.runs):
        return ExitCode.FINE
    pairs = zip(plan.runs, states.standings(plan.runs), strict=True)
    missing = [(run, standing) for run, standing in pairs if standing.state != states.DONE]
    if not missing:
        return ExitCode.FINE
    reasons = "; ".join(f"{run.id}: {standing.state}: {standing.reason}" for run, standing in missing[:MOST_NAMED])
    more = f"; and {len(missing) - MOST_NAMED} more" if len(missing) > MOST_NAMED else ""
    log = plan.runs[0].store / "sweep.log"
    raise RunsFailed(f"{len(missing)} of {len(plan.runs)} runs have no result (more in {log}): {reasons}{more}")


def _describe_cost(plan: Plan, computed: int, wall_seconds: float) -> str:
    """A line on how long a sweep took, and how much computing is in all its results."""
    seconds = sum(read_row(run)["seconds"] for run in plan.runs if run.is_done())
    return f"wall time {clock(wall_seconds)} for {computed} runs; {seconds / 3600:.3f} core-hours in all runs asked for"
