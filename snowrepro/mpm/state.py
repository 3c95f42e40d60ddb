"""The state of a run: one table names every particle quantity, its unit and whether it is stored."""

from dataclasses import dataclass

import numpy as np
import taichi as ti

LANES = 8  # particles that the straight-line laws handle at once; arrays are padded to a multiple


@dataclass(frozen=True)
class Quantity:
    """One particle quantity.

    ``shape``: () scalar, (2,) vector, (2, 2) matrix.  ``unit``: in powers of length L, mass M and
    time T, as ``units.text`` writes it.  ``stored``: kept in each snapshot of a run.
    """

    name: str
    shape: tuple[int, ...]
    long_name: str
    unit: str
    stored: bool = False


PARTICLE_STATE = (
    Quantity("position", (2,), "position", "L", stored=True),
    Quantity("velocity", (2,), "velocity", "L/T", stored=True),
    Quantity("affine", (2, 2), "APIC affine momentum matrix B per unit mass", "L2/T"),
    Quantity("F_E", (2, 2), "elastic deformation gradient", "1"),
    Quantity("J_P", (), "plastic volume ratio det F_P", "1", stored=True),
    Quantity("density", (), "density of Eq. 2", "M/L3", stored=True),
    Quantity("young", (), "Young's modulus before hardening", "M/L/T2", stored=True),
    Quantity("poisson", (), "Poisson's ratio", "1", stored=True),
    Quantity("hardening", (), "hardening coefficient xi", "1", stored=True),
    Quantity("von_mises", (), "von Mises stress", "M/L/T2", stored=True),
    Quantity("mass", (), "mass at unit depth", "M"),
    Quantity("volume", (), "volume at the start, at unit depth", "L3"),
    Quantity("mu", (), "Lame parameter mu before hardening", "M/L/T2"),
    Quantity("lam", (), "Lame parameter lambda before hardening", "M/L/T2"),
    Quantity("force", (2,), "external force b as an acceleration", "L/T2"),
    Quantity("tau", (2, 2), "Kirchhoff stress", "M/L/T2"),
    Quantity("wave_speed2", (), "square of the elastic wave speed", "L2/T2"),
)


def _field(shape: tuple[int, ...], size):
    """A structure-of-arrays f64 field."""
    if shape == ():
        return ti.field(ti.f64, shape=size)
    if len(shape) == 1:
        return ti.Vector.field(shape[0], ti.f64, shape=size, layout=ti.Layout.SOA)
    return ti.Matrix.field(*shape, ti.f64, shape=size, layout=ti.Layout.SOA)


@ti.data_oriented
class Particles:
    """The fields of PARTICLE_STATE as attributes; ``count`` particles, padded to whole lanes."""

    def __init__(self, count: int):
        self.count = count
        self.lane_groups = -(-count // LANES)
        for quantity in PARTICLE_STATE:
            setattr(self, quantity.name, _field(quantity.shape, self.lane_groups * LANES))

    def read(self, name: str) -> np.ndarray:
        """A copy of one quantity, shape (count, *shape)."""
        return getattr(self, name).to_numpy()[: self.count]

    def write(self, name: str, values: np.ndarray) -> None:
        """Set one quantity for all particles; the padding repeats the last one."""
        field = getattr(self, name)
        values = np.asarray(values, dtype=np.float64)
        field.from_numpy(np.pad(values, [(0, field.shape[0] - self.count)] + [(0, 0)] * (values.ndim - 1), "edge"))


@ti.data_oriented
class Nodes:
    """Grid nodes: mass, momentum and velocity, and the floor's signed distance and normal at each."""

    def __init__(self, distance: np.ndarray, normal: np.ndarray):
        self.size = distance.shape
        self.mass = _field((), self.size)
        self.momentum = _field((2,), self.size)
        self.velocity = _field((2,), self.size)
        self.distance = _field((), self.size)
        self.normal = _field((2,), self.size)
        self.distance.from_numpy(distance)
        self.normal.from_numpy(normal)


# Why a frame ended; RUNNING means that it did not fail.
RUNNING, LEFT_GRID, BAD_STRAIN, TOO_MANY_SUBSTEPS = range(4)


@ti.data_oriented
class Ledger:
    """What a frame reports back: failure, time, substeps, the range of time steps, particles that ended inside."""

    def __init__(self):
        self.status = ti.field(ti.i32, shape=())
        self.particle = ti.field(ti.i32, shape=())
        self.substeps = ti.field(ti.i32, shape=())
        self.ended_inside = ti.field(ti.i32, shape=())
        self.elapsed = ti.field(ti.f64, shape=())
        self.smallest_step = ti.field(ti.f64, shape=())
        self.top_speed2 = ti.field(ti.f64, shape=())
