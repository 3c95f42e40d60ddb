"""What of a sweep is to be run, and why."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from ..errors import ConfigError, StoreError
from ..store import manifest, states
from ..store.run import Run
from ..store.states import Standing
from . import record
from .plan import Plan, Planned

RUN, WAIT, SKIP = "run", "wait", "skip"
# What a run that has no result and is not worked on is to be run for.
WHY = {
    states.PENDING: "never run",
    states.INTERRUPTED: "interrupted",
    states.TIMED_OUT: "timed out",
    states.FAILED: "failed, and may not fail again",
    states.BROKEN: "its result is broken",
}


@dataclass(frozen=True, slots=True)
class Decision:
    """What is to become of one run.  ``why``: the kind of reason, the same for many runs; ``detail``: of this one."""

    planned: Planned
    standing: Standing
    action: str
    why: str
    detail: str = ""


@dataclass(frozen=True)
class Todo:
    """The decisions on all runs of a sweep."""

    decisions: Sequence[Decision]

    @cached_property
    def to_run(self) -> list[Decision]:
        """Those to be started, or to be waited for in case whoever works on them dies."""
        return [decision for decision in self.decisions if decision.action != SKIP]

    def count(self, state: str) -> int:
        """How many runs are in a state."""
        return self._states[state]

    def reasons(self, *actions: str) -> Counter[str]:
        """How many runs are decided on for which reason."""
        return Counter(decision.why for decision in self.decisions if decision.action in actions)

    def stale(self) -> Counter[tuple[str, str]]:
        """By what finished runs that are left alone are older than what would make them now: kind and difference."""
        left = (decision.standing.stale for decision in self.decisions if decision.action == SKIP)
        return Counter(item for stale in left for item in stale.items())

    @cached_property
    def _states(self) -> Counter[str]:
        return Counter(decision.standing.state for decision in self.decisions)


def decide(plan: Plan, thorough: bool = False) -> Todo:
    """Decide on every run of a sweep, from the disk alone; a run that two cells share is decided on once."""
    before = _cells_before(plan)
    decided, decisions = set(), []
    for planned, standing in zip(plan.planned, states.standings(plan.runs, thorough), strict=True):
        run_id = planned.run.id
        if run_id not in decided:
            decided.add(run_id)
            earlier = before.get(" ".join(planned.overrides), run_id)
            decisions.append(_decide(planned, standing, None if earlier == run_id else earlier))
    return Todo(decisions)


def _decide(planned: Planned, standing: Standing, earlier: str | None) -> Decision:
    """``earlier``: the id of another run that this cell of the sweep was before."""
    if standing.state == states.DONE:
        chosen = {kind: standing.stale[kind] for kind in planned.run.config.execution.rerun if kind in standing.stale}
        if not chosen:
            return Decision(planned, standing, SKIP, "done", standing.reason)
        return Decision(planned, standing, RUN, f"{' and '.join(chosen)} changed", "; ".join(chosen.values()))
    if standing.state == states.RUNNING:
        return Decision(planned, standing, WAIT, "running", standing.reason)
    if standing.final:
        return Decision(planned, standing, SKIP, "failed, and would fail again", standing.reason)
    if standing.state == states.PENDING and earlier:
        changes = _changed(planned.run, earlier)
        if changes:
            return Decision(planned, standing, RUN, "configuration changed since this sweep was last run", changes)
    return Decision(planned, standing, RUN, WHY[standing.state], standing.reason)


def _cells_before(plan: Plan) -> Mapping[str, str]:
    """Which run each cell was when the sweep was recorded last."""
    name, store = record.name_sweep(plan.overrides), plan.runs[0].store
    try:
        return record.read_record(name, store).cells
    except (ConfigError, StoreError):  # there is none, or what is there is none
        return {}


def _changed(run: Run, earlier: str) -> str:
    """What differs between a run and another of its store, in the configuration."""
    before = manifest.read(run.store / earlier).get("config")
    return ", ".join(manifest.differences(before, run.config.record())) if before else ""
