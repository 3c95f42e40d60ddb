"""The settings that a design samples: where a place from 0 to 1 lies in their ranges."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..composition.hydra_private import IntervalSweep, Override
from ..composition.ranges import CHOICE, INTERVAL, LOG, WHOLE
from ..errors import ConfigError

DIGITS = 6  # of a sampled number
LARGEST_WHOLE = 2**31


@dataclass(frozen=True)
class Factor:
    """A setting that is sampled.

    ``key``: as in overrides; ``low`` and ``high``: of a range of numbers, whose ``scale`` is "interval", "log" or
    "whole"; ``choices``: of a setting with scale "choice".
    """

    key: str
    scale: str
    low: float = 0.0
    high: float = 0.0
    choices: Sequence[Any] = ()

    @property
    def count(self) -> int:
        """The number of different values; 0 for a continuous setting."""
        return int(self.high - self.low) + 1 if self.scale == WHOLE else len(self.choices)

    def place(self, u: float) -> Any:
        """Return the value at a place ``u`` from 0 to 1; numbers are rounded to DIGITS digits."""
        if self.count:
            index = min(int(u * self.count), self.count - 1)
            return self.choices[index] if self.choices else int(self.low) + index
        if self.scale == LOG:
            value = math.exp(math.log(self.low) + u * (math.log(self.high) - math.log(self.low)))
        else:
            value = self.low + u * (self.high - self.low)
        return float(f"{value:.{DIGITS}g}")

    def describe(self) -> str:
        """Describe the range as one types it."""
        if self.choices:
            return f"choice({','.join(map(str, self.choices))})"
        return f"{self.scale}({self.low:g},{self.high:g})"


def read_factor(override: Override) -> Factor:
    """Read the range of an override that is sampled.  Raises ConfigError where it has no two values."""
    key, value = override.get_key_element(), override.value()
    if not isinstance(value, IntervalSweep):
        return Factor(key, CHOICE, choices=tuple(override.sweep_iterator()))
    low, high = float(value.start or 0), float(value.end or 0)
    scale = next((tag for tag in (LOG, WHOLE) if tag in value.tags), INTERVAL)
    if not -math.inf < low < high < math.inf:
        raise ConfigError(f"'{override.input_line}': the first number of a range should be the lower one")
    if scale == WHOLE and high - low >= LARGEST_WHOLE:
        raise ConfigError(f"'{override.input_line}': has more than {LARGEST_WHOLE:,} whole numbers")
    return Factor(key, scale, low, high)
