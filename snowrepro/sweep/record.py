"""What the store remembers of a sweep: the overrides that asked for it, and which run each of its cells was."""

import difflib
import hashlib
import logging
import os
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path

from .. import foreign
from ..composition.experiments import read_experiments
from ..composition.overrides import override_folder
from ..composition.remembered import keep_harmless, require_harmless
from ..errors import ConfigError, StoreError
from ..foreign import Unreadable
from ..settings.execution import Execution
from ..store import models
from ..store.files import write_json
from ..store.folders import SWEEPS
from .plan import Plan, make_plan

log = logging.getLogger("snowrepro")

RECORD = "sweep.json"
# Overrides that change no result, and so no sweep.
NOT_NAMED = frozenset({*Execution.model_fields, "reports", "hydra"})
MOST_LETTERS = 120
MOST_NAMED = 10  # sweeps in a message
SEED = re.compile(r"(?<!\S)seed=([0-9]{1,10})(?!\S)")  # in the overrides of a cell
NAME = re.compile(r"[\w=+~][\w.,=+~-]*")  # what ``name_sweep`` makes, and what a folder that is read may be called


@dataclass(frozen=True)
class Record:
    """A sweep as it was asked for last, by whoever wrote the file ``path``: see ``usable_overrides``.

    ``cells``: the run's id by what its overrides say of it.
    """

    name: str
    overrides: tuple[str, ...]
    recorded: str
    cells: Mapping[str, str]
    path: Path

    def usable_overrides(self) -> list[str]:
        """The overrides, all of them harmless.  Raises ConfigError that names the file if one is not."""
        try:
            require_harmless(self.overrides)
        except ConfigError as error:
            remedy = "name the sweep by its own overrides, or remove the file"
            raise ConfigError(f"{self.path} is not used: {error}; {remedy}") from error
        return list(self.overrides)


def name_sweep(overrides: Sequence[str]) -> str:
    """A sweep's name: its experiment, then its other overrides in order; the same for any order of them."""
    named = _list_named(overrides)
    experiments = [o.removeprefix("experiment=") for o in named if o.startswith("experiment=")]
    text = ",".join([*experiments, *sorted(o for o in named if not o.startswith("experiment="))]) or "default"
    return shorten_name(re.sub(r"[^\w.,=+~-]+", "_", text))


def _list_named(overrides: Sequence[str]) -> list[str]:
    """Those of some overrides that make another sweep."""
    return [o for o in overrides if re.split(r"[./=@]", o.lstrip("+~"), maxsplit=1)[0] not in NOT_NAMED]


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
    store = plan.runs[0].store
    folder = locate_sweep(name_sweep(plan.overrides), store)
    foreign.refuse_links(folder, store)
    write_json(
        folder / RECORD,
        {
            "name": folder.name,
            "overrides": keep_harmless(plan.overrides),
            "recorded": datetime.now(timezone.utc).isoformat(timespec="seconds"),
            "cells": list_cells(plan),
        },
    )
    return folder


def forget_record(plan: Plan) -> None:
    """Forget a sweep of which nothing was run."""
    store = plan.runs[0].store
    folder = locate_sweep(name_sweep(plan.overrides), store)
    foreign.refuse_links(folder / RECORD, store)
    (folder / RECORD).unlink(missing_ok=True)
    with suppress(OSError):  # it has other files
        folder.rmdir()


def list_cells(plan: Plan) -> dict[str, str]:
    """Each run's id by its overrides."""
    return {" ".join(planned.overrides): planned.run.id for planned in plan.planned}


def read_record(name: str, store: str | Path) -> Record:
    """What was remembered of the sweep of a name.

    Raises ConfigError with the names that there are; Unreadable where the record is none.
    """
    if name not in list_sweeps(store):
        raise ConfigError(explain_missing(name, store))
    path = locate_sweep(name, store) / RECORD
    content = models.read_model(path, models.SweepRecord, models.MOST_RECORD, Path(store))
    if content is None:
        raise Unreadable(path, "is missing")
    return Record(name, tuple(content.overrides), content.recorded, content.cells, path)


def read_all(store: str | Path) -> tuple[list[Record], list[str]]:
    """What was remembered of every sweep of a store; and a line on each record that cannot be read."""
    records, problems = [], []
    for name in list_sweeps(store):
        try:
            records.append(read_record(name, store))
        except StoreError as error:
            problems.append(str(error))
    return records, problems


def find_sweep(word: str, store: str | Path, more: Sequence[str] = (), is_name: bool = False) -> str | None:
    """The name of the remembered sweep that a word stands for; None if it stands for none.

    That is the sweep of this name; else the newest of the experiment of this name, and where ``more`` overrides are
    asked for, of those that differ from them in seeds alone; else the only sweep whose name begins so.  A word that
    could be an override is none of these unless ``is_name``.  Says in the log which one it takes of several.
    """
    names = list_sweeps(store)
    if word in names:
        return word
    if not word or (_could_be_override(word) and not is_name):
        return None
    fitting = _list_of_experiment(word, more, names, store)
    if len(fitting) > 1:
        log.warning("'%s' stands for the newest of %d sweeps: %s", word, len(fitting), fitting[0])
    is_part = "," in word or "=" in word  # of a name, and not all of an experiment's
    begun = [name for name in names if name.startswith(word) and (is_part or not name.startswith(f"{word},"))]
    return fitting[0] if fitting else begun[0] if len(begun) == 1 else None


def _could_be_override(word: str) -> bool:
    """Whether a word could be an override of one key, such as pressure=300,740."""
    return word.count("=") == 1 and "," not in word.partition("=")[0]


def require_sweep(word: str, store: str | Path, more: Sequence[str] = ()) -> str:
    """The name of the remembered sweep that a word stands for: see ``find_sweep``.

    Raises ConfigError with the names that there are, the nearest first, and what to do.
    """
    name = find_sweep(word, store, more, is_name=True)
    if name is None:
        raise ConfigError(explain_missing(word, store, more))
    return name


def _list_of_experiment(experiment: str, more: Sequence[str], names: Sequence[str], store: str | Path) -> list[str]:
    """The names of the remembered sweeps of an experiment, the newest first: see ``find_sweep``."""
    records, wanted = [], [f"experiment={experiment}", *_list_named(more)]
    for name in names:
        if name.startswith(f"{experiment},"):
            try:
                records.append(read_record(name, store))
            except StoreError as error:
                log.warning("a sweep of '%s' cannot be read and is left out: %s", experiment, error)
    fitting = [each for each in records if wanted[0] in each.overrides]
    if wanted[1:]:
        fitting = [each for each in fitting if _are_same(each.overrides, wanted)]
    return [each.name for each in sorted(fitting, key=_find_age, reverse=True)]


def _find_age(record: Record) -> tuple[str, int]:
    """What is larger for a record that was written later."""
    return record.recorded, record.path.lstat().st_mtime_ns


def explain_missing(word: str, store: str | Path, more: Sequence[str] = ()) -> str:
    """A line that says that there is no such sweep, which there are, and what to do."""
    return f"there is no sweep '{word}' in the store '{store}'; there are: {name_nearest(word, store, more)}"


def name_nearest(word: str, store: str | Path, more: Sequence[str] = ()) -> str:
    """The names of a store's sweeps, those like the word first; and what makes it, if it is an experiment's name."""
    names = list_sweeps(store)

    def likeness(name: str) -> float:
        """How like the word the name's beginning is, from 0 to 1."""
        return difflib.SequenceMatcher(None, word, name[: max(len(word), len(name.partition(",")[0]))]).ratio()

    near = sorted(names, key=likeness, reverse=True)
    rest = [f"and {len(near) - MOST_NAMED} more, see 'snowrepro status'"] if len(near) > MOST_NAMED else []
    known = ", ".join([*near[:MOST_NAMED], *rest]) or "none yet"
    asked = " ".join([f"experiment={word}", *_list_named(more)])
    return f"{known}; this makes it: snowrepro run {asked}" if word in read_experiments() else known


def merge_overrides(overrides: Sequence[str], more: Sequence[str]) -> list[str]:
    """Overrides with ``more``, which take the places of those of the same key; without more, as they are."""
    new = {each.partition("=")[0]: each for each in more}
    merged: list[str] = []
    for each in overrides:
        placed = new.get(each.partition("=")[0], each)
        if placed is each or placed not in merged:
            merged.append(placed)
    return [*merged, *(each for each in new.values() if each not in merged)]


def plan_remembered(word: str, store: str | Path, more: Sequence[str] = ()) -> Plan:
    """The runs of the remembered sweep that a word stands for, as its overrides and ``more`` name them now.

    Raises ConfigError.
    """
    name = require_sweep(word, store, more)
    remembered = read_record(name, store).usable_overrides()
    return make_plan(merge_overrides(remembered, [override_folder("store", str(store)), *more]), multirun=True)


def add_remembered_seeds(overrides: Sequence[str], store: str | Path) -> list[str]:
    """The overrides of a sweep with every seed that it was ever asked for with, if they name none themselves."""
    if any(o.startswith("seed=") for o in overrides):
        return list(overrides)
    seeds = {int(seed) for known in find_records(overrides, store) for seed in SEED.findall(" ".join(known.cells))}
    return [*overrides, f"seed={','.join(map(str, sorted(seeds)))}"] if seeds else list(overrides)


def find_records(overrides: Sequence[str], store: str | Path) -> list[Record]:
    """The remembered sweeps that ask for the same, whatever their seeds."""
    records, _ = read_all(store)
    return [record for record in records if _are_same(record.overrides, overrides)]


def _are_same(overrides: Sequence[str], others: Sequence[str]) -> bool:
    """Whether two lists of overrides ask for the same sweep, whatever their seeds."""
    return name_without_seeds(overrides) == name_without_seeds(others)


def name_without_seeds(overrides: Sequence[str]) -> str:
    """A sweep's name without its seeds."""
    return name_sweep(drop_seeds(overrides))


def drop_seeds(overrides: Sequence[str]) -> list[str]:
    """The overrides without their seeds."""
    return [o for o in overrides if not o.startswith("seed=")]


def list_sweeps(store: str | Path) -> list[str]:
    """The sweeps that a store remembers."""
    folder = Path(store) / SWEEPS
    entries = foreign.list_own(folder, Path(store))
    return [each.name for each in entries if NAME.fullmatch(each.name) and os.path.lexists(folder / each.name / RECORD)]
