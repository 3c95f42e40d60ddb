"""What the options of ``check`` and ``bless`` ask for."""

import argparse
from collections.abc import Sequence

from ..checks.cases import CASES
from ..checks.check import CheckRequest
from ..checks.finding import TIERS
from ..checks.uses import find_experiments
from ..errors import ConfigError


def read_options(options: argparse.Namespace) -> CheckRequest:
    """What the options ask for.  Raises ConfigError where a name or number is wrong."""
    names, experiments = options.only or (), find_experiments("coarse")
    for name in names:
        if name not in (*CASES, *experiments):
            raise ConfigError(f"there is no '{name}' to check; there are: {', '.join((*CASES, *experiments))}")
    if options.workers < 0:
        raise ConfigError(f"workers: should be at least 1, or 0 for all cores (got {options.workers})")
    return CheckRequest(
        options.baseline, options.store, read_tiers(options.tier), options.full, options.workers,
        [name for name in CASES if name in names] or [*CASES],
        [name for name in experiments if name in names] or experiments,
    )  # fmt: skip


def read_tiers(texts: Sequence[str] | None) -> list[int]:
    """Tiers from texts such as "0,1" or "2"; all where there are none.  Raises ConfigError."""
    names = [name.strip() for text in texts or () for name in text.split(",")]
    for name in names:
        if name not in map(str, TIERS):
            known = ", ".join(f"{tier} {title}" for tier, title in TIERS.items())
            raise ConfigError(f"there is no tier '{name}'; there are: {known}")
    return sorted({int(name) for name in names}) or [*TIERS]
