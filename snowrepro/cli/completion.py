"""The shell's questions while someone types; argcomplete asks and answers them, if it is installed."""

import argparse
import os
from typing import Any

from ..errors import ConfigError
from .candidates import list_if_path

try:
    import argcomplete
except ImportError:
    argcomplete = None  # type: ignore[assignment]


def read_typed_words() -> list[str]:
    """The words of the command line that is typed, without the program's name."""
    return os.environ.get("COMP_LINE", "").split()[1:]


def print_candidates(parser: argparse.ArgumentParser) -> None:
    """Give the shell what can stand at the cursor, and exit; nothing if argcomplete is not installed."""
    if argcomplete is None:
        raise SystemExit(1)

    class Finder(argcomplete.CompletionFinder):
        """Completes overrides also behind an option, where argparse, but not ``main``, takes none."""

        def collect_completions(
            self, active_parsers: list[argparse.ArgumentParser], parsed_args: argparse.Namespace, cword_prefix: str
        ) -> list[str]:
            """The words that can stand at the cursor."""
            active: Any = active_parsers[-1]
            if not active.active_actions:
                active.active_actions = [each for each in active._actions if each.dest == "overrides"]  # noqa: SLF001
            return super().collect_completions(active_parsers, parsed_args, cword_prefix)

    complete: Any = Finder()
    complete(parser, always_complete_options=False, default_completer=list_if_path)


def write_script(shell: str) -> str:
    """The script that lets a shell ask this program.  Raises ConfigError if argcomplete is not installed."""
    if argcomplete is None:
        raise ConfigError("completion needs argcomplete: pip install argcomplete")
    return argcomplete.shellcode(["snowrepro"], shell=shell)
