"""The axes of a sweep: the overrides of one key, one for each value."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from hydra.errors import HydraException

from ..composition.hydra_private import (
    Override,
    OverridesParser,
    OverrideType,
    RangeSweep,
    as_text,
    has_list_in_list,
    is_range,
    jobs_of,
    make_parser,
)
from ..errors import ConfigError

MOST_VALUES = 100_000


@dataclass(frozen=True)
class Axis:
    """The overrides of one key, one for each value.

    ``name`` is the key without ``+``, ``~`` and ``@package``.  ``values`` are what Hydra reads in the overrides; None
    unless all of them just set a number or a text.
    """

    name: str
    overrides: tuple[str, ...]
    values: tuple[Any, ...] | None

    def value(self, index: int) -> Any:
        """What Hydra reads in one of the overrides; only of an axis that has ``values``."""
        assert self.values is not None
        return self.values[index]


def make_axis(override: Override) -> Axis:
    """The overrides that a sweep makes of one.  Raises ConfigError if it makes none."""
    require_alone(override)
    if is_range(override):
        raise ConfigError(
            f"'{override.input_line}' is a range, which only a design makes values of: add one, as in design=sobol"
        )
    try:
        if override.is_discrete_sweep():
            _require_finite_range(override)
            values: list[Any] = list(
                override.sweep_iterator()
            )  # once: a shuffled sweep comes in another order each time
            texts = [f"{override.get_key_element()}={as_text(value)}" for value in values]
        else:
            (texts,) = jobs_of([override])
            values = [override.value()]
        plain = _plain_values(override, values, texts)
    except HydraException as error:
        raise ConfigError(f"{override.input_line}: {error}") from error
    if not texts:
        raise ConfigError(f"'{override.input_line}' names no run")
    return Axis(override.key_or_group, tuple(texts), plain)


def require_alone(override: Override) -> None:
    """Raise ConfigError where a range or a choice stands in a list beside other values."""
    if has_list_in_list(override):
        raise ConfigError(
            f"'{override.input_line}': a range or a choice cannot stand beside other values: list them all"
        )


def make_axis_of_values(override: Override, values: Sequence[Any]) -> Axis:
    """The axis of some values of a key, which an override names.  Raises ConfigError."""
    texts = [f"{override.get_key_element()}={as_text(value)}" for value in values]
    try:
        return Axis(override.key_or_group, tuple(texts), _plain_values(override, values, texts))
    except HydraException as error:
        raise ConfigError(f"{override.input_line}: {error}") from error


def _require_finite_range(override: Override) -> None:
    """Raises ConfigError for a range of too many numbers, before they are all written out."""
    swept = override.value()
    if not isinstance(swept, RangeSweep) or swept.start is None or swept.stop is None:
        return
    try:
        count = float(swept.stop - swept.start) / swept.step if swept.step else math.inf
    except OverflowError:
        count = math.inf
    if not count <= MOST_VALUES:  # or not a number
        raise ConfigError(f"'{override.input_line}' names {count:,.0f} runs, at most {MOST_VALUES:,} are allowed")


def _plain_values(override: Override, values: Sequence[Any], texts: Sequence[str]) -> tuple[Any, ...] | None:
    """What Hydra reads in ``texts``, written from ``values``; None unless they just set numbers and texts."""
    if override.type != OverrideType.CHANGE or override.package is not None:
        return None
    # A number is read back as it was; a text may not be: str(1) writes 1.
    read = tuple(
        v if _is_number(v) else _parser().parse_override(text).value() for v, text in zip(values, texts, strict=True)
    )
    return read if all(isinstance(v, bool | int | float) or _is_text(v) for v in read) else None


@cache
def _parser() -> OverridesParser:
    return make_parser()


def _is_number(value: Any) -> bool:
    return isinstance(value, bool | int) or (isinstance(value, float) and math.isfinite(value))


def _is_text(value: Any) -> bool:
    """Whether a value is a text that means nothing to OmegaConf."""
    return isinstance(value, str) and "${" not in value and value != "???"
