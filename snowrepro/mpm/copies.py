"""Quantities of particles into an array and back: one kernel each way, instead of one for every field.

Columns of the array are the components of the quantities in the order of their table.  Only those from ``first`` on and
before ``last`` are copied, so that a single quantity takes no kernel of its own.
"""

from dataclasses import dataclass

import taichi as ti


@dataclass(frozen=True)
class Columns:
    """A quantity as the kernels see it: ``field``, ``shape``, its ``first`` column and that behind its ``last``."""

    field: ti.Field
    shape: tuple[int, ...]
    first: int
    last: int


@ti.kernel
def copy_out(particles: ti.template(), values: ti.types.ndarray(dtype=ti.f64, ndim=2), first: ti.i32, last: ti.i32):
    """Copy quantities of all particles to ``values`` (n, last - first)."""
    for p in range(particles.count):
        for columns in ti.static(particles.columns):
            if first <= columns.first and columns.last <= last:
                for k in ti.static(range(columns.last - columns.first)):
                    column = columns.first - first + k
                    if ti.static(len(columns.shape) == 0):
                        values[p, column] = columns.field[p]
                    elif ti.static(len(columns.shape) == 1):
                        values[p, column] = columns.field[p][k]
                    else:
                        values[p, column] = columns.field[p][k // columns.shape[1], k % columns.shape[1]]


@ti.kernel
def copy_in(particles: ti.template(), values: ti.types.ndarray(dtype=ti.f64, ndim=2), first: ti.i32, last: ti.i32):
    """Copy ``values`` (n, last - first) to quantities of all particles; the padding repeats the last one."""
    for slot in range(particles.slots):
        p = ti.min(slot, particles.count - 1)
        for columns in ti.static(particles.columns):
            if first <= columns.first and columns.last <= last:
                for k in ti.static(range(columns.last - columns.first)):
                    value = ti.cast(values[p, columns.first - first + k], float)
                    if ti.static(len(columns.shape) == 0):
                        columns.field[slot] = value
                    elif ti.static(len(columns.shape) == 1):
                        columns.field[slot][k] = value
                    else:
                        columns.field[slot][k // columns.shape[1], k % columns.shape[1]] = value
