"""All runs of a sweep, of which few are composed by Hydra.

Composing takes Hydra some 50 ms a run.  But most axes of a sweep only put other values where a composed config has
some (*leaves*: ``pressure=1,2``), or choose options that fill one section and know nothing of the rest (*options*:
``shape=ball,star``).  So Hydra composes the first run of each combination of the other, *structural* axes, and in it
the first run with an option that was not there yet; all others are put together from sections of these, and validated.

What comes out equals composing each run.  A run that cannot be put together is composed, so its error is Hydra's own.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from ..composition.compose import compose_raw, list_option_files, option_files, plain_settings, validate
from ..composition.drawings import with_outline_read
from ..composition.hydra_private import CachingConfigRepository, ConfigDefault, Override
from ..composition.own_laws import check_own_laws
from ..errors import ConfigError
from ..settings.base import Settings
from ..settings.config import PARTS, Config
from ..store.run import Run
from .axes import Axis, make_axis
from .sample import Job, Sample, draw_axes, list_jobs

MOST_RUNS = 100_000


@dataclass(frozen=True, slots=True)
class Planned:
    """A run of a sweep, and the overrides that Hydra's sweeper would give to a launcher for it.

    ``point``: which point of a sample it is, from 0 on; None without a sample.
    """

    run: Run
    overrides: tuple[str, ...]
    point: int | None = None


def enumerate_runs(
    overrides: Sequence[Override], part: tuple[int, int] = (1, 1), sample: Sample | None = None
) -> tuple[Planned, ...]:
    """The runs of a sweep in the order in which Hydra's sweeper would launch them; of a ``sample`` point by point.

    Of a ``part`` (i, n) only every n-th run, from the i-th on.  Raises ConfigError for the first run that is wrong,
    or if there is none.
    """
    always = [str(o.input_line) for o in overrides if o.is_hydra_override()]
    swept = [str(o.input_line) for o in overrides if o.is_hydra_override() and o.is_sweep_override()]
    if swept:
        raise ConfigError(f"a sweep cannot vary Hydra's own settings: {', '.join(swept)}")
    # As in Hydra's sweeper: the last override of a key counts, in the place of the first.
    last = {o.get_key_element(): o for o in overrides if not o.is_hydra_override()}
    axes = {key: make_axis(override) for key, override in last.items() if not sample or key not in sample.keys}
    count = math.prod(len(axis.overrides) for axis in axes.values()) * (len(sample) if sample else 1)
    if count > MOST_RUNS:
        raise ConfigError(f"this names {count:,} runs, at most {MOST_RUNS:,} are allowed")
    drawn = draw_axes(sample, last) if sample else {}
    axes = {key: drawn[key].axis if key in drawn else axes[key] for key in last}
    chosen = itertools.islice(list_jobs(axes, drawn), part[0] - 1, None, part[1])
    assembly = _Assembly(tuple(axes.values()), always)
    return tuple([Planned(Run(assembly.config(job)), assembly.overrides(job), point) for point, job in chosen])


@dataclass(frozen=True)
class _Roles:
    """What the axes with several values do, by their index."""

    leaves: dict[int, tuple[str, ...]]  # and the leaf's place
    options: dict[str, int]  # by their section
    structural: tuple[int, ...]

    def sections(self) -> dict[str, list[int]]:
        """The sections that vary, and the axes that they vary with."""
        axes = {name: [i] for name, i in self.options.items()}
        for i, (name, *inner) in self.leaves.items():
            if inner:
                axes.setdefault(name, []).append(i)
        return axes


def _roles(axes: Sequence[Axis], job: Job, settings: Mapping[str, Any], files: CachingConfigRepository) -> _Roles:
    """Tell leaves, options and structural axes apart by a composed job."""
    several = [i for i, axis in enumerate(axes) if len(axis.overrides) > 1]
    leaves = {
        i: tuple(axes[i].name.split("."))
        for i in several
        if axes[i].values is not None and not files.group_exists(axes[i].name) and not _is_set_twice(i, axes, files)
    }
    references = list(_references(settings))
    leaves = {i: path for i, path in leaves.items() if _is_leaf(path, axes[i].value(job[i]), settings, references)}
    options: dict[str, int] = {}
    if not references and not _defaults_vary(files):
        options = {axes[i].name: i for i in several if _is_confined(axes[i], settings, files)}
    return _Roles(leaves, options, tuple(i for i in several if i not in leaves and i not in options.values()))


def _is_leaf(path: Sequence[str], value: Any, settings: Any, references: Sequence[str]) -> bool:
    """Whether a value just stands at its place, and no interpolation carries it elsewhere.

    An interpolation that holds another, or calls a resolver, may mean any place.
    """
    for part in path:
        settings = settings.get(part) if isinstance(settings, dict) else None
    at_its_place = type(settings) is type(value) and settings == value
    return at_its_place and not any(
        text.count("${") > 1 or ":" in text or any(part in text for part in path) for text in references
    )


def _is_set_twice(index: int, axes: Sequence[Axis], files: CachingConfigRepository) -> bool:
    """Whether an override of another key sets the same, a part of it, or what it is a part of.

    Options do not count: Hydra chooses them before it sets values.
    """
    path = axes[index].name.split(".")
    for i, axis in enumerate(axes):
        other = axis.name.split(".")
        shared = min(len(path), len(other))
        if i != index and path[:shared] == other[:shared] and not _is_choice(axis, files):
            return True
    return False


def _is_choice(axis: Axis, files: CachingConfigRepository) -> bool:
    """Whether an axis chooses options of a group by their names."""
    return (
        axis.values is not None
        and all(isinstance(value, str) for value in axis.values)
        and files.group_exists(axis.name)
    )


def _is_confined(axis: Axis, settings: Mapping[str, Any], files: CachingConfigRepository) -> bool:
    """Whether an axis chooses options that fill the section of their group and do nothing else."""
    return (
        _is_choice(axis, files)
        and isinstance(settings.get(axis.name), dict)
        and all(_fills_its_section(files, axis.name, value) for value in axis.values or ())
    )


def _fills_its_section(files: CachingConfigRepository, group: str, option: str) -> bool:
    """Whether an option goes where its group does, and builds on nothing but options of the same kind."""
    content = files.load_config(f"{group}/{option}") if "/" not in option else None
    return (
        content is not None
        and content.header["package"] is None
        and all(
            isinstance(default, ConfigDefault)
            and default.package is None
            and (default.path == "_self_" or _fills_its_section(files, group, str(default.path)))
            for default in content.defaults_list or ()
        )
    )


def _defaults_vary(files: CachingConfigRepository) -> bool:
    """Whether a choice may follow from others, by an interpolation in the defaults list of some file."""
    return any(map(_has_varying_defaults, list_option_files(files)))


def _has_varying_defaults(path: Path) -> bool:
    text = path.read_text(encoding="utf-8", errors="replace")
    if "${" not in text:
        return False
    try:
        read = yaml.safe_load(text)
    except yaml.YAMLError:
        return True
    return _holds_varying_defaults(read)


def _holds_varying_defaults(value: Any) -> bool:
    """Whether a defaults list anywhere in a file's content, a variant's too, holds an interpolation."""
    if isinstance(value, list):
        return any(map(_holds_varying_defaults, value))
    if not isinstance(value, dict):
        return False
    return "${" in str(value.get("defaults")) or any(map(_holds_varying_defaults, value.values()))


def _references(settings: Any) -> Iterator[str]:
    """The interpolations in settings."""
    if isinstance(settings, dict | list):
        for inner in settings.values() if isinstance(settings, dict) else settings:
            yield from _references(inner)
    elif isinstance(settings, str) and "${" in settings:
        yield settings


@dataclass
class _Structure:
    """What the runs of one combination of structural values are made of."""

    first: Config
    values: dict[str, Any]  # of the first one, by name: validated sections, and the settings beside them
    settings: dict[tuple[str, int | None], dict[str, Any]] = field(default_factory=dict)  # of sections by option
    sections: dict[tuple, Settings] = field(default_factory=dict)  # validated, by name and the axes' values


class _Assembly:
    """Makes the runs of a sweep from a few that are composed."""

    def __init__(self, axes: Sequence[Axis], always: Sequence[str]) -> None:
        self.axes, self.always = axes, always
        self.roles = _Roles({}, {}, ())  # as the first run shows them
        self.is_composed = False
        self.sections: dict[str, list[int]] = {}
        self.structures: dict[Job, _Structure] = {}

    def overrides(self, job: Job) -> tuple[str, ...]:
        """A job's overrides as Hydra's sweeper writes them."""
        return tuple([axis.overrides[i] for axis, i in zip(self.axes, job, strict=True)])

    def config(self, job: Job) -> Config:
        """A job's run, validated.  Raises ConfigError."""
        structure = self.structures.get(self._structure_of(job)) if self.is_composed else None
        if structure:
            # Where a section is not known, or something is wrong: what is wrong is best said of the whole.
            with suppress(KeyError, ValidationError, ConfigError):
                return self._assemble(structure, job)
        return self._compose(job)

    def _structure_of(self, job: Job) -> Job:
        return tuple([job[i] for i in self.roles.structural])

    def _option(self, section: str, job: Job) -> int | None:
        """Which option a section has in a job; None where no axis chooses it."""
        return job[self.roles.options[section]] if section in self.roles.options else None

    def _compose(self, job: Job) -> Config:
        """Have Hydra compose a job, and keep what other jobs can be made of."""
        raw = compose_raw([*self.always, *self.overrides(job)])
        config = validate(raw)
        settings = plain_settings(raw, resolve=False)
        if not self.is_composed:
            self.is_composed = True
            self.roles = _roles(self.axes, job, settings, option_files(self.always))
            self.sections = self.roles.sections()
        if self._is_as_expected(job, settings):
            resolved = plain_settings(raw)
            known = {name: value for part in PARTS for name, value in getattr(config, part)}
            sections = {name: known[name] for name in resolved if isinstance(known.get(name), Settings)}
            new = _Structure(config, {**resolved, **sections})
            structure = self.structures.setdefault(self._structure_of(job), new)
            structure.settings |= {(name, self._option(name, job)): resolved[name] for name in self.sections}
        return config

    def _is_as_expected(self, job: Job, settings: dict[str, Any]) -> bool:
        """Whether the axes do in a composed job what they did in the first."""
        references = list(_references(settings))
        return not (references and self.roles.options) and all(
            _is_leaf(path, self.axes[i].value(job[i]), settings, references) for i, path in self.roles.leaves.items()
        )

    def _assemble(self, structure: _Structure, job: Job) -> Config:
        """A job made of what is known.  Raises KeyError where a section is not, and ValidationError."""
        changed = {}
        for name, axes in self.sections.items():
            key = (name, *[job[i] for i in axes])
            if key not in structure.sections:
                structure.sections[key] = self._section(structure, name, job)
            changed[name] = structure.sections[key]
        for i, path in self.roles.leaves.items():
            if len(path) == 1:
                changed[path[0]] = self.axes[i].value(job[i])
        return Config.model_validate({name: _part(structure, name, changed) for name in PARTS})

    def _section(self, structure: _Structure, name: str, job: Job) -> Settings:
        """A section that varies, as it is in a job.

        Raises KeyError if it is not known, and ValidationError or ConfigError.
        """
        settings = structure.settings[name, self._option(name, job)]
        for i, path in self.roles.leaves.items():
            if path[0] == name:
                settings = _put(settings, path[1:], self.axes[i].value(job[i]))
        checked = check_own_laws({name: with_outline_read(name, settings)})
        return type(structure.values[name]).model_validate(checked[name])


def _part(structure: _Structure, name: str, changed: Mapping[str, Any]) -> Settings:
    """One part of a configuration with what is changed of it; without changes, the same one for all runs."""
    first = getattr(structure.first, name)
    kind = type(first)
    if not changed.keys() & kind.model_fields.keys():
        return first
    values = {**structure.values, **changed}
    part = kind.model_validate({key: values[key] for key in kind.model_fields if key in values})
    # The names that were given are the same in all; a set of them takes more memory than all else of a run.
    object.__setattr__(part, "__pydantic_fields_set__", first.model_fields_set)
    return part


def _put(settings: dict[str, Any], path: Sequence[str], value: Any) -> dict[str, Any]:
    """Settings with another value at a place."""
    first, *rest = path
    return {**settings, first: _put(settings[first], rest, value) if rest else value}
