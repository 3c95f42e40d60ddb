"""Run the tiers of checks; each check gives a finding."""

import dataclasses
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import Diverged, RunsFailed
from . import baseline, cases, ensemble, fingerprints, horizon, invariances, verdicts
from .baseline import Baseline
from .finding import FAILED, MOVED, NOT_MEASURED, TIERS, Finding
from .uses import find_experiments, find_one_experiment

PAPER_SEEDS = 3  # of what a full check simulates at the fidelity of the paper


@dataclass(frozen=True)
class CheckRequest:
    """What to check.

    ``baseline``: folder of the references; ``store``: for the runs of tiers 3 and 4, which are repeated where code or
    environment changed, ``workers`` at a time (0: as many as cores); ``full``: more seeds, and Figure 5 at the paper's
    fidelity; ``cases``: of tiers 1 and 2; ``experiments``: of tiers 3 and 4.  Raises ConfigError where there is none.
    """

    baseline: Path
    store: str
    tiers: Collection[int] = tuple(TIERS)
    full: bool = False
    workers: int = 0
    cases: Collection[str] = tuple(cases.CASES)
    experiments: Sequence[str] = field(default_factory=lambda: find_experiments("coarse"))

    def overrides_for(self, experiment: str, seeds: int, fidelity: str = ensemble.FIDELITY) -> list[str]:
        """Return the overrides for the runs of an experiment."""
        return ensemble.make_overrides(experiment, self.store, seeds, fidelity=fidelity, workers=self.workers)

    def overrides_at_paper_fidelity(self) -> list[str]:
        """Return the overrides for the runs at the paper's fidelity.  Raises ConfigError: see ``CheckRequest``."""
        return self.overrides_for(find_one_experiment("fine"), PAPER_SEEDS, "paper")


def run_checks(request: CheckRequest) -> Iterator[Finding]:
    """Run the requested tiers; yields each finding as soon as it is known.

    A run that fails is a finding.  Raises StoreError where the store cannot be written to or a reference is broken, and
    ConfigError where no one experiment is there to check with.
    """
    start = time.perf_counter()
    for finding in _run_tiers(request, baseline.read_baseline(request.baseline)):
        now = time.perf_counter()
        yield dataclasses.replace(finding, seconds=round(now - start, 1))
        start = now


def _run_tiers(request: CheckRequest, references: Baseline) -> Iterator[Finding]:
    """Run the requested tiers against the references."""
    if 0 in request.tiers:
        yield from (_check_invariance(name, check) for name, check in invariances.CHECKS.items())
    if 1 in request.tiers or 2 in request.tiers:
        yield from _check_short_runs(request, references)
    if 3 in request.tiers or 4 in request.tiers:
        yield from _check_experiments(request, references)


def _check_invariance(name: str, check: Callable[[], Finding]) -> Finding:
    """Run one check of tier 0; a simulation that diverges is a finding under its ``name``."""
    try:
        return check()
    except Diverged as error:
        return Finding(0, name, FAILED, str(error))


def _check_short_runs(request: CheckRequest, references: Baseline) -> Iterator[Finding]:
    """Check the short runs in tiers 1 and 2.

    A case whose bits moved goes on to tier 2 even where that tier was not requested.
    """
    wanted_tiers = [tier for tier in (1, 2) if tier in request.tiers]
    yield from _report_missing_references(references, wanted_tiers)
    tiers = [tier for tier in wanted_tiers if not references.flaw(tier)]
    for case, short_run in cases.compose_short_runs(request.cases).items() if tiers else ():
        try:
            states = cases.observe_run(short_run)
        except Diverged as error:
            yield Finding(max(tiers), case, FAILED, str(error))
            continue
        prints = fingerprints.take_fingerprints(states)
        finding = fingerprints.compare_with_reference(case, prints, references.platforms)
        if 1 in tiers:
            yield finding
        if 2 in tiers or finding.state == MOVED:
            if flaw := references.flaw(2):
                yield Finding(2, case, NOT_MEASURED, flaw)
            else:
                numbers = horizon.tabulate_numbers(states, horizon.find_start(short_run))
                yield horizon.compare_with_reference(case, numbers, references.table("horizon"))


def _check_experiments(request: CheckRequest, references: Baseline) -> Iterator[Finding]:
    """Check the experiments in tiers 3 and 4, which use the same runs."""
    wanted_tiers = [tier for tier in (3, 4) if tier in request.tiers]
    yield from _report_missing_references(references, wanted_tiers)
    tiers = [tier for tier in wanted_tiers if not references.flaw(tier)]
    seeds = ensemble.SEEDS if request.full else ensemble.FEW_SEEDS
    for experiment in request.experiments if tiers else ():
        yield from _check_experiment(references, tiers, experiment, request.overrides_for(experiment, seeds))
    if request.full and 4 in tiers:
        experiment = find_one_experiment("fine")
        yield from _check_experiment(references, [4], experiment, request.overrides_at_paper_fidelity())


def _report_missing_references(references: Baseline, tiers: Collection[int]) -> Iterator[Finding]:
    """Report the tiers that have no reference to compare with, and why."""
    flaws = {tier: references.flaw(tier) for tier in tiers}
    yield from (Finding(tier, TIERS[tier], NOT_MEASURED, flaw) for tier, flaw in flaws.items() if flaw)


def _check_experiment(
    references: Baseline, tiers: Collection[int], experiment: str, overrides: list[str]
) -> Iterator[Finding]:
    """Compare the runs of an experiment with the references, in tiers 3 and 4."""
    try:
        plan = ensemble.run_missing(overrides)
    except RunsFailed as error:
        yield Finding(min(tiers), experiment, FAILED, str(error))
        return
    failures = ensemble.list_failures(plan.runs)
    if failures:
        message = f"{len(failures)} of {len(plan.runs)} runs have no result: {failures[0]}"
        yield from (Finding(tier, experiment, FAILED, message) for tier in tiers)
        return
    if 3 in tiers:
        runs = ensemble.tabulate_runs(experiment, plan)
        yield ensemble.compare_with_reference(experiment, runs, references.table("ensemble"))
    if 4 in tiers:
        judged = verdicts.tabulate_verdicts(experiment, plan)
        yield from verdicts.compare_with_reference(judged, references.table("verdicts"))
