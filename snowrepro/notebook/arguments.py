"""Errors that speak of Python's arguments, where the modules below speak of the options of the command line."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

from ..errors import SnowreproError

OPTION = re.compile(r"--([a-z]+(?:-[a-z]+)*)(?: (none|NAME)\b)?")
# Those that are not called alike, and what has another form.
ARGUMENTS = {"id": "particle_id", "from": "start"}
PHRASES = {
    "--out animation.gif": 'format="gif"',
    "lower --fps or raise --speed": "raise speed=",
    "name one with --group": "open one with xarray.open_dataset(path, group=...)",
}


@contextmanager
def naming_arguments() -> Iterator[None]:
    """Within it, errors for a user name arguments: ``speed=`` for --speed, ``particle_id="none"`` for --id none."""
    try:
        yield
    except SnowreproError as error:
        error.args = tuple(name_arguments(part) if isinstance(part, str) else part for part in error.args)
        raise


def name_arguments(message: str) -> str:
    """Write a message with the arguments of Python in the places of options."""
    for phrase, argument in PHRASES.items():
        message = message.replace(phrase, argument)
    return OPTION.sub(_name_argument, message)


def _name_argument(match: re.Match[str]) -> str:
    """Write one option as an argument."""
    name, value = match.groups()
    argument = ARGUMENTS.get(name, name.replace("-", "_"))
    return f'{argument}="{value}"' if value else f"{argument}="
