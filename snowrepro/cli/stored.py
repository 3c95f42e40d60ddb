"""Commands on what the store holds: ``explain``, ``diff``, ``redo``, ``clean``."""

import argparse
import sys
from pathlib import Path

from ..errors import ConfigError, ExitCode
from ..store import leftovers
from ..sweep import record
from .screen import say


def explain_command(options: argparse.Namespace) -> ExitCode:
    """Say where a run stands and why, with its log."""
    from ..sweep.explain import explain

    print("\n".join(explain(options.run, options.store)))
    return ExitCode.FINE


def diff_command(options: argparse.Namespace) -> ExitCode:
    """Say what differs between two runs or two sweeps."""
    from ..sweep.differences import diff_command_lines

    print("\n".join(diff_command_lines(options.a, options.b, options.store)))
    return ExitCode.FINE


def redo_command(options: argparse.Namespace) -> ExitCode:
    """Do a run again from its manifest and say whether it came to the same bits."""
    from ..sweep import redo
    from .sweeps import run_here

    original = redo.original_of(options.run, options.store)
    if Path(options.into).resolve() == Path(options.store).resolve():
        raise ConfigError(f"'{options.into}' is the store, in which nothing is to be replaced: choose another folder")
    config = redo.config_to_redo(original, options.into)
    run_here(config)
    found = redo.compare(original, config)
    print("\n".join(redo.redo_lines(found)))
    if not found.is_compared:
        return ExitCode.INCOMPLETE
    return ExitCode.REGRESSED if found.changes else ExitCode.FINE


def clean_command(options: argparse.Namespace) -> ExitCode:
    """Show what could go from the store, ask, and remove what was named."""
    store = Path(options.store)
    for kind in options.kinds:
        if kind not in leftovers.KINDS:
            raise ConfigError(f"there is no kind '{kind}' to clean; there are: {', '.join(leftovers.KINDS)}")
    if not store.is_dir():
        raise ConfigError(f"there is no store '{store}'")
    asked_for = {run_id for name in record.names(store) for run_id in record.read(name, store).cells.values()}
    found = {kind: leftovers.find(kind, store, asked_for) for kind in leftovers.KINDS}
    for kind, there in found.items():
        print(f"{kind:11} {len(there):6}  {_megabytes(there)}")
    chosen = {left.path: left for kind in options.kinds or ["scraps"] for left in found[kind]}
    if not chosen:
        say("nothing to remove")
        return ExitCode.FINE
    if not (options.yes or _agreed(f"remove {len(chosen)} of these, {_megabytes(list(chosen.values()))}?")):
        say("nothing was removed")
        return ExitCode.FINE
    for left in chosen.values():
        left.remove()
    say(f"removed {_megabytes(list(chosen.values()))}")
    return ExitCode.FINE


def _agreed(question: str) -> bool:
    """Whether a person says yes; without one, it is no."""
    if not sys.stdin.isatty():
        say(f"{question} --yes does without asking")
        return False
    return input(f"{question} [y/N] ").strip().lower() in ("y", "yes")


def _megabytes(found: list[leftovers.Leftover]) -> str:
    return f"{sum(left.bytes for left in found) / 1e6:,.1f} MB"
