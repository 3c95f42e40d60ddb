"""What a command line asks for: one run, the runs of a sweep, or those that claims are judged by."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from hydra.errors import OverrideParseException
from hydra.types import RunMode
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException
from pydantic import ValidationError

from ..composition.compose import compose_raw, config_loader, plain_settings, validate
from ..composition.experiments import read_experiments, require_one_choice, variants_of
from ..composition.hydra_private import Override, make_parser
from ..composition.messages import explain, one_message
from ..composition.overrides import prepare_overrides, read_folder
from ..errors import ConfigError
from ..settings.design import Design
from ..settings.question import Experiment
from ..store.run import Run
from .enumeration import MOST_RUNS, Planned, enumerate_runs
from .sample import Sample, read_sample

MOST_SEEDS = 100


@dataclass(frozen=True)
class Plan:
    """The runs of one command, or a part of them.

    ``overrides`` are Hydra's, for the whole sweep; ``sample``: what a design samples of it, if there is one.
    """

    planned: tuple[Planned, ...]
    is_sweep: bool
    overrides: tuple[str, ...]
    sample: Sample | None = None

    @cached_property
    def runs(self) -> tuple[Run, ...]:
        """The runs, in order."""
        return tuple([planned.run for planned in self.planned])

    @property
    def experiment(self) -> Experiment | None:
        """The experiment that the runs are for."""
        return self.runs[0].config.question.experiment if self.runs else None


def make_plan(overrides: Sequence[str], multirun: bool, part: tuple[int, int] | None = None) -> Plan:
    """Expand and validate every run before any work.

    A sweep is asked for by ``multirun``, by a design, or by an experiment whose file says so.  Of a ``part`` (i, n)
    there is every n-th run, from the i-th on; it may have none.  Raises ConfigError.
    """
    first, step = part or (1, 1)
    fixed, swept = split_swept(overrides)
    raw = compose_raw(fixed, hydra_node=True)
    hydra, design = raw.hydra, _read_design(raw)
    is_sweep = multirun or design is not None or hydra.mode == RunMode.MULTIRUN
    if swept and not is_sweep:
        raise ConfigError(f"{', '.join(swept)} names several runs: add -m, which makes them a sweep")
    if not is_sweep:
        planned = (Planned(Run(validate(raw)), tuple(fixed)),)
        return Plan(planned[first - 1 :: step], False, tuple(overrides))
    # The sweeper reads its parameters first, then the command line, which wins.
    own = hydra.sweeper.params or {}
    require_one_choice(variants_of(overrides), own)
    axes = {**_every_variant(overrides), **own}
    params = [f"{key}={value}" for key, value in axes.items()]
    parsed = parse_overrides([*params, *overrides])
    last = _list_last(parsed)
    sample = read_sample(design, last) if design else None
    return Plan(enumerate_runs(parsed, (first, step), sample), True, tuple(overrides), sample)


def _read_design(raw: DictConfig) -> Design | None:
    """The design of a composed configuration; None if it has none.  Raises ConfigError."""
    try:
        return Design.model_validate(plain) if (plain := plain_settings(raw).get("design")) else None
    except OmegaConfBaseException as error:
        raise ConfigError(one_message(error)) from error
    except ValidationError as error:
        wrong = "; ".join(explain({**item, "loc": ("design", *item["loc"])}) for item in error.errors())
        raise ConfigError(wrong) from error


def _list_last(overrides: Sequence[Override]) -> list[Override]:
    """The last override of each key, which is the one that counts.  Raises ConfigError where designs vary."""
    last = list({each.get_key_element(): each for each in overrides}.values())
    for each in last:
        if each.is_sweep_override() and each.key_or_group.partition(".")[0] == "design":
            raise ConfigError(f"'{each.input_line}': a sweep has one design")
    return last


def compose_first_run(overrides: Sequence[str]) -> Run:
    """The first run of a sweep, without composing the others.  Raises ConfigError."""
    return make_plan(overrides, multirun=True, part=(1, MOST_RUNS)).runs[0]


def split_swept(overrides: Sequence[str]) -> tuple[list[str], list[str]]:
    """The overrides that name one value, and those that name several.  Raises ConfigError."""
    parsed = [(str(override.input_line), override.is_sweep_override()) for override in parse_overrides(overrides)]
    return [text for text, is_swept in parsed if not is_swept], [text for text, is_swept in parsed if is_swept]


def read_part(text: str) -> tuple[int, int]:
    """Which part of a sweep a text such as 2/10 means.  Raises ConfigError."""
    match = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
    part = (int(match[1]), int(match[2])) if match else (0, 0)
    if not 1 <= part[0] <= part[1]:
        raise ConfigError(f"part: should be I/N with 1 <= I <= N (got {text})")
    return part


def split_seeds(overrides: Sequence[str]) -> tuple[int | None, list[str]]:
    """The number after seeds=, if it is there, and the other overrides.  Raises ConfigError where it is none."""
    given = [text.removeprefix("seeds=") for text in overrides if text.startswith("seeds=")]
    others = [text for text in overrides if not text.startswith("seeds=")]
    if len(given) > 1 or not all(text.isdecimal() and text.isascii() for text in given):
        raise ConfigError(f"seeds: should be one whole number of at least 1 (got {', '.join(given)})")
    return int(given[0]) if given else None, others


def split_store(overrides: Sequence[str], default: str = "runs") -> tuple[str, list[str]]:
    """The store that overrides name, or the default; and the other overrides.  Raises ConfigError."""
    others = [text for text in overrides if not text.startswith("store=")]
    return last_folder(overrides, "store") or default, others


def last_of(overrides: Sequence[str], key: str) -> str | None:
    """The value that a key is given last."""
    values = [text.removeprefix(f"{key}=") for text in overrides if text.startswith(f"{key}=")]
    return values[-1] if values else None


def last_folder(overrides: Sequence[str], key: str) -> str | None:
    """The folder that ``key``, which is store or reports, is given last.  Raises ConfigError."""
    words = [text for text in overrides if text.startswith(f"{key}=")]
    return read_folder(words[-1]) if words else None


def with_seeds(overrides: Sequence[str], seeds: int) -> list[str]:
    """The overrides of a sweep that has each run with the seeds 0 to ``seeds`` - 1.  Raises ConfigError."""
    if not 1 <= seeds <= MOST_SEEDS:
        raise ConfigError(f"seeds: should be 1 to {MOST_SEEDS} (got {seeds})")
    if any(o.get_key_element().lstrip("+~") == "seed" for o in parse_overrides(overrides)):
        raise ConfigError(f"seeds={seeds} means the seeds 0 to {seeds - 1}: leave out the override of seed")
    return [*overrides, f"seed={','.join(map(str, range(seeds)))}"]


def make_claims_plan(overrides: Sequence[str], seeds: int) -> Plan:
    """The runs of an experiment with seeds 0 to ``seeds`` - 1.

    Raises ConfigError also where there is no one experiment, or the overrides choose seeds of their own.
    """
    plan = make_plan(with_seeds(overrides, seeds), multirun=True)
    experiments = {run.config.question.experiment and run.config.question.experiment.name for run in plan.runs}
    if len(experiments) > 1 or None in experiments:
        raise ConfigError("claims are judged by the runs of one experiment, for example experiment=fig5")
    return plan


def require_one_run_a_cell(plan: Plan) -> None:
    """Check that no two runs differ in more than what a claim tells apart: scene, sintering, pressure and seed.

    Raises ConfigError if two do.
    """
    known = set()
    for case in (run.case for run in plan.runs):
        cell = (case.shape.name, case.floor.name, case.arm, case.pressure, case.seed)
        if cell in known:
            raise ConfigError(
                f"two of the runs are {case.shape.name} on {case.floor.name}, {case.arm}, pressure "
                f"{case.pressure:g}, seed {case.seed}: claims need one of each, so choose one of what else the runs "
                "differ in"
            )
        known.add(cell)


def _every_variant(overrides: Sequence[str]) -> dict[str, str]:
    """The axis over the variants of the experiment among ``overrides``; empty if it has none."""
    names = variants_of(overrides)
    return {"variant": ",".join(names)} if names else {}


def parse_overrides(overrides: Sequence[str]) -> list[Override]:
    """What overrides say, as Hydra's grammar and the functions for numbers read them.  Raises ConfigError."""
    try:
        return make_parser(config_loader()).parse_overrides(prepare_overrides(overrides))
    except OverrideParseException as error:
        raise ConfigError(_explain_unreadable(error)) from error


def _explain_unreadable(error: OverrideParseException) -> str:
    """What is wrong with an override that cannot be read, in one line."""
    word = error.override
    if "=" not in word and not word.startswith("~"):
        meant = f", as in experiment={word}" if word in read_experiments() else ""
        return f"'{word}' is no override, which is written key=value{meant}"
    return f"cannot read '{word}': {one_message(error)}"
