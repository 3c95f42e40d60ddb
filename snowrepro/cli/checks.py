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

    tiers, experiments = read_tiers(options.tier), _read_experiments(options.only)
    out = options.out or Path("reports/mutants" if options.mutants else "reports/check")
    for folder in (out, Path(options.store)):
        require_writable(folder)
    if options.mutants:
        return _try_mutants(options, out)
    findings = []
    for found in check(Asked(options.baseline, options.store, tiers, options.full, options.workers, experiments)):
        say(outputs.line(found))
        findings.append(found)
        outputs.write(findings, _about(options), out, finished=False)
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


def _read_experiments(texts: Sequence[str] | None) -> Sequence[str]:
    """The experiments of tiers 3 and 4.  Raises ConfigError."""
    from ..checks.ensemble import EXPERIMENTS

    for name in texts or ():
        if name not in EXPERIMENTS:
            raise ConfigError(f"tiers 3 and 4 have no '{name}'; they have: {', '.join(EXPERIMENTS)}")
    return texts or EXPERIMENTS


def _about(options: argparse.Namespace) -> dict[str, str]:
    from ..store.provenance import provenance

    return {"full": str(options.full).lower(), "baseline": str(options.baseline), **provenance()}
