"""How long a NetCDF file of the classic formats has to be, by its header.

The NetCDF library reads what is missing at the end of such a file as zeros.  The formats (classic, 64-bit offset and
64-bit data: CDF-1, CDF-2 and CDF-5) are defined in the NetCDF User's Guide, "File Format Specifications".
"""

import math
import struct
from dataclasses import dataclass
from pathlib import Path

MAGIC = (b"CDF\x01", b"CDF\x02", b"CDF\x05")
LONGEST_HEADER = 1 << 24  # bytes
SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 4, 6: 8, 7: 1, 8: 2, 9: 4, 10: 8, 11: 8}  # bytes of a value, by the code of a type


@dataclass(frozen=True)
class _Variable:
    """Where a variable begins in the file, how many bytes it (or one record of it) has, and whether it has records."""

    begin: int
    size: int
    has_records: bool


def find_declared_size(path: Path) -> int:
    """Return the least number of bytes that a classic NetCDF file has, by its header.  Raises ValueError if broken."""
    with path.open("rb") as file:
        header = _Header(file.read(LONGEST_HEADER))
    records = header.read_count()
    lengths = header.read_dimensions()
    header.skip_attributes()
    variables = [header.read_variable(lengths) for _ in header.count_list()]
    with_records = [variable for variable in variables if variable.has_records]
    padded = [_pad(variable.size) for variable in with_records]
    step = with_records[0].size if len(with_records) == 1 else sum(padded)  # a single one is not padded
    ends = [variable.begin + variable.size for variable in variables if not variable.has_records and variable.size]
    if records:
        ends += [variable.begin + (records - 1) * step + variable.size for variable in with_records if variable.size]
    return max(ends, default=0)


class _Header:
    """The header of a file, read from its beginning on; raises ValueError where it ends too early."""

    def __init__(self, content: bytes) -> None:
        version = content[3]
        self._content = content
        self._at = 4
        self._count = ">q" if version == 5 else ">I"
        self._offset = ">I" if version == 1 else ">q"

    def read_count(self) -> int:
        """Read a count, which has 8 bytes in CDF-5 and 4 in the others."""
        return self._read(self._count)

    def count_list(self) -> range:
        """Read the beginning of a list, its tag and its length."""
        self._read(">I")
        return range(self.read_count())

    def read_dimensions(self) -> list[int]:
        """Read the lengths of the dimensions; 0 is the one with records."""
        lengths = []
        for _ in self.count_list():
            self._skip(self.read_count())
            lengths.append(self.read_count())
        return lengths

    def skip_attributes(self) -> None:
        """Pass over a list of attributes."""
        for _ in self.count_list():
            self._skip(self.read_count())
            size = self._read_type_size()
            self._skip(size * self.read_count())

    def read_variable(self, lengths: list[int]) -> _Variable:
        """Read a variable; ``lengths``: of the dimensions."""
        self._skip(self.read_count())
        rank = self.read_count()
        numbers = [self.read_count() for _ in range(rank)]
        if any(number >= len(lengths) for number in numbers):
            raise ValueError("a variable has a dimension that is not there")
        self.skip_attributes()
        size = self._read_type_size()
        self.read_count()  # bytes, which older writers cut to 32 bits
        shape = [lengths[number] for number in numbers]
        has_records = bool(shape) and shape[0] == 0
        return _Variable(self._read(self._offset), size * math.prod(shape[has_records:]), has_records)

    def _read_type_size(self) -> int:
        code = self._read(">I")
        if code not in SIZES:
            raise ValueError(f"there is no type {code}")
        return SIZES[code]

    def _read(self, form: str) -> int:
        size = struct.calcsize(form)
        if self._at + size > len(self._content):
            raise ValueError("the header ends too early")
        (number,) = struct.unpack_from(form, self._content, self._at)
        self._at += size
        if number < 0:
            raise ValueError("a count is negative")
        return int(number)

    def _skip(self, size: int) -> None:
        """Pass over a name or values, which are padded."""
        self._at += _pad(size)
        if self._at > len(self._content):
            raise ValueError("the header ends too early")


def _pad(size: int) -> int:
    """Round up to a multiple of 4."""
    return size + -size % 4
