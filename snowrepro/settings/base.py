"""The base of all settings."""

from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel, ConfigDict, model_validator

# Squares and products of settings stay within what a number of 64 bits holds.
SMALLEST, LARGEST = 1e-30, 1e30


class Settings(BaseModel):
    """Base of all sections: immutable, a misspelt key is an error, and no number is beyond reckoning."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @model_validator(mode="after")
    def _numbers_can_be_reckoned_with(self) -> "Settings":
        for name, value in self:
            for number in _list_numbers(value):
                if number and not SMALLEST <= abs(number) <= LARGEST:
                    raise ValueError(
                        f"{name}: a number other than 0 must be {SMALLEST:g} to {LARGEST:g} in size (got {number:.6g})"
                    )
        return self


def _list_numbers(value: Any) -> Iterator[float]:
    """The numbers in a field, however deep in tuples."""
    if isinstance(value, float):
        yield value
    elif isinstance(value, int):
        yield float(value) if value.bit_length() < 1000 else float("inf")
    elif isinstance(value, tuple):
        for inner in value:
            yield from _list_numbers(inner)
