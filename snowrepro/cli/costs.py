"""Lines on what is to be run and why, and on what it takes."""

from ..store import states
from ..sweep.estimate import Estimate, estimate
from ..sweep.plan import Plan, last_of
from ..sweep.processes import usable_cores
from ..sweep.table import clock
from ..sweep.todo import RUN, SKIP, WAIT, Todo


def estimate_todo(plan: Plan, todo: Todo) -> Estimate:
    """What it takes to run what is to be run of a plan."""
    return estimate((decision.planned.run.case for decision in todo.to_run), plan.runs[0].store)


def describe_todo(plan: Plan, todo: Todo, expected: Estimate) -> list[str]:
    """Lines on what is done, what is to be run and why, and how long it takes."""
    store = plan.runs[0].store
    total = len(todo.decisions)
    lines = [f"{total} run{'s' * (total != 1)}, {todo.count(states.DONE)} of them done, store '{store}'"]
    for action, phrase in ((RUN, "to run"), (WAIT, "to wait for"), (SKIP, "left alone")):
        for why, count in todo.reasons(action).most_common():
            if why != "done":
                lines.append(f"  {phrase}: {count}, {why}")
    for (kind, what), count in todo.stale().most_common(3):
        lines.append(f"  done with other {kind}: {count} ({what}); rerun=[{kind}] runs them again")
    return [*lines, describe_time_left(plan, todo, expected)] if todo.to_run else lines


def describe_time_left(plan: Plan, todo: Todo, expected: Estimate) -> str:
    """A line on how long what is to be run takes."""
    setting = last_of(plan.overrides, "hydra.launcher.workers") or "0"
    at_a_time = int(setting) if setting.isdecimal() else 0
    workers = min(at_a_time or usable_cores(), len(todo.to_run))
    source = f"from {expected.measured} finished runs" if expected.measured else "a guess: no run is finished yet"
    hours, wall = expected.seconds / 3600.0, clock(expected.seconds / workers)
    return f"  about {hours:.2f} core-hours, {wall} with {workers} at a time ({source})"
