"""Commands on what is to be run: ``run``, ``claims``, ``plan``, ``status``, ``retry``."""

import argparse
import logging
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from ..config import Config
from ..errors import ConfigError, ExitCode, RunsFailed, StoreError
from ..store import states
from ..store.files import require_writable
from ..sweep.plan import (
    Plan,
    Planned,
    last_of,
    make_claims_plan,
    make_plan,
    read_part,
    split_seeds,
    split_store,
    with_seeds,
)
from .screen import console, print_rows, say

if TYPE_CHECKING:
    from ..sweep.estimate import Estimate
    from ..sweep.todo import Todo

MOST_TOLD = 5  # failed runs, at the end of a sweep
MOST_LISTED = 20  # of a state, in a status


def run_command(options: argparse.Namespace) -> ExitCode:
    """Validate everything, run what is not done, then report from the store."""
    part = read_part(options.part) if options.part else None
    plan = asked_for(options.overrides, options.multirun, part)
    if not plan.runs:
        say("this part of the sweep has no runs")
        return ExitCode.FINE
    _check_scenes(plan)
    if part:
        _run_missing(plan, is_whole=False)
        return _require_results(plan)
    if not plan.needs_runs:
        return _report(plan)
    if plan.is_sweep:
        _run_missing(plan)
        _write_results(plan)
        return _report(plan)
    require_writable(plan.configs[0].store)
    _run_one(plan.configs[0])
    return ExitCode.FINE


def claims_command(options: argparse.Namespace) -> ExitCode:
    """Run what is not done of an experiment with several seeds, then judge the claims from the store."""
    seeds, overrides = split_seeds(options.overrides)
    seeds = options.default_seeds if seeds is None else seeds
    plan = make_claims_plan(overrides, seeds)
    from ..report.claims import screen
    from .reports import written

    _check_scenes(plan)
    _run_missing(plan)
    _write_results(plan)
    part, page = written(plan)
    print("\n".join(screen(part.evidence)))
    print(f"report: {page}")
    return _require_results(plan)


def plan_command(options: argparse.Namespace) -> ExitCode:
    """Say what would be run and why, without running anything."""
    from ..sweep import batch, todo

    plan = _sweep(options.overrides, options.multirun)
    decided = todo.decide(plan, options.verify)
    for line in _plan_lines(plan, decided, _expected(plan, decided)):
        print(line)
    if options.list:
        for decision in decided.decisions:
            detail = f" ({decision.detail})" if decision.detail and decision.detail != decision.why else ""
            print(f"{decision.action:4}  {_id(decision.planned)}: {decision.why}{detail}")
    if options.sbatch:
        batch.write_script(options.sbatch, plan, decided, options.tasks)
        print(f"sbatch {options.sbatch}")
    return ExitCode.FINE


def status_command(options: argparse.Namespace) -> ExitCode:
    """Say how far one sweep is, or all that the store remembers."""
    from ..sweep import record, todo

    store, words = split_store(options.overrides)
    if not words:
        return _all_sweeps(store)
    plan = _sweep(options.overrides, options.multirun)
    decided = todo.decide(plan, options.verify)
    print(f"{record.name_of(plan.overrides)}: {_counts(decided)}")
    for state in states.STATES:
        found = [d for d in decided.decisions if d.standing.state == state]
        told = found if options.list else found[:MOST_LISTED] if state not in (states.DONE, states.PENDING) else []
        for decision in told:
            print(f"{state:11}  {_id(decision.planned)}: {decision.standing.reason}")
        if told and len(told) < len(found):
            print(f"{state:11}  and {len(found) - len(told)} more: --list")
    if decided.to_run:
        print(_time_left(plan, decided, _expected(plan, decided)))
    return ExitCode.FINE


def retry_command(options: argparse.Namespace) -> ExitCode:
    """Forget the failures of a run or a sweep, and run it again."""
    from ..store import runs
    from ..sweep import record
    from ..sweep.explain import config_of_run

    store, words = split_store(options.overrides)
    named = words[:1] and "=" not in words[0] and words[0] not in record.names(store)
    plan = None if named else _sweep(options.overrides, options.multirun)
    configs = plan.configs if plan else [config_of_run(words[0], store)]
    failed = [c for c in configs if states.standing(c).state in (states.FAILED, states.TIMED_OUT)]
    say(f"{len(failed)} failed before")
    for config in failed:
        runs.forget_outcome(config)
    if plan is None:
        _run_one(configs[0])
        return ExitCode.FINE
    _run_missing(plan)
    return _require_results(plan)


def asked_for(overrides: Sequence[str], multirun: bool, part: tuple[int, int] | None = None) -> Plan:
    """The plan of a command line, with seeds=N written out.  Raises ConfigError."""
    seeds, others = split_seeds(overrides)
    if seeds is not None:
        return make_plan(with_seeds(others, seeds), True, part)
    return make_plan(others, multirun, part)


def _sweep(overrides: Sequence[str], multirun: bool) -> Plan:
    """The plan of a sweep that is named, or described by overrides; of what has no runs there is none."""
    from ..sweep import record

    store, words = split_store(overrides)
    if words and words[0] in record.names(store):
        return record.plan_of(words[0], store, words[1:])
    if words and "=" not in words[0]:
        record.read(words[0], store)  # says which there are
    plan = asked_for(overrides, multirun)
    if not plan.needs_runs:
        raise ConfigError(f"experiment '{plan.configs[0].experiment.name}' has no runs")
    return plan


def _run_missing(plan: Plan, is_whole: bool = True) -> None:
    """Run what is not done of a sweep, which the store then remembers if it ``is_whole``."""
    from ..sweep import record, todo
    from ..sweep.launch import launch

    require_writable(plan.configs[0].store)
    decided = todo.decide(plan)
    expected = _expected(plan, decided)
    for line in _plan_lines(plan, decided, expected):
        say(line)
    if is_whole:
        record.write(plan)
    if decided.to_run:
        started = time.monotonic()
        launch(plan, [d.planned for d in decided.to_run], expected.memory_mb)
        _say_cost(plan, len(decided.to_run), time.monotonic() - started)


def _write_results(plan: Plan) -> None:
    """Put the table of a sweep's numbers beside its record; where that cannot be, the rest goes on."""
    from ..sweep.collect import write_results

    try:
        write_results(plan)
    except StoreError as error:
        say(f"no table of results: {error}")


def _expected(plan: Plan, decided: "Todo") -> "Estimate":
    """What it takes to run what is to be run."""
    from ..sweep.estimate import estimate

    return estimate((decision.planned.config for decision in decided.to_run), plan.configs[0].store)


def _plan_lines(plan: Plan, decided: "Todo", expected: "Estimate") -> list[str]:
    """What is done, what is to be run and why, and how long it takes."""
    from ..sweep.todo import RUN, SKIP, WAIT

    store = plan.configs[0].store
    total = len(decided.decisions)
    lines = [f"{total} run{'s' * (total != 1)}, {decided.count(states.DONE)} of them done, store '{store}'"]
    for action, verb in ((RUN, "to run"), (WAIT, "to wait for"), (SKIP, "left alone")):
        for why, count in decided.reasons(action).most_common():
            if why != "done":
                lines.append(f"  {verb}: {count}, {why}")
    for (kind, what), count in decided.stale().most_common(3):
        lines.append(f"  done with other {kind}: {count} ({what}); rerun=[{kind}] runs them again")
    return [*lines, _time_left(plan, decided, expected)] if decided.to_run else lines


def _counts(decided: "Todo") -> str:
    """How many runs are in each state."""
    return ", ".join(f"{decided.count(state)} {state}" for state in states.STATES if decided.count(state))


def _time_left(plan: Plan, decided: "Todo", expected: "Estimate") -> str:
    """How long what is to be run takes, in a line."""
    from ..sweep.processes import usable_cores
    from ..sweep.table import clock

    asked = last_of(plan.overrides, "hydra.launcher.workers") or "0"
    at_a_time = int(asked) if asked.isdecimal() else 0
    workers = min(at_a_time or usable_cores(), len(decided.to_run))
    source = f"from {expected.measured} finished runs" if expected.measured else "a guess: no run is finished yet"
    hours, wall = expected.seconds / 3600.0, clock(expected.seconds / workers)
    return f"  about {hours:.2f} core-hours, {wall} with {workers} at a time ({source})"


def _all_sweeps(store: str) -> ExitCode:
    """A line for each sweep that the store remembers."""
    from ..sweep import record, todo

    names = record.names(store)
    if not names:
        say(f"the store '{store}' remembers no sweep")
    for name in names:
        found = record.read(name, store)
        try:
            decided = todo.decide(record.plan_of(name, store))
            print(f"{name}: {_counts(decided)}; asked for {found.recorded}")
        except ConfigError as error:  # its options were renamed or are another folder's
            print(f"{name}: cannot be planned any more: {error}")
    return ExitCode.FINE


def _check_scenes(plan: Plan) -> None:
    """Build each different scene once.  Raises ConfigError where one cannot be."""
    from ..scene.build import build_scene

    def scene(config: Config) -> tuple:
        return config.shape, config.floor, config.fidelity, config.reading, config.indenter

    for config in {scene(config): config for config in plan.configs}.values():
        build_scene(config)


def _say_cost(plan: Plan, computed: int, wall_seconds: float) -> None:
    """How long a sweep took, and how much computing is in its results."""
    from ..analysis.summary import row_of
    from ..store import runs
    from ..sweep.table import clock

    seconds = sum(row_of(config)["seconds"] for config in plan.configs if runs.is_done(config))
    say(f"wall time {clock(wall_seconds)} for {computed} runs; {seconds / 3600:.3f} core-hours in all runs asked for")


def _run_one(config: Config) -> None:
    """Run one case and print its numbers."""
    from ..analysis.summary import row_of

    path = run_here(config)
    print_rows(row_of(config))
    print(path)


def run_here(config: Config) -> Path:
    """Run one case in this process with a progress bar, as far as it is not done; returns its result's path."""
    from ..run import run
    from ..store.runs import is_current

    done = is_current(config)
    if done:
        say("this run is done")
    else:
        logging.getLogger("snowrepro").addHandler(_console_log())
    columns = (TextColumn("frame {task.completed:.0f}/{task.total:.0f}"), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=done or not console.is_terminal) as bar:
        task = bar.add_task("run", total=config.frames)
        return run(config, lambda progress: bar.update(task, completed=progress.frame))


def _report(plan: Plan) -> ExitCode:
    """Write the experiment's report, or list the runs of a plain sweep.  Raises RunsFailed if any is missing."""
    from ..store import runs
    from .reports import print_report

    if plan.configs[0].experiment:
        print_report(plan.overrides, plan.configs[0].store)
    else:
        for config in plan.configs:
            if runs.is_done(config):
                _print_line(config)
    return _require_results(plan)


def _require_results(plan: Plan) -> ExitCode:
    """Fine if every run has a result.  Raises RunsFailed with the reasons if one has none."""
    found = zip(plan.configs, states.standings(plan.configs), strict=True)
    missing = [(config, standing) for config, standing in found if plan.needs_runs and standing.state != states.DONE]
    if not missing:
        return ExitCode.FINE
    from ..store.runs import identify

    told = "; ".join(f"{identify(c)}: {standing.state}: {standing.reason}" for c, standing in missing[:MOST_TOLD])
    more = f"; and {len(missing) - MOST_TOLD} more" if len(missing) > MOST_TOLD else ""
    log = Path(plan.configs[0].store) / "sweep.log"
    raise RunsFailed(f"{len(missing)} of {len(plan.configs)} runs have no result (more in {log}): {told}{more}")


def _print_line(config: Config) -> None:
    """One run of a sweep in one line."""
    from ..analysis.summary import row_of

    row = row_of(config)
    found = f"hardness {row['hardness']:.4g}" if config.indenter else f"mass in lumps {row['lump_fraction']:.3f}"
    print(f"{row['run_id']}: {found}")


def _id(planned: Planned) -> str:
    from ..store.runs import identify

    return identify(planned.config)


def _console_log() -> logging.Handler:
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("%(message)s"))
    handler.addFilter(lambda record: record.levelno < logging.ERROR)  # errors are told once, at the end
    return handler
