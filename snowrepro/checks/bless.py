"""Renew the references, for a reason, from code that git knows."""

from collections.abc import Collection, Iterator

import pandas as pd

from ..errors import ConfigError, RunsFailed
from ..store.provenance import environment, git_changes
from ..sweep.plan import Plan
from . import baseline, cases, ensemble, fingerprints, horizon, verdicts
from .baseline import Baseline
from .check import AT_PAPER_FIDELITY, Asked

LEAST_LETTERS = 10  # of a reason


def bless(asked: Asked, reason: str) -> Iterator[str]:
    """Renew the references of some tiers; yields what changes, part by part, as it is found.

    Nothing is written before all of it is there; cases and experiments that are not asked for stay as they are.
    Raises ConfigError without a reason or where the code is not as git has it, RunsFailed where a run of the
    references has no result.
    """
    require_reason(reason)
    require_clean()
    kept, tiers = baseline.read(asked.baseline), asked.tiers
    platforms, tables, changes = None, {}, {}
    if 1 in tiers or 2 in tiers:
        prints, numbers = _short_runs(asked.cases, with_twins=2 in tiers)
        if 1 in tiers:
            platforms, changes["fingerprints"] = _with_prints(kept, prints)
        if 2 in tiers:
            changes["horizon"] = horizon.changes(kept.table("horizon"), numbers)
            tables["horizon"] = _beside_others(kept.table("horizon"), numbers, "case")
        yield from _told(changes, "fingerprints", "horizon")
    if 3 in tiers:
        members = pd.concat([_members(name, asked) for name in asked.experiments], ignore_index=True)
        changes["ensemble"] = ensemble.changes(kept.table("ensemble"), members)
        tables["ensemble"] = _beside_others(kept.table("ensemble"), members, "experiment")
        yield from _told(changes, "ensemble")
    if 4 in tiers:
        found = pd.concat([*_verdicts(asked)], ignore_index=True)
        changes["verdicts"] = verdicts.changes(kept.table("verdicts"), found)
        tables["verdicts"] = _beside_others(kept.table("verdicts"), found, *verdicts.KEYS)
        yield from _told(changes, "verdicts")
    baseline.write(kept, reason, platforms, tables, changes)


def require_reason(reason: str) -> None:
    """Raises ConfigError where a reason says nothing."""
    if len(reason.strip()) < LEAST_LETTERS:
        raise ConfigError(f'a reference is renewed for a reason of at least {LEAST_LETTERS} letters: --reason "..."')


def require_clean() -> None:
    """Raises ConfigError where the code is in no clone, or not as its last commit has it."""
    changed = git_changes(with_new=True)
    if changed is None:
        raise ConfigError("references are made by code that git knows: this is no clone")
    if changed:
        raise ConfigError(f"references are made by code that git knows; commit first: {', '.join(changed[:5])}")


def _beside_others(before: pd.DataFrame, after: pd.DataFrame, *keys: str) -> pd.DataFrame:
    """A renewed table with those rows of the old one whose ``keys`` it does not have."""
    if before.empty:
        return after
    renewed = pd.MultiIndex.from_frame(after[[*keys]])
    others = before[~pd.MultiIndex.from_frame(before[[*keys]]).isin(renewed)]
    return pd.concat([others, after], ignore_index=True)


def _short_runs(names: Collection[str], with_twins: bool) -> tuple[dict[str, fingerprints.Prints], pd.DataFrame]:
    prints, numbers = {}, []
    for case, config in cases.configs(names).items():
        states = cases.observe(config)
        prints[case] = fingerprints.take(states)
        if with_twins:
            numbers.append(horizon.reference(case, config, states))
    return prints, pd.concat(numbers, ignore_index=True) if numbers else pd.DataFrame()


def _with_prints(kept: Baseline, prints: dict[str, fingerprints.Prints]) -> tuple[dict, list[str]]:
    """All platforms' fingerprints, those of this one renewed.

    Where bits moved here they did elsewhere: what the other platforms had is gone.
    """
    here, processor = fingerprints.platform_key(), environment()["processor"]
    before = kept.platforms.get(here, {}).get("cases", {})
    moved = [case for case in prints if case in before and prints[case] != before[case]]
    others = {} if moved else {key: told for key, told in kept.platforms.items() if key != here}
    new = [case for case in prints if case not in before]
    changed = [f"{', '.join(names)} {how}" for names, how in ((moved, "moved"), (new, "new")) if names]
    told = [f"{here}: {'; '.join(changed) or 'the same bits'}"]
    gone = [key for key in kept.platforms if key != here and key not in others]
    told += [f"{key}: gone, to be taken there again" for key in gone]
    return {**others, here: {"processor": processor, "cases": {**before, **prints}}}, told


def _members(experiment: str, asked: Asked) -> pd.DataFrame:
    """The runs of an ensemble and their twins."""
    wanted = ensemble.overrides(experiment, asked.store, ensemble.SEEDS, twins=True, workers=asked.workers)
    plan = ensemble.run(wanted)
    _require_results(plan)
    return ensemble.table(experiment, plan)


def _verdicts(asked: Asked) -> Iterator[pd.DataFrame]:
    """The verdicts that a check compares with, and those of a full one if they are asked for."""
    sizes = (ensemble.FEW_SEEDS, ensemble.SEEDS)
    wanted = [(name, asked.runs(name, seeds)) for name in asked.experiments for seeds in sizes]
    if asked.full:
        wanted.append((AT_PAPER_FIDELITY, asked.as_fine_as_the_paper()))
    for experiment, overrides in wanted:
        plan = ensemble.run(overrides)
        _require_results(plan)
        yield verdicts.table(experiment, plan)


def _require_results(plan: Plan) -> None:
    failed = ensemble.lost(plan.configs)
    if failed:
        raise RunsFailed(
            f"{len(failed)} of {len(plan.configs)} runs have no result, so there is no reference: {failed[0]}"
        )


def _told(changes: dict[str, list[str]], *parts: str) -> Iterator[str]:
    yield from (f"{part}: {line}" for part in parts for line in changes.get(part, ()))
