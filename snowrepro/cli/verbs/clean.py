"""``snowrepro clean``: remove what is not needed from the store."""

import argparse
import sys
from pathlib import Path

from ...errors import ConfigError, ExitCode
from ...store import leftovers
from ...sweep import record
from .. import candidates, screen
from ..arguments import add_store, complete_by

HELP = """\
Shows what could go and how much room it takes; asks before it removes what is named (scraps if nothing is).

  scraps        what killed processes left behind of runs that are done, and the trash
  failed        records and last good states of runs that failed
  unfinished    checkpoints of runs that were stopped
  broken        results that are not as they were written
  unused        results that no remembered sweep asks for
  launchers     logs and scripts of Hydra's launchers
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What is to be removed."""
    kinds = parser.add_argument("kinds", nargs="*", metavar="kind", help="see below")
    complete_by(kinds, lambda **_: candidates.find_kinds(HELP))
    parser.add_argument("--yes", action="store_true", help="do not ask")
    add_store(parser)


def execute(options: argparse.Namespace) -> ExitCode:
    """Show what could go from the store, ask, and remove what was named."""
    store = Path(options.store)
    for kind in options.kinds:
        if kind not in leftovers.KINDS:
            raise ConfigError(f"there is no kind '{kind}' to clean; there are: {', '.join(leftovers.KINDS)}")
    if not store.is_dir():
        raise ConfigError(f"there is no store '{store}'")
    by_kind = _find_leftovers(store)
    for kind, removable in by_kind.items():
        screen.show(f"{kind:11} {len(removable):6}  {_sum_megabytes(removable)}")
    for link in leftovers.links(store):
        screen.say(f"left alone: {link} is a link, and links in a store are not followed")
    chosen = {leftover.path: leftover for kind in options.kinds or ["scraps"] for leftover in by_kind[kind]}
    size = _sum_megabytes([*chosen.values()])
    if not chosen:
        others = [kind for kind, removable in by_kind.items() if removable and not options.kinds]
        screen.say(f"nothing to remove; by name: snowrepro clean {' '.join(others)}" if others else "nothing to remove")
    elif not (options.yes or _confirm(f"remove {len(chosen)} of these, {size}?")):
        screen.say("nothing was removed")
    else:
        for leftover in chosen.values():
            leftover.remove()
        screen.say(f"removed {size}")
    return ExitCode.FINE


def _find_leftovers(store: Path) -> "dict[str, list[leftovers.Leftover]]":
    """What could go, by kind; nothing is unused while a record cannot be read, as it may ask for anything."""
    records, problems = record.read_all(store)
    used = {run_id for each in records for run_id in each.cells.values()}
    by_kind = {kind: leftovers.find(kind, store, used) for kind in leftovers.KINDS}
    for problem in problems:
        screen.say(f"what is unused cannot be told: {problem}")
    return {**by_kind, "unused": []} if problems else by_kind


def _confirm(question: str) -> bool:
    """Whether a person says yes; without one, it is no."""
    if not sys.stdin.isatty():
        screen.say(f"{question} --yes does without asking")
        return False
    return input(f"{question} [y/N] ").strip().lower() in ("y", "yes")


def _sum_megabytes(removable: "list[leftovers.Leftover]") -> str:
    """The room that some of the store takes, with its unit."""
    return f"{sum(leftover.bytes for leftover in removable) / 1e6:,.1f} MB"
