"""What the store remembers of a sweep: the overrides that asked for it, and which run each of its cells was."""

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path

from ..composition.overrides import override_folder
from ..errors import ConfigError
from ..settings.execution import Execution
from ..store.files import read_json, write_json
from .plan import Plan, make_plan

SWEEPS = "sweeps"
RECORD = "sweep.json"
# Overrides that change no result, and so no sweep.
NOT_NAMED = frozenset({*Execution.model_fields, "reports", "hydra"})
MOST_LETTERS = 120
SEED = re.compile(r"(?<!\S)seed=(\d+)(?!\S)")  # in the overrides of a cell


@dataclass(frozen=True)
class Record:
    """A sweep as it was asked for last.  ``cells``: the run's id by what its overrides say of it."""

    name: str
    overrides: tuple[str, ...]
    recorded: str
    cells: Mapping[str, str]


def name_sweep(overrides: Sequence[str]) -> str:
    """A sweep's name: its experiment, then its other overrides in order; the same for any order of them."""
    named = [o for o in overrides if re.split(r"[./=@]", o.lstrip("+~"), maxsplit=1)[0] not in NOT_NAMED]
    experiments = [o.removeprefix("experiment=") for o in named if o.startswith("experiment=")]
    text = ",".join([*experiments, *sorted(o for o in named if not o.startswith("experiment="))]) or "default"
    return shorten_name(re.sub(r"[^\w.,=+~-]+", "_", text))


def shorten_name(name: str) -> str:
    """A name that a folder can have, however much it says."""
    if len(name) <= MOST_LETTERS:
        return name
    return f"{name[:MOST_LETTERS]}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"


def locate_sweep(name: str, store: str | Path) -> Path:
    """Where the store keeps what belongs to a sweep as a whole."""
    return Path(store) / SWEEPS / name


def write_record(plan: Plan) -> Path:
    """Remember a sweep, in place of what was remembered under its name; returns its folder."""
    folder = locate_sweep(name_sweep(plan.overrides), plan.runs[0].store)
    write_json(
        folder / RECORD,
        {
            "name": folder.name,
            "overrides": [o for o in plan.overrides if not o.startswith("store=")],
            "recorded": datetime.now(timezone.utc).isoformat(timespec="seconds"),
            "cells": list_cells(plan),
        },
    )
    return folder


def list_cells(plan: Plan) -> dict[str, str]:
    """Each run's id by its overrides."""
    return {" ".join(planned.overrides): planned.run.id for planned in plan.planned}


def read_record(name: str, store: str | Path) -> Record:
    """What was remembered of a sweep.  Raises ConfigError with the names that there are."""
    content = read_json(locate_sweep(name, store) / RECORD)
    if not content:
        known = ", ".join(sorted(list_sweeps(store))) or "none yet"
        raise ConfigError(f"there is no sweep '{name}' in the store '{store}'; there are: {known}")
    return Record(content["name"], tuple(content["overrides"]), content["recorded"], content["cells"])


def plan_remembered(name: str, store: str | Path, more: Sequence[str] = ()) -> Plan:
    """The runs of a remembered sweep, as its overrides and ``more`` name them now.  Raises ConfigError."""
    return make_plan([*read_record(name, store).overrides, override_folder("store", str(store)), *more], multirun=True)


def add_remembered_seeds(overrides: Sequence[str], store: str | Path) -> list[str]:
    """The overrides of a sweep with every seed that it was ever asked for with, if they name none themselves."""
    if any(o.startswith("seed=") for o in overrides):
        return list(overrides)
    seeds = {int(seed) for known in find_records(overrides, store) for seed in SEED.findall(" ".join(known.cells))}
    return [*overrides, f"seed={','.join(map(str, sorted(seeds)))}"] if seeds else list(overrides)


def find_records(overrides: Sequence[str], store: str | Path) -> list[Record]:
    """The remembered sweeps that ask for the same, whatever their seeds."""
    records = (read_record(name, store) for name in list_sweeps(store))
    return [record for record in records if name_without_seeds(record.overrides) == name_without_seeds(overrides)]


def name_without_seeds(overrides: Sequence[str]) -> str:
    """A sweep's name without its seeds."""
    return name_sweep([o for o in overrides if not o.startswith("seed=")])


def list_sweeps(store: str | Path) -> list[str]:
    """The sweeps that a store remembers."""
    return sorted(path.parent.name for path in (Path(store) / SWEEPS).glob(f"*/{RECORD}"))
