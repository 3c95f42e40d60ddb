"""The settings of a sweep that a design samples, and the jobs that come of it."""

import importlib
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType
from typing import TYPE_CHECKING

from ..composition.hydra_private import Override, as_text, is_sampled
from ..composition.ranges import EXAMPLE
from ..errors import ConfigError
from ..settings.design import Design
from .axes import Axis, make_axis_of_values, require_alone
from .factors import Factor, read_factor

if TYPE_CHECKING:
    import numpy as np

Job = tuple[int, ...]  # which of its values each axis has


@dataclass(frozen=True)
class Sample:
    """A design, and the settings that it samples: in the order of their names, whatever their order in a command."""

    design: Design
    factors: tuple[Factor, ...]

    @property
    def keys(self) -> list[str]:
        """The keys of the factors."""
        return [factor.key for factor in self.factors]

    @cached_property
    def places(self) -> "np.ndarray":
        """Where each point lies in the range of each factor, from 0 to 1: (point, factor)."""
        return _designs().make_places(self.design, len(self.factors))

    def __len__(self) -> int:
        count: int = _designs().count_places(self.design, len(self.factors))
        return count


@dataclass(frozen=True)
class DrawnAxis:
    """The different values of a factor, and which of them each point of a sample has."""

    axis: Axis
    of_point: Sequence[int]


def read_sample(design: Design, overrides: Sequence[Override]) -> Sample:
    """Read what a design samples.  Raises ConfigError where there is nothing, or what has one value alone."""
    factors = {each.get_key_element(): read_factor(each) for each in overrides if is_sampled(each)}
    for override in overrides:
        require_alone(override)
    if not factors:
        raise ConfigError(f"design={design.name} has nothing to sample: write a range, as in {EXAMPLE}")
    if "seed" in factors:  # which a report takes from all runs that were asked for
        raise ConfigError("seed: the seeds of runs are listed and not sampled, as in seeds=3")
    return Sample(design, tuple(factors[key] for key in sorted(factors)))


def draw_axes(sample: Sample, overrides: Mapping[str, Override]) -> dict[str, DrawnAxis]:
    """Draw the values of each factor, by its key, as overrides name them.  Raises ConfigError."""
    drawn = {}
    for factor, places in zip(sample.factors, sample.places.T, strict=True):
        values = [factor.place(float(place)) for place in places]
        texts = [as_text(value) for value in values]  # a list, as a value, is no key
        different = dict(zip(texts, values, strict=True))
        number = {text: index for index, text in enumerate(different)}
        axis = make_axis_of_values(overrides[factor.key], list(different.values()))
        drawn[factor.key] = DrawnAxis(axis, [number[text] for text in texts])
    return drawn


def list_jobs(axes: Mapping[str, Axis], drawn: Mapping[str, DrawnAxis]) -> Iterator[tuple[int | None, Job]]:
    """List the jobs of a sweep with their points: at each point all combinations of the axes that are not drawn."""
    counts = {len(each.of_point) for each in drawn.values()}
    for point in range(counts.pop()) if counts else (None,):
        choices = (
            [drawn[key].of_point[point]] if point is not None and key in drawn else range(len(axis.overrides))
            for key, axis in axes.items()
        )
        yield from ((point, job) for job in itertools.product(*choices))


def _designs() -> ModuleType:
    """What makes designs, with NumPy and SciPy: loaded where there is a sample, so that other sweeps stay lean."""
    return importlib.import_module(".design", __package__)
