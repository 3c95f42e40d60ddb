"""Which particles and which nodes are whose, where the cases of a batch stand one after another in the same fields.

A run on its own is a batch of one case: all there is belongs to case 0, and the kernels are compiled so.
"""

import itertools
from collections.abc import Sequence

import numpy as np

from ..compiler import ti

LANES = 8  # particles that the straight-line laws handle at once; arrays are padded to a multiple
CHUNK = 128  # particles of one case side by side: what one thread adds up; cases of a batch begin on a multiple


@ti.data_oriented
class Cases:
    """The slots of particles and the columns of nodes of each case.

    ``counts`` of particles and ``sizes`` of grids, by case; ``first_slots`` and ``first_columns``: where each begins,
    and at the end where the last one ends; ``slots`` and ``grid``: what all need together.
    """

    def __init__(self, counts: Sequence[int], sizes: Sequence[tuple[int, int]]) -> None:
        self.number = len(counts)
        self.counts, self.sizes = tuple(counts), tuple(sizes)
        pad = LANES if self.number == 1 else CHUNK
        padded = [-(-count // pad) * pad for count in counts]
        self.first_slots = (0, *itertools.accumulate(padded))
        self.first_columns = (0, *itertools.accumulate(wide for wide, _ in sizes))
        self.slots = self.first_slots[-1]
        self.grid = (self.first_columns[-1], max(tall for _, tall in sizes))
        self.chunks = -(-self.slots // CHUNK)
        if self.number > 1:
            numbers = np.arange(self.number, dtype=np.int32)
            ends = np.add(self.first_slots[:-1], counts)
            self.case_of_chunk = _make_table(np.repeat(numbers, np.array(padded) // CHUNK))
            self.case_of_column = _make_table(np.repeat(numbers, [wide for wide, _ in sizes]))
            self.last_slot = _make_table(ends)
            self.first_chunk, self.last_chunk = (
                _make_table(np.array(slots) // CHUNK) for slots in (self.first_slots[:-1], self.first_slots[1:])
            )
            self.left, self.wide, self.tall = map(
                _make_table, (self.first_columns[:-1], [wide for wide, _ in sizes], [tall for _, tall in sizes])
            )

    def find_spans(self, chosen: Sequence[int]) -> list[tuple[int, int]]:
        """The slots of some cases, those of neighbours as one span: the first of each, and that behind its last."""
        spans: list[tuple[int, int]] = []
        for case in sorted(chosen):
            first, behind = self.first_slots[case : case + 2]
            spans.append((spans.pop()[0] if spans and spans[-1][1] == first else first, behind))
        return spans

    @ti.func
    def of_particle(self, p):
        """The case of particle p."""
        case = 0
        if ti.static(self.number > 1):
            case = self.case_of_chunk[p // CHUNK]
        return case

    @ti.func
    def of_column(self, i):
        """The case of the nodes of column i."""
        case = 0
        if ti.static(self.number > 1):
            case = self.case_of_column[i]
        return case

    @ti.func
    def end(self, case):
        """The slot behind the last particle of a case."""
        slot = int(self.counts[0])
        if ti.static(self.number > 1):
            slot = self.last_slot[case]
        return slot

    @ti.func
    def chunks_of(self, case):
        """The first chunk of a case and that behind its last."""
        first, behind = 0, int(self.chunks)
        if ti.static(self.number > 1):
            first, behind = self.first_chunk[case], self.last_chunk[case]
        return first, behind

    @ti.func
    def part(self, case):
        """Of the nodes the part that a case has: its first column, and how many nodes wide and tall it is."""
        part = ti.Vector([0, self.sizes[0][0], self.sizes[0][1]])
        if ti.static(self.number > 1):
            part = ti.Vector([self.left[case], self.wide[case], self.tall[case]])
        return part


def _make_table(values: Sequence[int] | np.ndarray) -> ti.Field:
    """A field of whole numbers with these values."""
    field = ti.field(ti.i32, shape=len(values))
    field.from_numpy(np.asarray(values, dtype=np.int32))
    return field
