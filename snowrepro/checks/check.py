"""Run the tiers, one finding after the other."""

import dataclasses
import time
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..errors import Diverged, RunsFailed
from . import baseline, cases, ensemble, fingerprints, horizon, invariances, verdicts
from .baseline import Baseline
from .finding import FAILED, MOVED, NOT_MEASURED, TIERS, Finding

AT_PAPER_FIDELITY, PAPER_SEEDS = "fig5", 3  # what of a full check is as fine as the paper


@dataclass(frozen=True)
class Asked:
    """What a check is to look at.

    ``baseline``: folder of the references; ``store``: for the runs of tiers 3 and 4, done again where code or
    environment changed, ``workers`` at a time (0: as many as cores).  ``full``: more seeds, and Figure 5 at the paper's
    fidelity.  ``cases``, ``experiments``: that tiers 1 and 2, or 3 and 4, look at.
    """

    baseline: Path
    store: str
    tiers: Collection[int] = tuple(TIERS)
    full: bool = False
    workers: int = 0
    cases: Collection[str] = tuple(cases.CASES)
    experiments: Sequence[str] = ensemble.EXPERIMENTS

    def runs(self, experiment: str, seeds: int, fidelity: str = ensemble.FIDELITY) -> list[str]:
        """The overrides that ask for an experiment's runs."""
        return ensemble.overrides(experiment, self.store, seeds, fidelity=fidelity, workers=self.workers)

    def as_fine_as_the_paper(self) -> list[str]:
        """The overrides of what a full check judges beside."""
        return self.runs(AT_PAPER_FIDELITY, PAPER_SEEDS, "paper")


def check(asked: Asked) -> Iterator[Finding]:
    """The findings of the tiers, as they come.

    Raises the errors of a store that cannot be written to; a run that fails is a finding.
    """
    started = time.perf_counter()
    for found in _findings(asked, baseline.read(asked.baseline)):
        now = time.perf_counter()
        yield dataclasses.replace(found, seconds=round(now - started, 1))
        started = now


def _findings(asked: Asked, kept: Baseline) -> Iterator[Finding]:
    if 0 in asked.tiers:
        yield from (_invariance(made) for made in invariances.CHECKS)
    if 1 in asked.tiers or 2 in asked.tiers:
        yield from _short_runs(asked, kept)
    if 3 in asked.tiers or 4 in asked.tiers:
        yield from _figures(asked, kept)


def _invariance(made) -> Finding:
    try:
        return made()
    except Diverged as error:
        return Finding(0, made.__name__.replace("_", " "), FAILED, str(error))


def _short_runs(asked: Asked, kept: Baseline) -> Iterator[Finding]:
    """Tiers 1 and 2 look at the same runs; a case whose bits moved goes on to tier 2 even if that was not asked for."""
    wanted = [tier for tier in (1, 2) if tier in asked.tiers]
    yield from _without_reference(kept, wanted)
    tiers = [tier for tier in wanted if not kept.flaw(tier)]
    for case, config in cases.configs(asked.cases).items() if tiers else ():
        try:
            states = cases.observe(config)
        except Diverged as error:
            yield Finding(max(tiers), case, FAILED, str(error))
            continue
        print_ = fingerprints.compare(case, fingerprints.take(states), kept.platforms)
        if 1 in tiers:
            yield print_
        if 2 in tiers or print_.state == MOVED:
            if flaw := kept.flaw(2):
                yield Finding(2, case, NOT_MEASURED, flaw)
            else:
                yield horizon.compare(case, horizon.numbers(states, horizon.start_of(config)), kept.table("horizon"))


def _figures(asked: Asked, kept: Baseline) -> Iterator[Finding]:
    """Tiers 3 and 4 look at the same runs."""
    wanted = [tier for tier in (3, 4) if tier in asked.tiers]
    yield from _without_reference(kept, wanted)
    tiers = [tier for tier in wanted if not kept.flaw(tier)]
    seeds = ensemble.SEEDS if asked.full else ensemble.FEW_SEEDS
    for experiment in asked.experiments if tiers else ():
        yield from _figure(kept, tiers, experiment, asked.runs(experiment, seeds))
    if asked.full and 4 in tiers:
        yield from _figure(kept, [4], AT_PAPER_FIDELITY, asked.as_fine_as_the_paper())


def _without_reference(kept: Baseline, tiers: Collection[int]) -> Iterator[Finding]:
    """The tiers that have nothing to compare with, and why."""
    flaws = {tier: kept.flaw(tier) for tier in tiers}
    yield from (Finding(tier, TIERS[tier], NOT_MEASURED, flaw) for tier, flaw in flaws.items() if flaw)


def _figure(kept: Baseline, tiers: Collection[int], experiment: str, wanted: list[str]) -> Iterator[Finding]:
    """An experiment's runs beside the references."""
    try:
        plan = ensemble.run(wanted)
    except RunsFailed as error:
        yield Finding(min(tiers), experiment, FAILED, str(error))
        return
    failed = ensemble.lost(plan.configs)
    if failed:
        told = f"{len(failed)} of {len(plan.configs)} runs have no result: {failed[0]}"
        yield from (Finding(tier, experiment, FAILED, told) for tier in tiers)
        return
    if 3 in tiers:
        yield ensemble.compare(experiment, ensemble.table(experiment, plan), kept.table("ensemble"))
    if 4 in tiers:
        yield from verdicts.compare(verdicts.table(experiment, plan), kept.table("verdicts"))
