"""The laws of installed packages as options of the groups ``material`` and ``sintering``, beside the files of conf/."""

from collections.abc import Mapping
from typing import Any

from hydra.core.object_type import ObjectType
from hydra.plugins.config_source import ConfigResult, ConfigSource
from omegaconf import OmegaConf
from pydantic import ValidationError

from ..errors import ConfigError
from ..own_law import (
    GROUPS,
    PASSED,
    describe_change,
    explain_errors,
    find_own_law,
    identify_law,
    list_laws,
    load_law,
    require_plain,
)
from ..settings.laws import InstalledLaw
from .messages import explain

BASES = {"material": "table1", "sintering": "paper"}  # the options that an own law stands on


class LawsSource(ConfigSource):
    """Shows Hydra each installed law as an option; the code of a package is run only where its law is chosen."""

    @staticmethod
    def scheme() -> str:
        """What a search path to the laws begins with."""
        return "laws"

    def available(self) -> bool:
        """There may be none, but one can always look."""
        return True

    def load_config(self, config_path: str) -> ConfigResult:
        """An option: the law, where it comes from, and the parameters that it declares."""
        kind, _, name = config_path.removesuffix(".yaml").partition("/")
        config = OmegaConf.create(describe_option(kind, name))
        return ConfigResult(provider=self.provider, path=self.full_path(), config=config, header={"package": None})

    def is_group(self, config_path: str) -> bool:
        """Whether this is a group of laws, or what holds them."""
        return config_path.strip("/") in ("", *GROUPS)

    def is_config(self, config_path: str) -> bool:
        """Whether this is a law that an installed package offers."""
        kind, _, name = config_path.strip("/").removesuffix(".yaml").partition("/")
        return kind in GROUPS and name in list_laws(kind)

    def list(self, config_path: str, results_filter: ObjectType | None) -> list[str]:
        """The laws of a group, or the groups."""
        kind = config_path.strip("/")
        if kind in GROUPS:
            return [] if results_filter == ObjectType.GROUP else list(list_laws(kind))
        return [] if kind or results_filter == ObjectType.CONFIG else list(GROUPS)


def describe_option(kind: str, name: str) -> dict[str, Any]:
    """The piece of configuration that ``material=name`` or ``sintering=name`` stands for.  Raises ConfigError."""
    fields = load_law(kind, name).parameters.model_fields
    defaults = {key: field.get_default(call_default_factory=True) for key, field in fields.items()}
    given = {key: value for key, value in defaults.items() if not fields[key].is_required()}
    law = identify_law(kind, name).model_dump() | {"parameters": given}
    named = {"name": name} if kind == "sintering" else {}
    return {"defaults": [BASES[kind], "_self_"], **named, "law": law}


def check_own_laws(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Check the installed laws of a configuration against what they declare; returns it with their parameters whole.

    Raises ConfigError, also where a law is not installed as the configuration says.
    """
    checked = dict(settings)
    for kind in GROUPS:
        if law := find_own_law(kind, settings):
            checked[kind] = {**settings[kind], "law": {**law, "parameters": _check_parameters(kind, law)}}
    return checked


def _check_parameters(kind: str, law: Mapping[str, Any]) -> dict[str, Any]:
    """The parameters of a law as it declares them: the same for any spelling.  Raises ConfigError."""
    said = _read_law(kind, law)
    if said.package == PASSED:
        raise ConfigError(f"{kind}.law.package: a law that was passed in Python is no option; pass it to simulate")
    if change := describe_change(kind, said):
        raise ConfigError(f"{kind}.law: {said.name} of {said.package}: {change}; choose it by {kind}={said.name}")
    declared = load_law(kind, said.name).parameters
    with explain_errors(kind, said, "cannot check its parameters"):
        try:
            parameters = declared.model_validate(law.get("parameters") or {}).model_dump(mode="json")
        except ValidationError as error:
            names = ", ".join(declared.model_fields) or "none"
            raise ConfigError(
                f"{_explain_all(kind, error, 'parameters')}; {said.name} has the parameters: {names}"
            ) from error
    require_plain(f"{kind}.law.parameters", parameters)
    return parameters


def _read_law(kind: str, law: Mapping[str, Any]) -> InstalledLaw:
    """What a configuration says of a law, without its parameters.  Raises ConfigError."""
    try:
        return InstalledLaw.model_validate({**law, "parameters": {}})
    except ValidationError as error:
        raise ConfigError(_explain_all(kind, error)) from error


def _explain_all(kind: str, error: ValidationError, *inside: str) -> str:
    """What is wrong with a law's settings, or those that it has ``inside``, each with its key."""
    plain = [{**item, "type": "own_law", "loc": (kind, "law", "", *inside, *item["loc"])} for item in error.errors()]
    return "; ".join(explain(item) for item in plain)
