"""Overrides that a store remembers: they are data, whoever wrote them down.

A record may choose among settings and options of this program, and nothing else: it can neither have Hydra run code,
nor take values from the environment, nor say where something is read from or written to.  That is for whoever gives
the command.
"""

import re
from collections.abc import Iterator, Sequence
from typing import Any

from hydra.errors import HydraException

from ..errors import ConfigError
from ..settings.case import Case
from ..settings.question import Question
from .hydra_private import OverridesParser, make_parser
from .overrides import prepare_overrides

PLACES = ("store", "reports")  # of folders
# All that a record may say of what runs the jobs: numbers of the launcher on this machine; older ones also which it is.
LOCAL = re.compile(
    r"hydra\.launcher\.(workers|retries)=[0-9]{1,4}|hydra\.launcher\.(memory_gb|time_limit_minutes)=[0-9.]{1,12}"
)
LAUNCHER = re.compile(rf"{LOCAL.pattern}|hydra/launcher=(local|ray|slurm)")
OPTIONS = ("scene", "variant")  # that fill no section of their own name
EXECUTION = ("threads", "deterministic", "checkpoint_seconds", "rerun")
OUTSIDE = re.compile(r"\.\.|\\|(^|[\s,=:\[({'\"])[/~]|://")  # a path to somewhere else


def keep_harmless(overrides: Sequence[str]) -> list[str]:
    """Keep those of a command's overrides that are to be remembered: not where it keeps things, nor what runs it."""
    return [each for each in overrides if LOCAL.fullmatch(each) or _key(each) not in (*PLACES, "hydra")]


def require_harmless(overrides: Sequence[str]) -> None:
    """Check that remembered overrides choose settings and options of this program alone.

    Raises ConfigError that says which does not, and why.
    """
    parser = make_parser()
    for override in overrides:
        if not LAUNCHER.fullmatch(override):
            reason = _find_harm(override, parser)
            if reason:
                raise ConfigError(f"the override '{override[:200]}' {reason}")


def _find_harm(override: str, parser: OverridesParser) -> str:
    """Find why a record may not have an override; empty if it may."""
    if _key(override) in (*PLACES, "hydra"):
        return "is for whoever gives the command, and not for a record to make"
    if "${" in override or "_target_" in override:
        return "has an interpolation or a target, which no record may have"
    try:
        prepare_overrides([override])  # what is too long is not even read
        read = parser.parse_override(override)
    except (ConfigError, HydraException, RecursionError, ValueError):
        return "cannot be read"
    name = read.key_or_group
    if read.package is not None or not re.fullmatch(r"\w+(\.\w+)*", name):
        return "names no setting or option"
    if name.split(".")[0] not in (*Case.model_fields, *Question.model_fields, *EXECUTION, *OPTIONS):
        return "names no setting of this program"
    is_path = "." not in name or any(key in ("file", "defaults") for key in _keys(name, read.value()))
    if is_path and OUTSIDE.search(override.partition("=")[2]):
        return "leads out of the folders of options"
    return ""


def _key(override: str) -> str:
    """The first word of an override's key."""
    return re.split(r"[./=@:]", override.strip().lstrip("+~"), maxsplit=1)[0].strip()


def _keys(name: str, value: Any) -> Iterator[str]:
    """All keys of an override: the last of its own, and those of the dictionaries in its value."""
    yield name.rpartition(".")[2]
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _keys(str(key), inner)
    elif isinstance(value, list):
        for inner in value:
            yield from _keys("", inner)
