"""Configurations made of others."""

import json
from typing import Any

import xarray as xr

from snowrepro.settings.config import Config


def changed(config: Config, **settings: Any) -> Config:
    """The same configuration with other settings, by their names in overrides."""
    return Config.model_validate({**config.settings(), **settings})


def carrying(run: xr.Dataset, config: Config) -> xr.Dataset:
    """A result as if it were one of this configuration."""
    return run.assign_attrs(config=json.dumps(config.settings()))
