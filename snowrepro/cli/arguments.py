"""Arguments and words of the help that several verbs share."""

import argparse
from collections.abc import Callable, Iterable
from pathlib import Path

EXITS = "exit codes: 0 fine, 2 bad input (config, folder), 3 runs failed, 130 interrupted"
SWEEP = "name of a remembered sweep, or the overrides that make one"


def add_multirun(parser: argparse.ArgumentParser) -> None:
    """Hydra's option for a sweep."""
    parser.add_argument("-m", "--multirun", action="store_true", help="the overrides name several runs")


def add_verify(parser: argparse.ArgumentParser) -> None:
    """Whether results are trusted by their sizes."""
    parser.add_argument("--verify", action="store_true", help="read all results, and not just their sizes and times")


def add_no_report(parser: argparse.ArgumentParser) -> None:
    """Whether the report is left for later."""
    parser.add_argument("--no-report", action="store_true", help="draw no report: 'snowrepro report' can do it later")


def add_store(parser: argparse.ArgumentParser) -> None:
    """Where the runs are."""
    parser.add_argument("--store", default="runs", help="folder that keeps the runs (default: %(default)s)")


def add_checked(parser: argparse.ArgumentParser) -> None:
    """What ``check`` looks at, and ``bless`` renews."""
    parser.add_argument("--tier", action="append", metavar="N", help="only these tiers, such as 0,1 (default: all)")
    parser.add_argument(
        "--only", action="append", metavar="NAME", help="a short run of tiers 1 and 2, or a figure of tiers 3 and 4"
    )
    parser.add_argument("--workers", type=int, default=0, metavar="N", help="processes at a time (default: all cores)")
    parser.add_argument(
        "--baseline", type=Path, default=Path("reports/baseline"), metavar="FOLDER",
        help="that keeps the references (default: %(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--store", default="check-runs", metavar="FOLDER", help="that keeps the runs (default: %(default)s)"
    )


def complete_by(action: argparse.Action, list_candidates: Callable[..., Iterable[str]]) -> None:
    """Let the words that a function of ``candidates`` lists complete an argument."""
    action.completer = list_candidates  # type: ignore[attr-defined]  # argcomplete looks for it there
