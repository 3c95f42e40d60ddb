"""From Hydra overrides to a validated ``Config``; errors say what is wrong and which names there are.

Beside the launcher, only this module and the sweep's plan and enumeration know Hydra's types.
"""

import difflib
import json
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from hydra import compose as hydra_compose
from hydra import initialize_config_dir
from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra._internal.config_repository import CachingConfigRepository
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException
from pydantic import BaseModel, ValidationError

from .config import Config, Outline, Traced
from .errors import ConfigError

if TYPE_CHECKING:
    import xarray as xr

_PACKAGE = Path(__file__).resolve().parent
# An installed wheel carries conf/ inside the package; a clone has it beside.
CONF_DIR = _PACKAGE / "conf" if (_PACKAGE / "conf").is_dir() else _PACKAGE.parent / "conf"


def compose(overrides: Sequence[str] = ()) -> Config:
    """Compose and validate one run.

    ``overrides`` are Hydra's, for example ``["shape=ball", "pressure=500", "sintering=none"]``.
    Raises ConfigError with the reason, and the right names where a name was wrong.
    """
    return validate(compose_raw(overrides))


def compose_raw(overrides: Sequence[str], hydra_node: bool = False) -> DictConfig:
    """Hydra's own composition; with ``hydra_node`` its settings (sweeper, launcher) come along."""
    GlobalHydra.instance().clear()
    try:
        with initialize_config_dir(version_base="1.3", config_dir=str(CONF_DIR)):
            with quiet_about_schemas():
                return hydra_compose("config", [*overrides, *own_options()], return_hydra_config=hydra_node)
    except (HydraException, OmegaConfBaseException, ValueError) as error:
        raise ConfigError(_one_message(error)) from error


def config_loader() -> ConfigLoaderImpl:
    """Hydra's access to the files of all options."""
    GlobalHydra.instance().clear()
    with initialize_config_dir(version_base="1.3", config_dir=str(CONF_DIR)):
        return GlobalHydra.instance().config_loader()


def option_files(overrides: Sequence[str]) -> CachingConfigRepository:
    """The files of all options as ``overrides``, which may add folders, and the user's folder make them up."""
    return config_loader()._parse_overrides_and_create_caching_repo("config", [*overrides, *own_options()])[1]


@contextmanager
def quiet_about_schemas() -> Iterator[None]:
    """conf/hydra/launcher/ray.yaml has the name of its plug-in's schema on purpose."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=r"(?s).*validated against ConfigStore schema")
        yield


def own_options() -> list[str]:
    """Hydra's override that adds the user's options: those of a folder ``conf`` in the working directory."""
    own = Path("conf").resolve()
    return [f"hydra.searchpath=[file://{own}]"] if own.is_dir() and own != CONF_DIR else []


def validate(raw: DictConfig) -> Config:
    """Turn Hydra's config into a ``Config``.  Raises ConfigError naming each wrong key and its bounds."""
    try:
        own = OmegaConf.masked_copy(raw, [k for k in raw if k != "hydra"]) if "hydra" in raw else raw
        return Config.model_validate(OmegaConf.to_container(own, resolve=True))
    except OmegaConfBaseException as error:
        raise ConfigError(_one_message(error)) from error
    except ValidationError as error:
        raise ConfigError("; ".join(_explain(item) for item in error.errors())) from error


def config_of(dataset: "xr.Dataset") -> Config:
    """The configuration that a run carries; what settings it did not have yet are as they are by default.

    Raises ConfigError if it carries none, or one that is none of this program.
    """
    if "config" not in dataset.attrs:
        raise ConfigError("this is no run of snowrepro: it carries no configuration")
    try:
        return config_from(json.loads(dataset.attrs["config"]))
    except ValueError as error:
        raise ConfigError(f"the configuration in this run cannot be read: {error}") from error


def config_from(plain: Mapping[str, Any]) -> Config:
    """The configuration that was written down so; what it does not have is as it is by default.  Raises ConfigError."""
    try:
        return Config.model_validate({**compose().model_dump(), **plain})
    except ValidationError as error:
        wrong = "; ".join(_explain(item) for item in error.errors())
        raise ConfigError(f"the configuration in this run is not of this version: {wrong}") from error


def job_overrides() -> list[str]:
    """The overrides of the run that one of Hydra's launchers does in this process; none elsewhere."""
    return list(HydraConfig.get().overrides.task) if HydraConfig.initialized() else []


def _explain(item: dict[str, Any]) -> str:
    """One pydantic error as 'key: what is wrong (got value)'."""
    where = ".".join(str(part) for part in item["loc"]) or "config"
    if item["type"] == "extra_forbidden":
        return _no_such_key(where)
    message = re.sub(r"^Value error, |^Input ", "", item["msg"])
    shown = "" if isinstance(item["input"], dict) else f" (got {item['input']!r})"
    return f"{where}: {message}{shown}"


def _one_message(error: Exception) -> str:
    """Hydra's message on one line, with the right names when a key was wrong."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    text = " ".join(lines)
    choice = re.search(
        r"Could not find '([^/']+)/([^']*)' Available options in '[^']+': (.*?)( Config search path|$)", text
    )
    if choice:
        return f"there is no {choice[1]} '{choice[2]}'; there are: {', '.join(choice[3].split())}"
    if "hydra/launcher/submitit" in text:
        return "this launcher is not installed: pip install 'snowrepro[slurm]'"
    unknown = re.search(r"Could not override '([^']+)'", text) or re.search(r"Key '(\w+)' is not in struct", text)
    if unknown:
        return _no_such_key(unknown[1].lstrip("+"))
    return text


def _section(annotation: Any) -> type[BaseModel] | None:
    """The section that a field holds, also where it may be left out; None if it holds a value."""
    kinds = get_args(annotation) or (annotation,)
    return next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel)), None)


def _no_such_key(key: str) -> str:
    """Say that a key does not exist, which is near to it, and which there are."""
    section: type[BaseModel] = Config
    *parents, last = key.split(".")
    for parent in parents:
        field = section.model_fields.get(parent)
        inner = _section(field.annotation) if field else None
        if inner is None:
            last = parent
            break
        section = inner
    drawn = Traced.model_fields if section is Outline else {}
    names = sorted({*section.model_fields, *drawn})
    if last in names:
        return f"'{key}' is not set by the options chosen; to set it, write +{key}=..."
    near = difflib.get_close_matches(last, names, n=1)
    hint = f"; did you mean '{near[0]}'?" if near else "."
    return f"there is no setting '{key}'{hint} There are: {', '.join(names)}"
