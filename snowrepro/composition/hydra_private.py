"""All that is used of Hydra beyond what it promises: names that the next version may move.

``tests/composition/test_hydra_private.py`` fails first when one has.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from hydra._internal.callbacks import Callbacks
from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra._internal.config_repository import CachingConfigRepository
from hydra._internal.core_plugins.basic_sweeper import BasicSweeper
from hydra._internal.core_plugins.file_config_source import FileConfigSource
from hydra._internal.hydra import Hydra
from hydra.core.config_store import ConfigStore
from hydra.core.default_element import ConfigDefault
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import (
    ChoiceSweep,
    IntervalSweep,
    Override,
    OverrideType,
    RangeSweep,
    Sweep,
    Transformer,
)
from hydra.core.utils import JobReturn
from hydra.types import HydraContext
from omegaconf import DictConfig, OmegaConf

from .ranges import CHOICE, LOG, WHOLE, check_log, check_whole
from .spacing import SPACINGS, Number

__all__ = [
    "CachingConfigRepository", "ConfigDefault", "ConfigLoaderImpl", "FileConfigSource", "IntervalSweep", "Override",
    "OverrideType", "OverridesParser", "RangeSweep", "as_text", "context_of", "forget_hydra", "has_list_in_list",
    "initialised_hydra", "is_range", "is_sampled", "jobs_of", "loader_of_options", "make_parser", "offer_options",
    "option_repository", "result_of",
]  # fmt: skip

_offered: dict[tuple[str, str], tuple[Mapping[str, Any], Any]] = {}  # what ``offer_options`` stored, and as what


def forget_hydra() -> None:
    """Let Hydra be initialised again."""
    GlobalHydra.instance().clear()


def initialised_hydra() -> Hydra:
    """The Hydra that ``initialize_config_dir`` made."""
    hydra = GlobalHydra.instance().hydra
    assert hydra is not None, "Hydra is initialised"
    return hydra


def loader_of_options() -> ConfigLoaderImpl:
    """Hydra's access to the files of all options, once it is initialised."""
    loader = initialised_hydra().config_loader
    assert isinstance(loader, ConfigLoaderImpl)
    return loader


def offer_options(group: str, options: Mapping[str, Mapping[str, Any]]) -> None:
    """Let ``group=name`` put a piece of configuration into the whole, for each of ``options`` by name."""
    store = ConfigStore.instance()
    for name, content in options.items():
        kept = store.repo.get(group, {}).get(f"{name}.yaml")
        if kept is not None and _offered.get((group, name)) == (content, kept):
            continue  # to store it takes a millisecond or more, and a sweep is composed often
        store.store(name, OmegaConf.create(dict(content)), group=group, package="_global_")
        _offered[group, name] = (content, store.repo[group][f"{name}.yaml"])


def option_repository(loader: ConfigLoaderImpl, config_name: str, overrides: Sequence[str]) -> CachingConfigRepository:
    """The files of all options, with the folders that ``overrides`` add."""
    return loader._parse_overrides_and_create_caching_repo(config_name, list(overrides))[1]


def make_parser(loader: ConfigLoaderImpl | None = None) -> OverridesParser:
    """What reads overrides: Hydra's grammar, with the functions of ``spacing`` and ``ranges`` beside its own."""
    parser = OverridesParser.create(loader)

    def register(name: str, space: Callable[[Number, Number, int], list[Number]]) -> None:
        """Let a function of this name stand for the numbers that ``space`` gives."""

        def choose(start: Number, stop: Number, count: int) -> ChoiceSweep:
            """What Hydra makes of a call, whose types it checks by this signature."""
            return ChoiceSweep(list=list(space(start, stop, count)))

        parser.functions.register(name, choose)

    for name, space in SPACINGS.items():
        register(name, space)

    def log(start: Number, stop: Number) -> IntervalSweep:
        """What Hydra makes of log(start,stop)."""
        low, high = check_log(start, stop)
        return IntervalSweep(start=low, end=high, tags={LOG})

    def whole(start: int, stop: int) -> IntervalSweep:
        """What Hydra makes of whole(start,stop)."""
        low, high = check_whole(start, stop)
        return IntervalSweep(start=low, end=high, tags={WHOLE})

    parser.functions.register(LOG, log)
    parser.functions.register(WHOLE, whole)
    return parser


def is_range(override: Override) -> bool:
    """Whether an override names a range of numbers, of which only a design makes values."""
    return isinstance(override.value(), IntervalSweep)


def has_list_in_list(override: Override) -> bool:
    """Whether an override lists a range or a choice, such as range(1,5), beside other values."""
    value = override.value()
    return isinstance(value, ChoiceSweep) and any(isinstance(each, Sweep) for each in value.list)


def is_sampled(override: Override) -> bool:
    """Whether a design chooses the values of an override: those of a range, or of choice(); not of a list a,b."""
    written = str(override.input_line).partition("=")[2]  # Hydra makes the same of choice(a,b) and a,b
    return is_range(override) or written.lstrip().startswith(f"{CHOICE}(")


def jobs_of(overrides: Sequence[Override]) -> list[list[str]]:
    """The overrides of each job that Hydra's own sweeper makes of some."""
    return [job for batch in BasicSweeper.split_arguments(list(overrides), None) for job in batch]


def as_text(value: Any) -> str:
    """A value as it stands in an override."""
    return Transformer.str(value)


def context_of(hydra: Hydra, config: DictConfig) -> HydraContext:
    """What a launcher is set up with."""
    return HydraContext(config_loader=hydra.config_loader, callbacks=Callbacks(config))


def result_of(job: JobReturn) -> Any:
    """What a job returned or raised, where asking for it plainly would raise."""
    return job._return_value
