"""Commands ``check`` and ``bless``."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from ..errors import ConfigError, ExitCode
from ..store.files import require_writable
from .screen import say


def check_command(options: argparse.Namespace) -> ExitCode:
    """Run the tiers, tell each finding as it comes, and write what others read."""
    from ..checks import outputs
    from ..checks.check import Asked, check
    from ..checks.finding import exit_code

    tiers = read_tiers(options.tier)
    for folder in (options.out, Path(options.store)):
        require_writable(folder)
    if options.mutants:
        return _try_mutants(options)
    findings = []
    asked = Asked(options.baseline, options.store, tiers, options.full, options.workers)
    for found in check(asked):
        say(outputs.line(found))
        findings.append(found)
        outputs.write(findings, _about(options), options.out, finished=False)
    outputs.write(findings, _about(options), options.out)
    print("\n".join([*outputs.text(findings), "", outputs.verdict(findings)]))
    say(f"written: {', '.join(str(options.out / name) for name in outputs.FILES)}")
    return exit_code(findings)


def _try_mutants(options: argparse.Namespace) -> ExitCode:
    """Show deliberate changes of the program to the tiers, and tell what was noticed."""
    from ..checks import mutants
    from ..sweep.processes import usable_cores

    chosen = mutants.read_list()
    kept = Path(options.store) / "mutants"
    trials = []
    for trial in mutants.try_all(chosen, options.baseline, kept, options.full, options.workers or usable_cores()):
        trials.append(trial)
        say(f"[{len(trials)}/{len(chosen)}] {trial.verdict}: {trial.mutant.name} {trial.problem}")
    mutants.write(trials, _about(options), options.mutants_out)
    print("\n".join(mutants.text(trials)))
    say(f"written: {options.mutants_out}")
    return mutants.exit_code(trials)


def bless_command(options: argparse.Namespace) -> ExitCode:
    """Renew references, and say what that changes."""
    from ..checks.baseline import LOG
    from ..checks.bless import bless

    for folder in (options.baseline, Path(options.store)):
        require_writable(folder)
    for line in bless(
        options.baseline, options.store, options.reason or "", [t for t in read_tiers(options.tier) if t]
    ):
        print(line)
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


def _about(options: argparse.Namespace) -> dict[str, str]:
    from ..store.provenance import provenance

    return {"full": str(options.full).lower(), "baseline": str(options.baseline), **provenance()}
