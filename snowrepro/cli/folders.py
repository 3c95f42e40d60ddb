"""The folders that a verb uses, written in two ways that mean the same: ``--store FOLDER`` and ``store=FOLDER``."""

import argparse
from collections.abc import Sequence

from ..composition.overrides import FOLDERS, override_folder, read_folder
from ..errors import ConfigError


def list_strange(options: argparse.Namespace, words: Sequence[str]) -> list[str]:
    """Those of ``words`` (``store=...``) that name a folder which the verb does not use."""
    return [word for word in words if not _has_overrides(options) and word.partition("=")[0] not in options]


def settle_folders(options: argparse.Namespace, words: Sequence[str]) -> None:
    """Put the folders that options and ``words`` (``store=...``) name where the verb looks for them.

    That is among its overrides, if it hands these to Hydra, and else in its options.  Raises ConfigError where both
    name a folder, and not the same.
    """
    for key in FOLDERS:
        written = [word for word in words if word.startswith(f"{key}=")]
        option = getattr(options, key, None)
        _require_one(key, option, written)
        if _has_overrides(options):
            options.overrides += written or ([override_folder(key, option)] if option else [])
        elif key in options:
            setattr(options, key, read_folder(written[-1]) if written else option)
    if "store" in options:
        options.store = options.store or options.default_store


def _has_overrides(options: argparse.Namespace) -> bool:
    """Whether a verb hands its overrides to Hydra, folders with them."""
    return getattr(options, "has_overrides", False)


def _require_one(key: str, option: str | None, written: Sequence[str]) -> None:
    """Raises ConfigError where a folder is given in both ways, and differently."""
    if option and written and option != read_folder(written[-1]):
        raise ConfigError(f"two folders are given: --{key} {option} and {written[-1]}; leave out one of them")
