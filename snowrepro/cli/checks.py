"""Commands ``check`` and ``bless``."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import ConfigError, ExitCode
from ..store.files import require_writable
from .screen import say

if TYPE_CHECKING:
    from ..checks.check import Asked


def check_command(options: argparse.Namespace) -> ExitCode:
    """Run the tiers, tell each finding as it comes, and write what others read."""
    from ..checks import outputs
    from ..checks.check import check
    from ..checks.finding import exit_code

    asked = _asked(options)
    out = options.out or Path("reports/mutants" if options.mutants else "reports/check")
    for folder in (out, Path(options.store)):
        require_writable(folder)
    if options.mutants:
        return _try_mutants(options, out)
    findings = []
    for found in check(asked):
        findings.append(found)
        outputs.write(findings, _about(options), out, finished=False)
        say(outputs.line(found))
    outputs.write(findings, _about(options), out)
    print("\n".join([*outputs.text(findings), "", outputs.verdict(findings)]))
    say(f"written: {', '.join(str(out / name) for name in outputs.FILES)}")
    return exit_code(findings)


def _try_mutants(options: argparse.Namespace, out: Path) -> ExitCode:
    """Show deliberate changes of the program to the tiers, and tell what was noticed."""
    from ..checks import mutants
    from ..sweep.processes import usable_cores

    chosen = mutants.read_list()
    trials = []
    workers = options.workers or usable_cores()
    for trial in mutants.try_all(chosen, options.baseline, Path(options.store), options.full, workers):
        trials.append(trial)
        say(f"[{len(trials)}/{len(chosen)}] {trial.verdict}: {trial.mutant.name} {trial.problem}")
    mutants.write(trials, _about(options), out)
    print("\n".join(mutants.text(trials)))
    say(f"written: {out}")
    return mutants.exit_code(trials)


def bless_command(options: argparse.Namespace) -> ExitCode:
    """Renew references, and say what that changes."""
    from ..checks.baseline import LOG
    from ..checks.bless import bless

    asked = _asked(options)
    for folder in (options.baseline, Path(options.store)):
        require_writable(folder)
    for line in bless(asked, options.reason or ""):
        print(line, flush=True)
    say(f"renewed {options.baseline}, see {options.baseline / LOG}; commit it")
    return ExitCode.FINE


def read_tiers(texts: Sequence[str] | None) -> list[int]:
    """Tiers from texts such as "0,1" or "2"; all where there are none.  Raises ConfigError."""
    from ..checks.finding import TIERS

    named = [name.strip() for text in texts or () for name in text.split(",")]
    for name in named:
        if name not in map(str, TIERS):
            told = ", ".join(f"{tier} {title}" for tier, title in TIERS.items())
            raise ConfigError(f"there is no tier '{name}'; there are: {told}")
    return sorted({int(name) for name in named}) or [*TIERS]


def _asked(options: argparse.Namespace) -> "Asked":
    """What the options ask for.  Raises ConfigError where a name or number is wrong."""
    from ..checks.cases import CASES
    from ..checks.check import Asked
    from ..checks.ensemble import EXPERIMENTS

    names = options.only or ()
    for name in names:
        if name not in (*CASES, *EXPERIMENTS):
            raise ConfigError(f"there is no '{name}' to check; there are: {', '.join((*CASES, *EXPERIMENTS))}")
    if options.workers < 0:
        raise ConfigError(f"workers: should be at least 1, or 0 for all cores (got {options.workers})")
    return Asked(
        options.baseline, options.store, read_tiers(options.tier), options.full, options.workers,
        [name for name in CASES if name in names] or [*CASES],
        [name for name in EXPERIMENTS if name in names] or [*EXPERIMENTS],
    )  # fmt: skip


def _about(options: argparse.Namespace) -> dict[str, str]:
    from ..store.provenance import provenance

    return {"full": str(options.full).lower(), "baseline": str(options.baseline), **provenance()}
