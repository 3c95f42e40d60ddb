"""``snowrepro status``: how far one sweep is, or all that the store remembers."""

import argparse

from ...errors import ConfigError, ExitCode, StoreError
from ...store import states
from ...sweep import plan as sweep_plan
from ...sweep import record, todo
from .. import candidates, costs, plans, screen
from ..arguments import SWEEP, add_folders, add_needless_multirun, add_verify, complete_by

MOST_LISTED = 20  # runs of a state
HELP = """\
Without a name: every sweep that the store remembers.

examples:
  snowrepro status
  snowrepro status grid
  snowrepro status experiment=grid fidelity=preview store=/shared/runs
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which sweep, and how much is to be said of it."""
    add_needless_multirun(parser)
    parser.add_argument("--list", action="store_true", help="every run of a sweep with its state")
    add_verify(parser)
    overrides = parser.add_argument("overrides", nargs="*", help=SWEEP)
    complete_by(overrides, candidates.any_of(candidates.list_sweeps, candidates.list_overrides))
    add_folders(parser)


def execute(options: argparse.Namespace) -> ExitCode:
    """Say how far one sweep is, or all that the store remembers."""
    store, words = sweep_plan.split_store(options.overrides)
    if not words:
        if options.list:
            raise ConfigError(
                "--list: name a sweep, as in 'snowrepro status grid --list'; 'snowrepro status' names all"
            )
        return _print_all_sweeps(store)
    plan = plans.plan_sweep(options.overrides, multirun=True)
    decided = todo.decide(plan, options.verify)
    screen.show(f"{record.name_sweep(plan.overrides)}: {_count_states(decided)}")
    for state in states.STATES:
        _print_runs(decided, state, options.list)
    if decided.to_run:
        screen.show(costs.describe_time_left(plan, decided, costs.estimate_todo(plan, decided)))
    return ExitCode.FINE


def _print_all_sweeps(store: str) -> ExitCode:
    """Print a line for each sweep that the store remembers."""
    names = record.list_sweeps(store)
    if not names:
        screen.say(f"the store '{store}' remembers no sweep")
    for name in names:
        try:
            recorded = record.read_record(name, store).recorded
            decided = todo.decide(record.plan_remembered(name, store))
            screen.show(f"{name}: {_count_states(decided)}; asked for {recorded}")
        except (ConfigError, StoreError) as error:  # its options were renamed, are another folder's, or it is no record
            screen.show(f"{name}: cannot be planned any more: {error}")
    return ExitCode.FINE


def _print_runs(decided: "todo.Todo", state: str, wants_all: bool) -> None:
    """Print the runs in a state and why they are; else the first of those that need a look."""
    decisions = [decision for decision in decided.decisions if decision.standing.state == state]
    needs_look = state not in (states.DONE, states.PENDING)
    listed = decisions if wants_all else decisions[:MOST_LISTED] if needs_look else []
    for decision in listed:
        screen.show(f"{state:11}  {decision.planned.run.id}: {decision.standing.reason}")
    if listed and len(listed) < len(decisions):
        screen.show(f"{state:11}  and {len(decisions) - len(listed)} more: --list")


def _count_states(decided: "todo.Todo") -> str:
    """How many runs are in each state, in a phrase."""
    return ", ".join(f"{decided.count(state)} {state}" for state in states.STATES if decided.count(state))
