"""What the overrides, and the names of sweeps, on a command line mean."""

import re
from collections.abc import Sequence

from ..composition.overrides import override_folder
from ..errors import ConfigError
from ..report.figures.kinds import needs_runs, require_drawable
from ..sweep import record
from ..sweep.plan import Plan, make_plan, split_seeds, split_store, with_seeds

NAME_OF_SWEEP = re.compile(r"""[^'"\[({]*=[^'"\[({]*,[\w./@-]+=[^'"\[({]*""")  # several keys: no override has two


def plan_overrides(overrides: Sequence[str], multirun: bool, part: tuple[int, int] | None = None) -> Plan:
    """The plan of overrides, in which seeds=N is short for seed=0,..,N-1.  Raises ConfigError."""
    seeds, others = split_seeds(overrides)
    if seeds is not None:
        others, multirun = with_seeds(others, seeds), True
    plan = make_plan(others, multirun, part)
    require_drawable(plan.runs)
    return plan


def plan_sweep(words: Sequence[str], multirun: bool) -> Plan:
    """The plan of a sweep that is named, or described by overrides.  Raises ConfigError if it would have no runs."""
    store, others = split_store(words)
    if others and names_sweep(others[0], store):
        seeds, more = split_seeds(others[1:])
        return record.plan_remembered(others[0], store, more if seeds is None else with_seeds(more, seeds))
    plan = plan_overrides(words, multirun)
    if plan.experiment and not needs_runs(plan.runs):
        raise ConfigError(f"experiment '{plan.experiment.name}' has no runs")
    return plan


def is_name(word: str) -> bool:
    """Whether a word can only be the name of something, and no override."""
    return "=" not in word and not word.startswith("~")


def names_sweep(word: str, store: str) -> bool:
    """Whether a word stands for a sweep that the store remembers, or can be no override."""
    return is_name(word) or NAME_OF_SWEEP.fullmatch(word) is not None or record.find_sweep(word, store) is not None


def expand_name(name: str, overrides: Sequence[str], store: str) -> list[str]:
    """The overrides of a sweep by its name, or that of its experiment if it has one, and further overrides.

    A name that is not the sweep's whole name says nothing of seeds: see ``record.find_sweep``.
    """
    seeds, others = split_seeds(overrides)
    if name:
        sweep = record.find_sweep(name, store, others)
        named = record.read_record(sweep, store).usable_overrides() if sweep else [f"experiment={name}"]
        others = record.merge_overrides(named if sweep == name else record.drop_seeds(named), others)
    others.append(override_folder("store", store))
    return with_seeds(others, seeds) if seeds is not None else others
