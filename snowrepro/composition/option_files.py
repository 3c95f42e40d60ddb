"""The user's files of options: what is wrong with one, and whether it is small enough to be read."""

import functools
from collections.abc import Iterator
from pathlib import Path

import yaml
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from ..errors import ConfigError
from .experiments import CONF_DIR, OWN_DIR, list_own_experiments
from .messages import describe_file_error, list_causes

MOST_BYTES = 1_000_000
MOST_VALUES = 10_000  # with what anchors repeat


def describe_broken_file(error: Exception) -> str:
    """Say in which of the user's files, where and why reading failed with ``error``; empty if it was in none."""
    causes = list_causes(error)
    broken = [(path, flaw) for path in _list_files() if (flaw := _try_to_read(path))]
    alike = [(path, flaw) for path, flaw in broken if type(flaw) in map(type, causes)]
    same = [(path, flaw) for path, flaw in alike if str(flaw) in map(str, causes)]  # with the file's path, in most
    return next((describe_file_error(path, flaw) for path, flaw in (*same, *alike)), "")


def _try_to_read(path: Path) -> Exception | None:
    """Read a file as Hydra does; returns what went wrong."""
    try:
        OmegaConf.to_container(OmegaConf.load(path.resolve()), resolve=True)
    except (yaml.YAMLError, OmegaConfBaseException, ValueError, OSError, RecursionError) as error:
        return error
    return None


def require_small_files() -> None:
    """Raises ConfigError if one of the user's files would take too much time or memory to be read."""
    for path in _list_files():
        try:
            status = path.stat()
        except OSError:
            continue  # Hydra says so, if it is used
        _require_small(path, status.st_size, status.st_mtime_ns)


@functools.lru_cache(maxsize=1024)
def _require_small(path: Path, size: int, _changed: int) -> None:
    """Raises ConfigError if a file is too large, or says too much by repeating what it has."""
    if size > MOST_BYTES:
        raise ConfigError(f"{path} has {size:,} bytes, at most {MOST_BYTES:,} are read")
    try:
        node = yaml.compose(path.read_text(encoding="utf-8"), Loader=yaml.SafeLoader)
    except (OSError, ValueError, yaml.YAMLError, RecursionError):
        return  # Hydra says so, if it is used
    count = _count_values(node, {})
    if count > MOST_VALUES:
        raise ConfigError(f"{path} has {count:,} values with what its anchors repeat, at most {MOST_VALUES:,} are read")


def _count_values(node: yaml.Node | None, known: dict[int, int]) -> int:
    """Count the values below a node, those that an anchor repeats each time; ``known`` keeps the count of each node."""
    if not isinstance(node, yaml.CollectionNode):
        return 1
    if id(node) not in known:
        known[id(node)] = MOST_VALUES + 1  # what holds itself has no end
        inner = node.value if isinstance(node, yaml.SequenceNode) else [each for pair in node.value for each in pair]
        known[id(node)] = 1 + sum(_count_values(each, known) for each in inner)
    return known[id(node)]


def _list_files() -> Iterator[Path]:
    """The files in the user's folders that can be options: one or two folders deep, as the built-in ones."""
    if OWN_DIR.is_dir() and OWN_DIR.resolve() != CONF_DIR:
        for pattern in ("*.yaml", "*/*.yaml", "*/*/*.yaml"):
            yield from (path for path in sorted(OWN_DIR.glob(pattern)) if path.is_file())
    yield from list_own_experiments()
