"""The configuration of a run as text."""

from collections.abc import Sequence

from omegaconf import OmegaConf

from ..composition.compose import compose_raw
from ..errors import ConfigError
from ..sweep.plan import make_plan, split_swept


def compose_yaml(overrides: Sequence[str]) -> str:
    """The configuration that the overrides of one run give, as YAML.  Raises ConfigError."""
    _, swept = split_swept(overrides)
    if swept:
        raise ConfigError(f"{', '.join(swept)} names several runs, and this prints the settings of one: name one value")
    plan = make_plan(overrides, multirun=False)
    return OmegaConf.to_yaml(compose_raw(plan.overrides), resolve=True)
