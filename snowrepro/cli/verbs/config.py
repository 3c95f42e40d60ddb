"""``snowrepro config``: print the configuration that the overrides give."""

import argparse

from ...errors import ExitCode
from .. import candidates, configuration
from ..arguments import complete_by

HELP = ""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which overrides."""
    complete_by(parser.add_argument("overrides", nargs="*"), candidates.list_overrides)


def execute(options: argparse.Namespace) -> ExitCode:
    """Print the composed configuration as YAML."""
    print(configuration.compose_yaml(options.overrides), end="")
    return ExitCode.FINE
