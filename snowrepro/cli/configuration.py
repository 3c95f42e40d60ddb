"""The configuration of a run as text."""

from collections.abc import Sequence

from omegaconf import OmegaConf

from ..composition.compose import compose_raw
from ..sweep.plan import make_plan


def compose_yaml(overrides: Sequence[str]) -> str:
    """The configuration that the overrides of one run give, as YAML.  Raises ConfigError."""
    plan = make_plan(overrides, multirun=False)
    return OmegaConf.to_yaml(compose_raw(plan.overrides), resolve=True)
