"""Renew the references, for a reason, from code that git knows."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import pandas as pd

from ..errors import ConfigError, RunsFailed
from ..store.provenance import environment, git_changes
from ..sweep.plan import Plan
from . import baseline, cases, ensemble, fingerprints, horizon, verdicts
from .baseline import Baseline
from .check import CheckRequest
from .uses import find_one_experiment

LEAST_LETTERS = 10  # of a reason


def bless(request: CheckRequest, reason: str) -> Iterator[str]:
    """Renew the references of some tiers; yields lines on what changes, part by part.

    Nothing is written before all parts are computed; cases and experiments that are not requested stay as they are.
    Raises ConfigError without a reason or where the code is not as git has it, RunsFailed where a run of the
    references has no result.
    """
    require_reason(reason)
    require_clean()
    references, tiers = baseline.read_baseline(request.baseline), request.tiers
    platforms: dict[str, Any] | None = None
    tables: dict[str, pd.DataFrame] = {}
    changes: dict[str, Sequence[str]] = {}
    if 1 in tiers or 2 in tiers:
        prints, numbers = _observe_short_runs(request.cases, with_twins=2 in tiers)
        if 1 in tiers:
            platforms, changes["fingerprints"] = _renew_prints(references, prints)
        if 2 in tiers:
            changes["horizon"] = horizon.describe_changes(references.table("horizon"), numbers)
            tables["horizon"] = _keep_other_rows(references.table("horizon"), numbers, "case")
        yield from _list_changes(changes, "fingerprints", "horizon")
    if 3 in tiers:
        members = pd.concat([_run_ensemble(name, request) for name in request.experiments], ignore_index=True)
        changes["ensemble"] = ensemble.describe_changes(references.table("ensemble"), members)
        tables["ensemble"] = _keep_other_rows(references.table("ensemble"), members, "experiment")
        yield from _list_changes(changes, "ensemble")
    if 4 in tiers:
        table = pd.concat([*_judge_experiments(request)], ignore_index=True)
        changes["verdicts"] = verdicts.describe_changes(references.table("verdicts"), table)
        tables["verdicts"] = _keep_other_rows(references.table("verdicts"), table, *verdicts.KEYS)
        yield from _list_changes(changes, "verdicts")
    baseline.write_baseline(references, reason, platforms, tables, changes)


def require_reason(reason: str) -> None:
    """Raise ConfigError where a reason is too short to say anything."""
    if len(reason.strip()) < LEAST_LETTERS:
        raise ConfigError(f'a reference is renewed for a reason of at least {LEAST_LETTERS} letters: --reason "..."')


def require_clean() -> None:
    """Raise ConfigError where the code is in no git clone, or differs from its last commit."""
    changed = git_changes(with_new=True)
    if changed is None:
        raise ConfigError("references are made by code that git knows: this is no clone")
    if changed:
        raise ConfigError(f"references are made by code that git knows; commit first: {', '.join(changed[:5])}")


def _keep_other_rows(before: pd.DataFrame, after: pd.DataFrame, *keys: str) -> pd.DataFrame:
    """Add to a renewed table those rows of the old one whose ``keys`` it does not have.

    None where the columns are others now: such rows would have empty cells, and no check could read the file.
    """
    if before.empty or {*before.columns} != {*after.columns}:
        return after
    renewed = pd.MultiIndex.from_frame(after[[*keys]])
    others = before[~pd.MultiIndex.from_frame(before[[*keys]]).isin(renewed)]
    return pd.concat([others, after], ignore_index=True)


def _observe_short_runs(
    names: Collection[str], with_twins: bool
) -> tuple[dict[str, fingerprints.Prints], pd.DataFrame]:
    """Simulate short runs; returns their fingerprints by name, and with ``with_twins`` their reference numbers."""
    prints, numbers = {}, []
    for case, short_run in cases.compose_short_runs(names).items():
        states = cases.observe_run(short_run)
        prints[case] = fingerprints.take_fingerprints(states)
        if with_twins:
            numbers.append(horizon.make_reference(case, short_run, states))
    return prints, pd.concat(numbers, ignore_index=True) if numbers else pd.DataFrame()


def _renew_prints(references: Baseline, prints: dict[str, fingerprints.Prints]) -> tuple[dict, list[str]]:
    """Renew the fingerprints of this platform; returns those of all platforms, and lines on what changed.

    Where bits moved here they moved elsewhere too, so the other platforms' fingerprints are removed.
    """
    own_platform, processor = fingerprints.name_platform(), environment()["processor"]
    before = references.platforms.get(own_platform, {}).get("cases", {})
    moved = [case for case in prints if case in before and prints[case] != before[case]]
    others = {} if moved else {key: content for key, content in references.platforms.items() if key != own_platform}
    new = [case for case in prints if case not in before]
    changed = [f"{', '.join(names)} {how}" for names, how in ((moved, "moved"), (new, "new")) if names]
    lines = [f"{own_platform}: {'; '.join(changed) or 'the same bits'}"]
    gone = [key for key in references.platforms if key != own_platform and key not in others]
    lines += [f"{key}: gone, to be taken there again" for key in gone]
    return {**others, own_platform: {"processor": processor, "cases": {**before, **prints}}}, lines


def _run_ensemble(experiment: str, request: CheckRequest) -> pd.DataFrame:
    """Run an ensemble and its twins, and tabulate their measures."""
    overrides = ensemble.make_overrides(experiment, request.store, ensemble.SEEDS, twins=True, workers=request.workers)
    plan = ensemble.run_missing(overrides)
    _require_results(plan)
    return ensemble.tabulate_runs(experiment, plan)


def _judge_experiments(request: CheckRequest) -> Iterator[pd.DataFrame]:
    """Judge the experiments by the runs of a check and of a full check; yields a table of verdicts for each.

    The experiment at the paper's fidelity is judged too where the request is full.
    """
    sizes = (ensemble.FEW_SEEDS, ensemble.SEEDS)
    plans_to_run = [(name, request.overrides_for(name, seeds)) for name in request.experiments for seeds in sizes]
    if request.full:
        plans_to_run.append((find_one_experiment("fine"), request.overrides_at_paper_fidelity()))
    for experiment, overrides in plans_to_run:
        plan = ensemble.run_missing(overrides)
        _require_results(plan)
        yield verdicts.tabulate_verdicts(experiment, plan)


def _require_results(plan: Plan) -> None:
    """Raise RunsFailed where a run of a plan has no result."""
    failures = ensemble.list_failures(plan.runs)
    if failures:
        raise RunsFailed(
            f"{len(failures)} of {len(plan.runs)} runs have no result, so there is no reference: {failures[0]}"
        )


def _list_changes(changes: Mapping[str, Sequence[str]], *parts: str) -> Iterator[str]:
    """List the changes of some parts, each as "part: line"."""
    yield from (f"{part}: {line}" for part in parts for line in changes.get(part, ()))
