"""The commands ``report`` and ``crate``, and what others print of a report."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import ConfigError, ExitCode
from ..sweep import record
from ..sweep.plan import Plan, make_plan, split_seeds, split_store, with_seeds

if TYPE_CHECKING:
    from ..report.page import Part

PAPER = "paper"


def report_command(options: argparse.Namespace) -> ExitCode:
    """Write a report from the store alone: of the whole paper, or of one experiment."""
    store, words = split_store(options.overrides)
    name = words.pop(0) if words and ("=" not in words[0] or words[0] in record.names(store)) else ""
    if options.against:
        return _compare(name, words, options.against, store, options.against_store or store)
    named = any(word.startswith("experiment=") for word in words)
    if name == PAPER or not (name or named):
        from ..report.paper import write_paper

        if any(word.startswith(("seeds=", "seed=")) for word in words):
            raise ConfigError("the report on the paper shows every seed that was asked for: leave out the seeds")
        print(f"report: {write_paper([*words, record.store_override(store)], store)}")
        return ExitCode.FINE
    print_report(overrides_of(name, words, store), store)
    return ExitCode.FINE


def crate_command(options: argparse.Namespace) -> ExitCode:
    """Write a sweep or a run as an RO-Crate."""
    from ..report.crate import terms, write_crate
    from .screen import say

    stated = terms(options.license, options.agent, options.orcid)
    out = options.out or Path(f"{Path(options.sweep).name}-crate")
    lacking = write_crate(options.sweep, options.store, out, stated)
    if lacking:
        say(f"without a result: {lacking}")
    print(out)
    return ExitCode.FINE


def _compare(name: str, words: Sequence[str], against: str, store: str, other_store: str) -> ExitCode:
    """Two sweeps side by side; further overrides hold for both."""
    from ..report.compare import write_comparison

    if not name:
        raise ConfigError(f"what is '{against}' to be set beside? snowrepro report A --against {against}")
    plans = []
    for sweep, kept in ((name, store), (against, other_store)):
        overrides = record.with_asked_seeds(overrides_of(sweep, words, kept), kept)
        plans.append(make_plan(overrides, multirun=True))
        if plans[-1].configs[0].experiment is None or not plans[-1].needs_runs:
            raise ConfigError(f"'{sweep}' is no experiment with runs: there is nothing to compare")
    print(f"report: {write_comparison(*plans)}")
    return ExitCode.FINE


def overrides_of(name: str, more: Sequence[str], store: str) -> list[str]:
    """The overrides of a sweep by its name, or that of its experiment, and what is written behind it."""
    seeds, others = split_seeds(more)
    if name:
        known = name in record.names(store)
        others = [*(record.read(name, store).overrides if known else [f"experiment={name}"]), *others]
    others.append(record.store_override(store))
    return with_seeds(others, seeds) if seeds is not None else others


def print_report(overrides: Sequence[str], store: str) -> None:
    """Write the report of an experiment, with every seed that it was asked for with, and say what it comes to."""
    asked = record.with_asked_seeds(overrides, store)
    plan = make_plan(asked, multirun=True)
    if plan.configs[0].experiment is None:
        raise ConfigError("a report is of an experiment, for example experiment=fig5")
    part, page = written(plan)
    print(f"verdict: {part.findings.verdict}")
    print(f"report: {page}")


def written(plan: Plan) -> "tuple[Part, Path]":
    """Write the report of an experiment's runs; returns what it shows, and its page."""
    from ..report import choices
    from ..report.page import draw, write_page_of

    part = draw(plan.configs, plan.overrides)
    judged = part.evidence.experiment.is_judged
    return part, write_page_of(part, [choices.section(plan.overrides, plan.configs[0].store)] if judged else ())
