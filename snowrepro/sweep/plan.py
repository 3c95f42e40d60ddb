"""What a command line asks for: one run, the runs of a sweep, or those that claims are judged by."""

from collections.abc import Sequence
from dataclasses import dataclass

from hydra._internal.core_plugins.basic_sweeper import BasicSweeper
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from hydra.errors import OverrideParseException
from hydra.types import RunMode

from ..composition import compose, compose_raw
from ..config import Config
from ..errors import ConfigError

MOST_SEEDS = 100


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
    parsed = _parse(overrides)
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


def make_claims_plan(overrides: Sequence[str], seeds: int) -> Plan:
    """The runs of an experiment with seeds 0 to ``seeds`` - 1.

    Raises ConfigError also where there is no one experiment with runs, the overrides choose seeds of their
    own, or two runs differ in more than what a claim tells apart: scene, sintering, pressure and seed.
    """
    if not 1 <= seeds <= MOST_SEEDS:
        raise ConfigError(f"seeds: should be 1 to {MOST_SEEDS} (got {seeds})")
    if any(o.get_key_element().lstrip("+~") == "seed" for o in _parse(overrides)):
        raise ConfigError(f"claims take the seeds 0 to {seeds - 1} (seeds={seeds}): leave out the override of seed")
    plan = make_plan([*overrides, f"seed={','.join(map(str, range(seeds)))}"], multirun=True)
    experiments = {config.experiment for config in plan.configs}
    if len(experiments) > 1 or None in experiments:
        raise ConfigError("claims are judged by the runs of one experiment, for example experiment=fig5")
    if not plan.needs_runs:
        raise ConfigError(f"experiment '{plan.configs[0].experiment.name}' has no runs to judge claims by")
    _require_one_run_a_cell(plan)
    return plan


def _require_one_run_a_cell(plan: Plan) -> None:
    """A claim cannot choose between variants of a run."""
    found: dict[tuple, Config] = {}
    for config in plan.configs:
        cell = (config.shape.name, config.floor.name, config.sintering.enabled, config.pressure, config.seed)
        if cell in found:
            shape, floor, sintered, pressure, seed = cell
            arm = "sintered" if sintered else "unsintered"
            raise ConfigError(
                f"two of the runs are {shape} on {floor}, {arm}, pressure {pressure:g}, seed {seed}: "
                f"claims need one of each, so choose one of what else the runs differ in"
            )
        found[cell] = config


def _parse(overrides: Sequence[str]) -> list[Override]:
    try:
        return OverridesParser.create().parse_overrides(list(overrides))
    except OverrideParseException as error:
        raise ConfigError(f"cannot read '{error.override}': {error}".splitlines()[0]) from error
