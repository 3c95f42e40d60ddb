"""What a command line asks for: one run, or the runs of a sweep, each composed and validated."""

from collections.abc import Sequence
from dataclasses import dataclass

from hydra._internal.core_plugins.basic_sweeper import BasicSweeper
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import OverrideParseException
from hydra.types import RunMode

from ..composition import compose, compose_raw
from ..config import Config
from ..errors import ConfigError


@dataclass(frozen=True)
class Plan:
    """The runs of one command.  ``overrides`` are Hydra's, for the whole sweep."""

    configs: tuple[Config, ...]
    is_sweep: bool
    overrides: tuple[str, ...]

    @property
    def needs_runs(self) -> bool:
        """Whether anything is to be simulated."""
        experiment = self.configs[0].experiment
        return experiment is None or experiment.needs_runs


def make_plan(overrides: Sequence[str], multirun: bool) -> Plan:
    """Expand and validate every run before any work.

    A sweep is asked for by ``multirun`` or by an experiment whose file says so.  Raises ConfigError.
    """
    try:
        parsed = OverridesParser.create().parse_overrides(list(overrides))
    except OverrideParseException as error:
        raise ConfigError(f"cannot read '{error.override}': {error}".splitlines()[0]) from error
    fixed = [o.input_line for o in parsed if not o.is_sweep_override()]
    swept = [o.input_line for o in parsed if o.is_sweep_override()]
    hydra = compose_raw(fixed, hydra_node=True).hydra
    is_sweep = multirun or hydra.mode == RunMode.MULTIRUN
    if swept and not is_sweep:
        raise ConfigError(f"{', '.join(swept)} names several runs: add -m to run them all")
    if not is_sweep:
        return Plan((compose(fixed),), False, tuple(overrides))
    # The sweeper reads its parameters first, then the command line, which wins.
    named = {o.get_key_element() for o in parsed}
    params = [f"{key}={value}" for key, value in (hydra.sweeper.params or {}).items() if key not in named]
    every = OverridesParser.create().parse_overrides([*params, *overrides])
    batches = BasicSweeper.split_arguments(every, None)
    return Plan(tuple(compose(job) for batch in batches for job in batch), True, tuple(overrides))
