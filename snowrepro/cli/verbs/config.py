"""``snowrepro config``: print the configuration that the overrides give."""

import argparse

from ...errors import ExitCode
from .. import candidates, configuration
from ..arguments import add_folders, complete_by

HELP = ""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which overrides."""
    complete_by(parser.add_argument("overrides", nargs="*"), candidates.list_overrides)
    add_folders(parser, writes_reports=True)


def execute(options: argparse.Namespace) -> ExitCode:
    """Print the composed configuration as YAML."""
    print(configuration.compose_yaml(options.overrides), end="")
    return ExitCode.FINE
