"""What fields hold into an array and back: one kernel each way, instead of one for every field.

Columns of the array are the components of the quantities in the order of their table.  Only those from ``first`` on and
before ``last`` are copied, so that a single quantity takes no kernel of its own.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..compiler import as_template, ti
from .ledger import TOTALS

STATUS, UNDER_WAY, FIRST_TOTAL = 0, 2, 8  # columns of an outcome; the last is that of the first of TOTALS


@as_template
@dataclass(frozen=True)
class Columns:
    """A quantity as the kernels see it: ``field``, ``shape``, its ``first`` column and that behind its ``last``."""

    field: ti.Field
    shape: tuple[int, ...]
    first: int
    last: int


@ti.data_oriented
class Selection:
    """Some quantities of ``state.Particles``, side by side in ``width`` columns; ``places``: where each stands."""

    def __init__(self, particles: Any, names: Sequence[str]) -> None:
        shapes = {name: particles.shapes[name] for name in names}
        ends = tuple(itertools.accumulate(map(math.prod, shapes.values()), initial=0))
        self.width = ends[-1]
        self.shapes = shapes
        self.places = dict(zip(names, itertools.pairwise(ends), strict=True))
        self.columns = tuple(Columns(getattr(particles, name), shapes[name], *self.places[name]) for name in names)


@ti.kernel
def copy_out(particles: ti.template(), values: ti.types.ndarray(dtype=ti.f64, ndim=2), first: ti.i32, last: ti.i32):
    """Copy quantities of all particles to ``values`` (n, last - first)."""
    for p in range(particles.count):
        for columns in ti.static(particles.columns):
            if first <= columns.first and columns.last <= last:
                put(columns, p, values, p, first)


@ti.kernel
def copy_in(particles: ti.template(), values: ti.types.ndarray(dtype=ti.f64, ndim=2), first: ti.i32, last: ti.i32):
    """Copy ``values`` (n, last - first) to quantities of all particles; the padding repeats the last one."""
    for slot in range(particles.slots):
        for columns in ti.static(particles.columns):
            if first <= columns.first and columns.last <= last:
                take(columns, slot, values, ti.min(slot, particles.count - 1), first)


@ti.kernel
def copy_slots_out(
    selection: ti.template(), values: ti.types.ndarray(dtype=ti.f64, ndim=2), first_slot: ti.i32, last_slot: ti.i32
):
    """Copy a selection of quantities to ``values``, a row a slot, from a first slot on and before a last one."""
    for p in range(first_slot, last_slot):
        for columns in ti.static(selection.columns):
            put(columns, p, values, p - first_slot, 0)


@ti.kernel
def copy_slots_in(
    selection: ti.template(),
    cases: ti.template(),
    values: ti.types.ndarray(dtype=ti.f64, ndim=2),
    first_slot: ti.i32,
    last_slot: ti.i32,
):
    """Copy ``values``, a row a slot, to a selection of quantities; the padding of a case repeats its last particle."""
    for slot in range(first_slot, last_slot):
        row = ti.min(slot, cases.end(cases.of_particle(slot)) - 1) - first_slot
        for columns in ti.static(selection.columns):
            take(columns, slot, values, row, 0)


@ti.kernel
def copy_outcomes(ledger: ti.template(), values: ti.types.ndarray(dtype=ti.f64, ndim=2)):
    """Copy what the ledger says of each case to a row of ``values``: the fields of ``frame.Outcome``, then TOTALS."""
    for case in range(ledger.cases.number):
        for column, field in ti.static(
            enumerate(
                (
                    ledger.status, ledger.particle, ledger.under_way, ledger.substeps, ledger.ended_inside,
                    ledger.elapsed, ledger.smallest_step, ledger.top_speed2,
                )
            )
        ):  # fmt: skip
            values[case, column] = ti.cast(field[case], ti.f64)
        for k in ti.static(range(len(TOTALS))):
            values[case, FIRST_TOTAL + k] = ledger.totals[case][k]


@ti.func
def put(columns: ti.template(), p, values: ti.template(), row, first):
    """Put a quantity of particle p into a row of ``values``, whose columns are counted from ``first``."""
    for k in ti.static(range(columns.last - columns.first)):
        column = columns.first - first + k
        if ti.static(len(columns.shape) == 0):
            values[row, column] = columns.field[p]
        elif ti.static(len(columns.shape) == 1):
            values[row, column] = columns.field[p][k]
        else:
            values[row, column] = columns.field[p][k // columns.shape[1], k % columns.shape[1]]


@ti.func
def take(columns: ti.template(), p, values: ti.template(), row, first):
    """Take a quantity of particle p from a row of ``values``, whose columns are counted from ``first``."""
    for k in ti.static(range(columns.last - columns.first)):
        value = ti.cast(values[row, columns.first - first + k], float)
        if ti.static(len(columns.shape) == 0):
            columns.field[p] = value
        elif ti.static(len(columns.shape) == 1):
            columns.field[p][k] = value
        else:
            columns.field[p][k // columns.shape[1], k % columns.shape[1]] = value
