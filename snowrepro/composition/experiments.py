"""The experiments that there are: what their files say of them, without composing a run."""

import functools
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from ..errors import ConfigError
from .messages import describe_file_error

FOLDER = "experiment"
_PACKAGE = Path(__file__).resolve().parents[1]
# An installed wheel carries conf/ inside the package; a clone has it beside.
OWN_DIR = Path("conf")  # of the user's own options, in the working directory
OWN_EXPERIMENTS = Path("experiments")  # likewise, for experiments alone
HEADER = b"# @package _global_"  # without it in its first bytes a file is none of ours
HEADER_BYTES = 512
CONF_DIR = _PACKAGE / "conf" if (_PACKAGE / "conf").is_dir() else _PACKAGE.parent / "conf"


def read_experiments() -> dict[str, dict[str, Any]]:
    """The ``experiment`` section of each experiment's file, by the file's name; the user's own beside the built-in."""
    folders = dict.fromkeys(path.resolve() for path in (CONF_DIR / FOLDER, OWN_DIR / FOLDER) if path.is_dir())
    paths: dict[str, Path] = {}
    for path in (*(path for folder in folders for path in sorted(folder.glob("*.yaml"))), *list_own_experiments()):
        paths.setdefault(path.stem, path)  # as with Hydra, of two files of one name the first counts
    return {name: _read(path, path.stat().st_mtime_ns) for name, path in paths.items()}


def find_own_experiments() -> Path | None:
    """The user's folder ``experiments``; None if there is none, or it is the program's own or that in ``conf``."""
    folder = OWN_EXPERIMENTS.resolve()
    is_known = folder in ((CONF_DIR / FOLDER).resolve(), (OWN_DIR / FOLDER).resolve())
    return folder if folder.is_dir() and not is_known else None


def list_own_experiments() -> list[Path]:
    """The experiments in the user's folder of that name, which may hold other files too."""
    folder = find_own_experiments()
    return [OWN_EXPERIMENTS / path.name for path in sorted(folder.glob("*.yaml")) if _is_ours(path)] if folder else []


def _is_ours(path: Path) -> bool:
    """Whether a file begins as an experiment does."""
    try:
        with path.open("rb") as file:
            return HEADER in file.read(HEADER_BYTES)
    except OSError:
        return False


def list_in_paper_order() -> list[str]:
    """The experiments that the report on the paper has, in its order."""
    orders = {name: section.get("order") for name, section in read_experiments().items()}
    placed = {name: float(order) for name, order in orders.items() if order is not None}
    return sorted(placed, key=lambda name: placed[name])


def studies() -> dict[str, str]:
    """The experiments that make one choice of another otherwise at a time, in the paper's order, and that other."""
    experiments = read_experiments()
    return {name: varied for name in list_in_paper_order() if (varied := experiments[name].get("varies"))}


def checked(use: str) -> list[str]:
    """The experiments whose runs ``snowrepro check`` uses in a way: see ``Experiment.checks``."""
    return sorted(name for name, section in read_experiments().items() if use in section.get("checks", ()))


def variants_of(overrides: Sequence[str]) -> dict[str, dict[str, Any]]:
    """The variants that an experiment among ``overrides`` has, in order; none without one."""
    names = [text.removeprefix("experiment=") for text in overrides if text.startswith("experiment=")]
    section = read_experiments().get(names[-1], {}) if names else {}
    return section.get("variants") or {}


def all_variants(overrides: Sequence[str]) -> dict[str, dict[str, Any]]:
    """The variants of all experiments; where two have one of the same name, that of the experiment asked for counts."""
    variants: dict[str, dict[str, Any]] = {}
    for section in read_experiments().values():
        variants |= section.get("variants") or {}
    return variants | variants_of(overrides)


def require_one_choice(variants: Mapping[str, Mapping[str, Any]], params: Collection[str]) -> None:
    """Check that no variant chooses what its experiment's sweep chooses too, whose choice would win.

    ``params``: the keys that the sweep gives values to.  Raises ConfigError.
    """
    for name, variant in variants.items():
        both = sorted(set(_list_choices(variant)) & set(params))
        if both:
            raise ConfigError(
                f"experiment.variants.{name}: {', '.join(both)} is chosen by hydra.sweeper.params too, which would "
                "win: leave it out of one of them"
            )


def _list_choices(variant: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    """List the keys that a variant gives values to, and the groups of which it chooses an option."""
    for key, value in variant.items():
        if key == "defaults" and not prefix:
            groups = [str(group) for entry in value if isinstance(entry, Mapping) for group in entry]
            yield from (group.partition("/")[2] for group in groups)  # "override /sintering"
        elif isinstance(value, Mapping):
            yield from _list_choices(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}"


@functools.lru_cache(maxsize=256)
def _read(path: Path, _changed: int) -> dict[str, Any]:
    """The ``experiment`` section of a file, as it was when last changed; empty if it has none."""
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ConfigError(describe_file_error(path, error)) from error
    section = content.get("experiment") if isinstance(content, dict) else None
    return section if isinstance(section, dict) else {}
