"""Arguments and words of the help that several verbs share."""

import argparse
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

EXITS = "exit codes: 0 fine, 2 bad input (config, folder), 3 runs failed, 130 interrupted"
SWEEP = "name of a remembered sweep (an experiment's: its newest), or the overrides that make one"


DEFAULT_STORE = "runs"
FOLDERS = ("store=", "reports=")  # what else names a folder: see ``folders``


def add_multirun(parser: argparse.ArgumentParser) -> None:
    """Hydra's option for a sweep."""
    parser.add_argument("-m", "--multirun", action="store_true", help="the overrides name several runs")


def add_needless_multirun(parser: argparse.ArgumentParser) -> None:
    """The same where several runs need no word, so that the words of 'snowrepro run' can be repeated."""
    parser.add_argument("-m", "--multirun", action="store_true", help="may stand here as in 'run -m'; changes nothing")


def add_verify(parser: argparse.ArgumentParser) -> None:
    """Whether results are trusted by their sizes."""
    parser.add_argument("--verify", action="store_true", help="read all results, and not just their sizes and times")


def add_part(parser: argparse.ArgumentParser) -> None:
    """Which part of a sweep is run."""
    parser.add_argument(
        "--part", metavar="I/N", help="only every N-th run from the I-th on, and no report: for job arrays"
    )


def add_no_report(parser: argparse.ArgumentParser) -> None:
    """Whether the report is left for later."""
    parser.add_argument("--no-report", action="store_true", help="draw no report: 'snowrepro report' can do it later")


def add_store(
    parser: argparse.ArgumentParser, default: str = DEFAULT_STORE, what: str = "folder that keeps the runs"
) -> None:
    """Where the runs are; ``folders`` puts the default in its place."""
    parser.add_argument("--store", metavar="FOLDER", help=f"{what} (default: {default}); also: store=FOLDER")
    parser.set_defaults(default_store=default)


def add_folders(parser: argparse.ArgumentParser, writes_reports: bool = False) -> None:
    """Where the runs are, and where reports go, for a verb whose overrides are Hydra's."""
    add_store(parser)
    if writes_reports:
        add_reports(parser)
    parser.set_defaults(has_overrides=True)


def add_reports(parser: argparse.ArgumentParser) -> None:
    """Where reports are."""
    parser.add_argument("--reports", metavar="FOLDER", help="folder that keeps the reports; also: reports=FOLDER")


def split_folders(words: Sequence[str]) -> tuple[list[str], list[str]]:
    """The words of a command line without those that name a folder by an override, and these."""
    return [word for word in words if not word.startswith(FOLDERS)], [w for w in words if w.startswith(FOLDERS)]


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
    add_store(parser, "check-runs")


def complete_by(action: argparse.Action, list_candidates: Callable[..., Iterable[str]]) -> None:
    """Let the words that a function of ``candidates`` lists complete an argument."""
    action.completer = list_candidates  # type: ignore[attr-defined]  # argcomplete looks for it there
