"""Entry point: which verbs there are, and how each ends."""

import argparse
import gc
import importlib
import os
import signal
import sys
from collections.abc import Sequence
from difflib import get_close_matches

from ..errors import ExitCode, SnowreproError
from ..text import make_printable
from .arguments import split_folders
from .deferred import deferred_imports
from .surroundings import prepare_process

# Each is a file in verbs/, of which only that of the verb that is called is imported.
VERBS = {
    "run": "simulate one run, a sweep or an experiment",
    "sample": "a sweep over points of ranges, by a design",
    "search": "find where a measure reaches a target, or is best",
    "claims": "decide the paper's claims by an experiment with several seeds",
    "plan": "say what would be run, why, and how long it takes",
    "status": "how far sweeps are",
    "retry": "run again what failed",
    "report": "one page with verdicts, pictures and data, from the store alone",
    "plot": "a picture of any two columns of a sweep's table",
    "sensitivity": "which setting of a sweep matters most, and where runs fail",
    "crate": "a folder to publish: a sweep's files, and how each was made",
    "check": "are results what they were, and as promised?",
    "bless": "renew the references of check",
    "explain": "why a run is done, stale, failed or not run; what a name means",
    "diff": "what differs between two runs or two sweeps",
    "redo": "do a run again from its manifest: same bits?",
    "clean": "remove what is not needed from the store",
    "config": "print the configuration that the overrides give",
    "classify": "lumps, crushed and loose snow of a run or any particles",
    "point": "one point of a material along a path, or checks of its law",
    "animate": "an mp4 or gif of a run, or of several side by side",
    "completion": "print a script that lets a shell complete this program's words",
}

with deferred_imports():  # of which a help needs nothing
    from .. import compiler
    from . import completion, folders, screen, versions


def main(arguments: Sequence[str] | None = None) -> None:
    """Do what a command line says, by default that of this process; exits with an ``ExitCode``."""
    prepare_process()
    if "_ARGCOMPLETE" in os.environ:  # a shell asks what can follow
        completion.print_candidates(build_parser(completion.read_typed_words()))
    words = sys.argv[1:] if arguments is None else arguments
    if not words:
        build_parser(words).print_help()
        sys.exit(int(ExitCode.FINE))
    code = _execute(*read_command_line(words))
    if arguments is None:
        if code == ExitCode.FINE:  # else it may have been stopped in the middle of one
            compiler.keep_kernels()
        gc.freeze()  # else Python looks through all that was imported before it ends, for half a second
    sys.exit(int(code))


def read_command_line(words: Sequence[str]) -> tuple[argparse.Namespace, list[str]]:
    """What a command line asks for, and its words that name a folder by an override; exits where it cannot be read."""
    others, named = split_folders(words)
    parser = build_parser(others)
    _require_verb(others, parser)
    options, rest = parser.parse_known_args(others)
    if named:
        rest += folders.list_strange(options, named)
    if rest and ("overrides" not in options or any(word.startswith("-") for word in rest)):
        is_option = "overrides" in options and any(word.startswith("--") for word in rest)
        hint = "; a setting is written as in fidelity=preview" * is_option
        options.parser.error(f"unrecognized arguments: {' '.join(rest)}{hint}")
    if rest:
        options.overrides += rest  # argparse stops at an option between overrides
    return options, named


def _require_verb(words: Sequence[str], parser: argparse.ArgumentParser) -> None:
    """Exit with a short message where the first word is no verb: argparse would list all of them in one line."""
    verb = next((word for word in words if not word.startswith("-")), None)
    if verb is not None and verb not in VERBS:
        near = get_close_matches(verb, VERBS, n=1)
        hint = f"did you mean '{near[0]}'?" if near else "'snowrepro --help' lists what there is"
        parser.error(f"'{make_printable(verb)}' is no command; {hint}")


def build_parser(words: Sequence[str] | None = None) -> argparse.ArgumentParser:
    """The parser of a command line: all verbs, with the arguments of the one that ``words`` call, or else of all."""
    parser = argparse.ArgumentParser(
        prog="snowrepro",
        description='Reproduce "Snow Simulation Considering Pressure Sintering", in two dimensions as the paper does.',
    )
    parser.add_argument("--version", action=_PrintVersion, nargs=0, help="print the version and exit")
    verbs = parser.add_subparsers(required=True, metavar="command")
    called = VERBS if words is None else [word for word in words if not word.startswith("-")][:1]
    for verb, summary in VERBS.items():
        verb_parser = verbs.add_parser(
            verb, help=summary, description=summary, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        if verb in called:
            with deferred_imports():
                module = importlib.import_module(f".verbs.{verb}", __package__)
            verb_parser.epilog = module.HELP
            module.add_arguments(verb_parser)
            verb_parser.set_defaults(execute=module.execute, parser=verb_parser)
    return parser


def _execute(options: argparse.Namespace, named: Sequence[str]) -> ExitCode:
    """Do what the verb does, in the folders that are ``named``; returns the exit code, and says what went wrong."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a batch system's end is as orderly as Ctrl-C
    try:
        folders.settle_folders(options, named)
        code: ExitCode = options.execute(options)
        sys.stdout.flush()
    except BrokenPipeError:  # whoever read, has read enough
        _print_no_more()
        code = ExitCode.FINE
    except KeyboardInterrupt:
        screen.say("interrupted; what was finished is kept, the same command goes on from the last frame kept")
        code = ExitCode.INTERRUPTED
    except OSError as error:  # a disk or a screen that takes no more, or a file that is not there any more
        screen.say(f"error: {error.filename or 'standard output'}: {error.strerror or error}")
        if not error.filename:
            _print_no_more()
        code = ExitCode.USAGE
    except SnowreproError as error:
        screen.say(f"error: {error}")
        code = error.exit_code
    return code


def _print_no_more() -> None:
    """Send what is still to be printed to nowhere: to fail again at the end would be another exit code."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class _PrintVersion(argparse.Action):
    """Like argparse's own, but looks the version up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        """Print the version and exit."""
        print(versions.read_version())
        parser.exit()
