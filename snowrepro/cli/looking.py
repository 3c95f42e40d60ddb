"""Commands that look at one run or configuration: ``config``, ``classify``."""

import argparse
from collections.abc import Sequence

from ..composition import compose_raw
from ..errors import ConfigError, ExitCode
from ..store.files import require_writable
from ..sweep.plan import make_plan
from .screen import print_rows, say


def config_command(options: argparse.Namespace) -> ExitCode:
    """Print the composed configuration as YAML."""
    from omegaconf import OmegaConf

    plan = make_plan(options.overrides, False)
    print(OmegaConf.to_yaml(compose_raw(plan.overrides), resolve=True), end="")
    return ExitCode.FINE


def classify_command(options: argparse.Namespace) -> ExitCode:
    """Print the numbers of one run or file, and write its fragments if that is asked for."""
    from ..analysis.classify import classify, with_settings, write
    from ..analysis.motion import own_analysis
    from ..analysis.summary import summarise
    from ..store.runs import open_run

    if options.out:
        require_writable(options.out)
    settings = _settings(options.overrides)
    with open_run(options.data, options.store) as dataset:
        asked = (
            options.out or options.release is not None or options.grid_spacing is not None or options.frames == "all"
        )
        if "config" in dataset.attrs and not asked:
            print_rows(summarise(dataset, with_settings(own_analysis(dataset), settings)))
            return ExitCode.FINE
        frames = "all" if options.frames == "all" else None
        found = classify(dataset, frames=frames, release=options.release, grid_spacing=options.grid_spacing, **settings)
        for line in found.assumed:
            say(f"assumed: {line}")
        print_rows(found.measures())
        if options.out:
            write(found, options.out)
            print(options.out)
    return ExitCode.FINE


def _settings(texts: Sequence[str]) -> dict[str, str]:
    """Names and values of ``name=value``.  Raises ConfigError."""
    for text in texts:
        if "=" not in text:
            raise ConfigError(f"'{text}' is not a setting: write name=value, for example break_strain=0.2")
    return dict(text.split("=", 1) for text in texts)
