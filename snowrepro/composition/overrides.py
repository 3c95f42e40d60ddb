"""What a user writes on a command line, before Hydra reads it: bounded in length, and folders by their own names.

Hydra's grammar gives a meaning to letters that names of folders have, so a folder is put in quotes here: ``store=`` and
``reports=`` mean the same in every verb, whether or not Hydra ever sees them.
"""

import re
import unicodedata
from collections.abc import Sequence

from hydra.errors import HydraException
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from ..errors import ConfigError
from .hydra_private import OverridesParser

FOLDERS = ("store", "reports")
# Reading takes time with the square of the length: a second for an override that is as long as allowed.
MOST_LETTERS = 5_000
MOST_LETTERS_IN_ALL = 50_000
MOST_NESTED = 20
_REMEDY = "long values belong into a file of the folder conf/"
_MEANT = re.compile(r"(\\*)('|\$\{|$)")  # before these alone a backslash means something in Hydra's quotes


def prepare_overrides(words: Sequence[str]) -> list[str]:
    """Return the overrides as Hydra is to read them, with folders in quotes.

    Raises ConfigError for what would take too long to read, and for several folders in the place of one.
    """
    total = sum(map(len, words))
    if total > MOST_LETTERS_IN_ALL:
        raise ConfigError(f"the overrides have {total:,} letters, at most {MOST_LETTERS_IN_ALL:,} are read: {_REMEDY}")
    for word in words:
        _require_readable(word)
    return [_quote_folder(word) for word in words]


def read_folder(word: str) -> str:
    """Return the folder that an override of ``store`` or ``reports`` names.  Raises ConfigError."""
    (prepared,) = prepare_overrides([word])
    try:
        value = OverridesParser.create().parse_override(prepared).value()
        folder = OmegaConf.create({"folder": value})["folder"]
    except (HydraException, OmegaConfBaseException, ValueError) as error:
        raise ConfigError(f"cannot read '{word}': {error}".splitlines()[0]) from error
    return str(folder)


def override_folder(key: str, folder: str) -> str:
    """Return the override that gives ``key`` the folder of that name, whatever letters it has."""
    return f"{key}='{_MEANT.sub(_escape, folder)}'"


def _escape(found: re.Match[str]) -> str:
    """Double the backslashes before a quote, an interpolation or the end, and add one that takes its meaning away."""
    backslashes, letters = found.groups()
    return 2 * backslashes + ("\\" + letters if letters else "")


def _require_readable(word: str) -> None:
    """Raises ConfigError for a word that is too long or too deeply nested to be read in reasonable time."""
    start = ascii(word[:40])[1:-1] + "..." * (len(word) > 40)
    if any(unicodedata.category(letter) == "Cc" for letter in word):
        raise ConfigError(f"'{start}' has control characters, such as a line break, which no value has")
    if len(word) > MOST_LETTERS:
        raise ConfigError(f"'{start}' has {len(word):,} letters, at most {MOST_LETTERS:,} are read: {_REMEDY}")
    depth = deepest = 0
    for letter in word:
        depth += (letter in "([{") - (letter in ")]}")
        deepest = max(deepest, depth)
    if deepest > MOST_NESTED:
        raise ConfigError(f"'{start}' has {deepest} brackets inside each other, at most {MOST_NESTED} are read")


def _quote_folder(word: str) -> str:
    """Put the folder that a word names in quotes, unless it has some, or is to be looked up by Hydra."""
    key, _, value = word.partition("=")
    if key not in FOLDERS or not value or value[0] in "'\"" or "${" in value:
        return word
    if "," in value:
        raise ConfigError(
            f"{key}: there is one for all runs (got {value}); a name with a comma is written in quotes inside: "
            f"\"{key}='{value}'\""
        )
    return override_folder(key, value)
