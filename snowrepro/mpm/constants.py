"""The constants and switches that the kernels are compiled for."""

import math
from dataclasses import dataclass

from ..compiler import as_template
from ..laws.choose import MaterialLaw, SinteringLaw, make_material, make_sintering
from ..settings.case import Case
from .splines import INERTIA, NODES

TOUCH = {"f64": 1e-9, "f32": 1e-4}  # grid spacings


@as_template
@dataclass(frozen=True)
class Constants:
    """Numbers, switches of the reading and the laws; hashable, so that a kernel can be compiled for it.

    Stresses are in the unit of E, lengths in the reading's unit, times in seconds.
    """

    transfer: str
    flip: float  # pic_flip: part of the velocity that particles keep in a step
    pic_rate: float  # 1/s, in place of flip; negative: not set
    spline: str
    nodes: int  # of the spline's support, per axis
    inertia: float  # D / dx^2
    summation: str
    mass_quantum: float  # of the sums in fixed point
    momentum_quantum: float
    dx: float
    cfl: float
    max_substeps: int
    frame_time: float

    material: MaterialLaw
    sintering: SinteringLaw
    force_weight: float  # turns an acceleration into the |b| of Eqs. 2 and 9
    every_substep: bool
    hardening_per_time: bool
    volume_follows_density: bool
    plane_strain: bool

    stick_inside: bool
    springs: bool  # whether contact is by springs on particles, and not on nodes
    reach: float  # of a particle's surface from its centre
    moves_out: bool
    friction: float
    indents: bool  # whether there are an indenter and its vice
    indenter_friction: float
    touch: float  # a particle this near touches: one that was moved to the surface is on it but for round-off


def make_constants(case: Case) -> Constants:
    """The constants of one run."""
    material, reading, solver = case.material, case.reading, case.solver
    # A particle faster than this needs more substeps than are allowed, which ends the run before a sum overflows.
    fastest = solver.cfl * case.dx * solver.max_substeps / case.loading.frame_time
    particle_mass = material.rho * case.dx**2 / case.fidelity.particles_per_cell
    return Constants(
        transfer=solver.transfer,
        flip=solver.flip,
        pic_rate=-1.0 if solver.pic_rate is None else solver.pic_rate,
        summation=solver.summation,
        mass_quantum=power_of_two(particle_mass * 2.0**-40),
        momentum_quantum=power_of_two(particle_mass * fastest * 2.0**-50),
        touch=TOUCH[solver.precision] * case.dx,
        spline=solver.spline,
        nodes=NODES[solver.spline],
        inertia=INERTIA[solver.spline],
        dx=case.dx,
        cfl=solver.cfl,
        max_substeps=solver.max_substeps,
        frame_time=case.loading.frame_time,
        material=make_material(case),
        sintering=make_sintering(case),
        force_weight=material.mass if reading.external_force == "per_particle" else 1.0,
        every_substep=reading.cadence == "substep",
        hardening_per_time=reading.hardening_growth == "per_time",
        volume_follows_density=reading.density_changes == "moduli_and_volume",
        plane_strain=reading.plane == "strain",
        stick_inside=reading.contact == "legacy",
        springs=reading.contact == "penalty",
        reach=0.5 * case.dx / case.fidelity.particles_per_cell**0.5,
        moves_out=reading.inside_floor == "moved_out" and reading.contact != "penalty",  # springs need the depth
        friction=reading.friction,
        indents=case.indenter is not None,
        indenter_friction=case.indenter.friction if case.indenter else 0.0,
    )


def power_of_two(value: float) -> float:
    """The largest power of two that is not above ``value``: dividing by it changes no digit."""
    return 2.0 ** math.floor(math.log2(value))
