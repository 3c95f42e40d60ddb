"""From Hydra overrides to a validated ``Config``; errors say what is wrong and which names there are."""

import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hydra import compose as hydra_compose
from hydra import initialize_config_dir
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException
from pydantic import ValidationError

from ..errors import ConfigError
from ..foreign import parse_json
from ..settings.config import NOT_RECORDED, Config
from . import hydra_private
from .drawings import read_drawings
from .experiments import CONF_DIR, all_variants, list_own_experiments
from .messages import explain, one_message
from .option_files import describe_broken_file, require_small_files
from .overrides import prepare_overrides
from .own_laws import check_own_laws
from .own_options import offer_own_options

if TYPE_CHECKING:
    import xarray as xr


def compose(overrides: Sequence[str] = ()) -> Config:
    """Compose and validate one run.

    ``overrides`` are Hydra's, for example ``["shape=ball", "pressure=500", "sintering=none"]``.
    Raises ConfigError with the reason, and the right names where a name was wrong.
    """
    if isinstance(overrides, str) or not all(isinstance(word, str) for word in overrides):
        raise ConfigError("overrides should be a list of texts, such as ['pressure=500', 'sintering=none']")
    return validate(compose_raw(overrides))


def compose_raw(overrides: Sequence[str], hydra_node: bool = False) -> DictConfig:
    """Hydra's own composition; with ``hydra_node`` its settings (sweeper, launcher) come along.

    Raises ConfigError.
    """
    hydra_private.forget_hydra()
    offer_own_options()
    words = prepare_overrides(overrides)
    require_small_files()
    hydra_private.offer_options("variant", all_variants(overrides))
    try:
        with initialize_config_dir(version_base="1.3", config_dir=str(CONF_DIR)), quiet_about_schemas():
            return hydra_compose("config", words, return_hydra_config=hydra_node)
    except Exception as error:  # Hydra passes on what its parsers, YAML and its own assertions raise
        message = describe_broken_file(error) or _explain_no_name(error, words) or one_message(error)
        raise ConfigError(message) from error


def _explain_no_name(error: Exception, words: Sequence[str]) -> str | None:
    """Say which option is named by a number or a truth value; None if an error is not about that."""
    if "Config group override must be a string" not in str(error):
        return None
    loader = config_loader()
    for override in hydra_private.make_parser(loader).parse_overrides(list(words)):
        names = loader.get_group_options(override.key_or_group)
        if names and not isinstance(override.value(), str | list):
            return f"'{override.input_line}': should be one of the names: {', '.join(names)}"
    return None


def config_loader() -> hydra_private.ConfigLoaderImpl:
    """Hydra's access to the files of all options."""
    hydra_private.forget_hydra()
    offer_own_options()
    with initialize_config_dir(version_base="1.3", config_dir=str(CONF_DIR)):
        return hydra_private.loader_of_options()


def option_files(overrides: Sequence[str]) -> hydra_private.CachingConfigRepository:
    """The files of all options as ``overrides``, which may add folders, and the user's folder make them up."""
    return hydra_private.option_repository(config_loader(), "config", overrides)


def list_option_files(files: hydra_private.CachingConfigRepository) -> list[Path]:
    """The YAML files of options, the user's experiments last."""
    tops = [source.path for source in files.get_sources() if source.scheme() == "file"]
    paths = [Path(place, name) for top in tops for place, _, names in os.walk(top, followlinks=True) for name in names]
    return [*(path for path in paths if path.suffix in (".yaml", ".yml")), *list_own_experiments()]


@contextmanager
def quiet_about_schemas() -> Iterator[None]:
    """conf/hydra/launcher/ray.yaml has the name of its plug-in's schema on purpose."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=r"(?s).*validated against ConfigStore schema")
        yield


def validate(raw: DictConfig) -> Config:
    """Turn Hydra's config into a ``Config``.  Raises ConfigError naming each wrong key and its bounds."""
    try:
        own = OmegaConf.masked_copy(raw, [str(key) for key in raw if key != "hydra"]) if "hydra" in raw else raw
        return Config.model_validate(check_own_laws(read_drawings(plain_settings(own))))
    except OmegaConfBaseException as error:
        raise ConfigError(one_message(error)) from error
    except ValidationError as error:
        raise ConfigError("; ".join(explain(item) for item in error.errors())) from error


def plain_settings(raw: DictConfig, resolve: bool = True) -> dict[str, Any]:
    """Hydra's config as plain values; interpolations are left as they stand unless they are to be resolved."""
    settings = OmegaConf.to_container(raw, resolve=resolve)
    assert isinstance(settings, dict), "a configuration has names"
    return {str(name): value for name, value in settings.items()}


def config_of(dataset: "xr.Dataset") -> Config:
    """The configuration that a run carries; what settings it did not have yet are as they are by default.

    Raises ConfigError if it carries none, or one that is none of this program.
    """
    if "config" not in dataset.attrs:
        raise ConfigError("this is no run of snowrepro: it carries no configuration")
    try:
        return config_from(parse_json(dataset.attrs["config"]))
    except (ValueError, TypeError) as error:
        raise ConfigError(f"the configuration in this run cannot be read: {error}") from error


def config_from(plain: Mapping[str, Any], **ours: Any) -> Config:
    """The configuration that was written down so; what it does not have is as it is by default.

    Where it was kept, and what was asked of it, is not taken from it: ``ours`` are settings of whoever reads it.
    Raises ConfigError.
    """
    written = {name: value for name, value in plain.items() if name not in NOT_RECORDED}
    try:
        return Config.model_validate({**compose().settings(), **written, **ours})
    except ValidationError as error:
        wrong = "; ".join(explain(item) for item in error.errors())
        raise ConfigError(f"the configuration in this run is not of this version: {wrong}") from error


def job_overrides() -> list[str]:
    """The overrides of the run that one of Hydra's launchers does in this process; none elsewhere."""
    return list(HydraConfig.get().overrides.task) if HydraConfig.initialized() else []
