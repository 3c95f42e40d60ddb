"""The base of all settings, and the type of names."""

import re
from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

MOST_LETTERS = 60
PLAIN = re.compile(r"\w([\w .,=+~()-]*[\w,=+~()-])?")
RESERVED = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\..*)?", re.IGNORECASE)  # names of devices on Windows
# Squares and products of settings stay within what a number of 64 bits holds.
SMALLEST, LARGEST = 1e-30, 1e30


class AddedLater:
    """Marks a setting, in ``Annotated``, that came after runs were stored without it: its default is what they did.

    It is written down only where it is not the default, so that the ids of those runs stay what they are.  An empty
    list is as good as none.
    """


class Settings(BaseModel):
    """Base of all sections: immutable, a misspelt key is an error, and no number is beyond reckoning."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @model_serializer(mode="wrap")
    def _leave_out_what_was_added_later(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """The settings as plain values, without those marked ``AddedLater`` that have their default."""
        plain: dict[str, Any] = handler(self)
        for name, field in type(self).model_fields.items():
            if AddedLater in field.metadata and getattr(self, name) in (field.default, ()):
                plain.pop(name, None)
        return plain

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


def _require_plain(name: str) -> str:
    """Check that a name can be a part of a folder's name on every system.  Raises ValueError."""
    if len(name) > MOST_LETTERS or not PLAIN.fullmatch(name) or RESERVED.fullmatch(name):
        raise ValueError(
            f"a name becomes part of a folder's: it should have 1 to {MOST_LETTERS} letters, digits, blanks and "
            "_ . , = + ~ ( ) -, begin with a letter, digit or _, and not end with a blank or a dot"
        )
    return name


Name = Annotated[str, AfterValidator(_require_plain)]
