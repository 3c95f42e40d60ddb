"""The state of a run: one table names every particle quantity, its unit, first value and whether it is stored.

A material law adds the quantities that it declares itself: ``list_quantities``.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..compiler import ti
from ..laws.choose import make_material
from ..laws.quantity import Quantity
from ..scene.build import Scene
from ..settings.case import Case, Material
from .cases import LANES, Cases
from .copies import Columns, copy_in, copy_out
from .indenter import Indenter
from .ledger import NODE, PARTICLE, TOTALS, accounts_of

PARTICLE_STATE = (
    Quantity("position", (2,), "position", "L", lambda s, m: s.positions, stored=True),
    Quantity("velocity", (2,), "velocity", "L/T", stored=True),
    Quantity("affine", (2, 2), "APIC affine momentum matrix B per unit mass", "L2/T"),
    Quantity("F_E", (2, 2), "elastic deformation gradient", "1", lambda s, m: np.eye(2)),
    Quantity("J_P", (), "plastic volume ratio det F_P", "1", lambda s, m: 1.0, stored=True),
    Quantity("density", (), "density of Eq. 2", "M/L3", lambda s, m: m.rho, stored=True),
    Quantity("young", (), "Young's modulus before hardening", "M/L/T2", lambda s, m: m.E, stored=True),
    Quantity("poisson", (), "Poisson's ratio", "1", lambda s, m: m.nu, stored=True),
    Quantity("hardening", (), "hardening coefficient xi", "1", lambda s, m: m.xi, stored=True),
    Quantity("von_mises", (), "von Mises stress", "M/L/T2", stored=True),
    Quantity("mass", (), "mass at unit depth", "M", lambda s, m: s.mass),
    Quantity("volume", (), "volume at the start, at unit depth", "L3", lambda s, m: s.volume),
    Quantity("mu", (), "Lame parameter mu before hardening", "M/L/T2", lambda s, m: m.mu),
    Quantity("lam", (), "Lame parameter lambda before hardening", "M/L/T2", lambda s, m: m.lam),
    Quantity("factor", (), "hardening factor of Eq. 1", "1", lambda s, m: 1.0),
    Quantity("force", (2,), "external force b as an acceleration", "L/T2"),
    Quantity("tau", (2, 2), "Kirchhoff stress", "M/L/T2"),
    Quantity("slip", (2,), "elastic slip along the floor, where contact is by springs", "L"),
    Quantity("wave_speed2", (), "square of the elastic wave speed", "L2/T2"),
    *(Quantity(account.name, account.shape, account.long_name, account.unit) for account in accounts_of(PARTICLE)),
)

SHAPES = {quantity.name: quantity.shape for quantity in PARTICLE_STATE}
# What Particles has beside the fields of its quantities, and so none of these may be called.
ATTRIBUTES = (
    "count", "lanes", "lane_groups", "slots", "quantities", "shapes", "places", "columns", "history", "books",
    "gathered", "read", "write", "write_all", "start",
)  # fmt: skip


def list_quantities(case: Case) -> tuple[Quantity, ...]:
    """All quantities of a case's particles: those of every run, and what its material law keeps."""
    return (*PARTICLE_STATE, *make_material(case).STATE)


def make_first_values(quantities: Sequence[Quantity], scene: Scene, material: Material) -> dict[str, np.ndarray]:
    """The first value of each quantity of a scene's particles, by name: undeformed and at rest."""
    count = len(scene.positions)
    return {q.name: np.broadcast_to(q.first(scene, material), (count, *q.shape)) for q in quantities}


def _field(shape: tuple[int, ...], size: int | tuple[int, ...], kind: Any = float) -> ti.Field:
    """A structure-of-arrays field, by default of the run's precision."""
    if shape == ():
        return ti.field(kind, shape=size)
    if len(shape) == 1:
        return ti.Vector.field(shape[0], kind, shape=size, layout=ti.Layout.SOA)
    return ti.Matrix.field(*shape, kind, shape=size, layout=ti.Layout.SOA)


def _fill(field: ti.Field, values: np.ndarray) -> None:
    """Set a field in its own precision."""
    field.from_numpy(values.astype(ti.lang.util.to_numpy_type(field.dtype)))


@dataclass(frozen=True)
class Book:
    """An account as kernels see it: its ``field``, and of each component the place of its sum in TOTALS."""

    field: ti.Field
    places: tuple[int, ...]


def _books(owner: "Particles | Nodes", keeper: str) -> tuple[Book, ...]:
    """The books of one keeper's accounts, whose fields the owner has."""
    return tuple(
        Book(getattr(owner, account.name), tuple(map(TOTALS.index, account.totals))) for account in accounts_of(keeper)
    )


@ti.data_oriented
class Particles:
    """The fields of PARTICLE_STATE and of a law's ``own`` quantities as attributes.

    ``count`` particles, padded to whole lane groups of ``lanes`` each.  ``history``: the fields that a material law
    changes, J_P first; ``books``: of what each cause gave in the frame.
    """

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Return the field of a quantity."""

    def __init__(self, count: int, own: tuple[Quantity, ...] = (), lanes: int = LANES) -> None:
        self.count = count
        self.lanes = lanes
        self.lane_groups = -(-count // lanes)
        self.slots = self.lane_groups * lanes
        # Columns of memory a multiple of 4,096 bytes apart would all be kept in the same few places of the cache.
        room = self.slots + (LANES if self.slots % 512 == 0 else 0)
        self.quantities = (*PARTICLE_STATE, *own)
        for quantity in self.quantities:
            setattr(self, quantity.name, _field(quantity.shape, room))
        self.shapes = {quantity.name: quantity.shape for quantity in self.quantities}
        # The columns of each quantity, the first and that behind the last, where all stand side by side.
        ends = itertools.accumulate(map(math.prod, self.shapes.values()), initial=0)
        self.places = dict(zip(self.shapes, itertools.pairwise(ends), strict=True))
        self.columns = tuple(Columns(getattr(self, q.name), q.shape, *self.places[q.name]) for q in self.quantities)
        self.history = tuple(getattr(self, name) for name in ("J_P", *(quantity.name for quantity in own)))
        self.books = _books(self, PARTICLE)
        self.gathered = ti.Matrix.field(5, 2, float, shape=self.slots)  # see grid_to_particle

    def read(self, name: str) -> np.ndarray:
        """A copy of one quantity as f64, shape (count, *shape)."""
        first, last = self.places[name]
        values = np.empty((self.count, last - first))
        copy_out(self, values, first, last)
        return values.reshape(self.count, *self.shapes[name])

    def write(self, name: str, values: np.ndarray) -> None:
        """Set one quantity for all particles; the padding repeats the last one."""
        flat = np.ascontiguousarray(np.asarray(values, dtype=float).reshape(self.count, -1))
        copy_in(self, flat, *self.places[name])

    def write_all(self, values: Mapping[str, np.ndarray]) -> None:
        """Set every quantity, as ``write`` does."""
        flat = [np.asarray(values[name], dtype=float).reshape(self.count, -1) for name in self.places]
        table = np.ascontiguousarray(np.concatenate(flat, axis=1))
        copy_in(self, table, 0, table.shape[1])

    def start(self, scene: Scene, material: Material) -> None:
        """Give each quantity its first value: undeformed and at rest."""
        self.write_all(make_first_values(self.quantities, scene, material))


@ti.data_oriented
class Nodes:
    """Grid nodes: what particles bring them, their velocity, and the floor's signed distance and normal at each.

    ``mass``; ``sums``: momentum x and y before forces act, impulse x and y of the forces of the substep;
    ``old_velocity`` is that before forces act; ``push`` what the floor gives by springs.
    ``fixed_...`` are the sums in fixed point, where they are taken so.
    ``books``: of what each cause gave in the frame; their
    fields are attributes by the accounts' names.  ``indenter`` is there in runs that have one.
    """

    indenter: Indenter | None = None

    def __init__(self, distance: np.ndarray, normal: np.ndarray, fixed_point: bool = False) -> None:
        self.size = distance.shape
        self.mass = _field((), self.size)
        # Side by side, so that one vector instruction takes all of a node.
        self.sums = ti.Vector.field(4, float, shape=self.size)
        self.velocity = ti.Vector.field(2, float, shape=self.size)
        self.old_velocity = ti.Vector.field(2, float, shape=self.size)
        self.distance = _field((), self.size)
        self.normal = _field((2,), self.size)
        self.push = ti.Vector.field(2, float, shape=self.size)
        fixed_size = self.size if fixed_point else (1, 1)
        self.fixed_mass = _field((), fixed_size, ti.i64)
        self.fixed_sums = _field((4,), fixed_size, ti.i64)
        self.fixed_push = _field((2,), fixed_size, ti.i64)
        for account in accounts_of(NODE):
            setattr(self, account.name, _field(account.shape, self.size))
        self.books = _books(self, NODE)
        _fill(self.distance, distance)
        _fill(self.normal, normal)


# Why a frame ended; RUNNING means that it did not fail.
RUNNING, UNSOUND_PARTICLE, TOO_MANY_SUBSTEPS = range(3)


@ti.data_oriented
class Ledger:
    """What a frame of each of the ``cases`` reports back, and what its substeps hand on.

    The outcome (``status``, ``particle`` at fault), whether substeps are to come (``under_way``), ``elapsed``
    time, number and smallest of the substeps, how many particles ended inside the floor; of the substep under
    way whether there is one (``active``), the fastest wave and particle, the nodes in use from ``low`` to ``high``, and
    its length ``dt``; and the frame's TOTALS.  What acts in the frame: ``gravity``, ``damping``, ``sinters``.
    ``fastest_...``: where threads find the largest of a square of speeds, see ``parallel.as_integer``; ``chunk_totals``
    and ``column_totals``: of each chunk of particles and column of nodes.
    """

    def __init__(self, cases: Cases, by_threads: bool = False) -> None:
        self.cases = cases
        number = cases.number
        self.status, self.particle, self.substeps, self.ended_inside, self.under_way, self.active, self.sinters = (
            ti.field(ti.i32, shape=number) for _ in range(7)
        )
        self.elapsed, self.smallest_step, self.dt, self.top_speed2, self.wave_speed2, self.gravity, self.damping = (
            ti.field(float, shape=number) for _ in range(7)
        )
        self.low, self.high = (ti.Vector.field(2, ti.i32, shape=number) for _ in range(2))
        self.totals = ti.Vector.field(len(TOTALS), ti.f64, shape=number)
        self.fastest_wave, self.fastest_particle = (ti.field(ti.i64, shape=number) for _ in range(2))
        chunks, columns = (cases.chunks, cases.grid[0]) if by_threads else (1, 1)
        self.chunk_totals, self.column_totals = (
            ti.Vector.field(len(TOTALS), ti.f64, shape=n) for n in (chunks, columns)
        )
