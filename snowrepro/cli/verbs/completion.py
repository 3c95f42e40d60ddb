"""``snowrepro completion``: print a script that lets a shell complete this program's words."""

import argparse

from ...errors import ExitCode
from .. import completion

HELP = """\
With it, Tab completes verbs and options; overrides, by the files in conf/; names of the sweeps that the store
remembers, and ids of its runs.  The script asks the program that is typed, so an update needs no new one.

examples:
  snowrepro completion bash > ~/.local/share/bash-completion/completions/snowrepro
  snowrepro completion zsh > ~/.zfunc/_snowrepro           with fpath+=(~/.zfunc) before compinit in ~/.zshrc
  snowrepro completion fish > ~/.config/fish/completions/snowrepro.fish
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which shell."""
    parser.add_argument("shell", choices=("bash", "zsh", "fish"), help="that is to complete")


def execute(options: argparse.Namespace) -> ExitCode:
    """Print the script that lets a shell ask this program."""
    print(completion.write_script(options.shell))
    return ExitCode.FINE
