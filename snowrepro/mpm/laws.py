"""The constants and switches that the kernels are compiled for."""

from dataclasses import dataclass

from ..config import Config
from ..physics.sintering import maximum_moduli
from .splines import APIC_INERTIA, NODES


@dataclass(frozen=True)
class Laws:
    """Numbers of Table 1 and switches of the reading; hashable, so that a kernel can be compiled for it.

    Stresses are in the unit of E, lengths in the reading's unit, times in seconds.
    """

    spline: str
    nodes: int  # of the spline's support, per axis
    apic_inertia: float  # D / dx^2
    dx: float
    cfl: float
    max_substeps: int
    frame_time: float

    lowest_stretch: float  # 1 - theta_c
    highest_stretch: float  # 1 + theta_s
    hardening_exponent: tuple[float, float]
    plastic_volume: tuple[float, float]

    rho: float  # initial density
    rho_max: float
    E_max: float
    nu_max: float
    poisson_cap: float
    C1: float
    C2: float
    C3: float
    C4: float
    C5: float
    force_weight: float  # turns an acceleration into the |b| of Eqs. 2 and 9
    every_substep: bool
    hardening_per_time: bool
    volume_follows_density: bool
    plane_strain: bool

    stick_inside: bool
    moves_out: bool
    friction: float


def laws_of(config: Config) -> Laws:
    """The constants of one run."""
    material, sintering, reading, solver = config.material, config.sintering, config.reading, config.solver
    E_max, nu_max = maximum_moduli(
        material.E,
        material.nu,
        material.rho / sintering.rho_max,
        sintering.C3,
        as_printed=reading.poisson_denominator == "as_printed",
    )
    return Laws(
        spline=solver.spline,
        nodes=NODES[solver.spline],
        apic_inertia=APIC_INERTIA[solver.spline],
        dx=config.dx,
        cfl=solver.cfl,
        max_substeps=solver.max_substeps,
        frame_time=config.loading.frame_time,
        lowest_stretch=1.0 - material.theta_c,
        highest_stretch=1.0 + material.theta_s,
        hardening_exponent=reading.hardening_exponent,
        plastic_volume=reading.plastic_volume,
        rho=material.rho,
        rho_max=sintering.rho_max,
        E_max=E_max,
        nu_max=nu_max,
        poisson_cap=reading.poisson_cap,
        C1=sintering.C1,
        C2=sintering.C2,
        C3=sintering.C3,
        C4=sintering.C4,
        C5=sintering.C5,
        force_weight=material.mass if reading.external_force == "per_particle" else 1.0,
        every_substep=reading.cadence == "substep",
        hardening_per_time=reading.hardening_growth == "per_time",
        volume_follows_density=reading.density_changes == "moduli_and_volume",
        plane_strain=reading.plane == "strain",
        stick_inside=reading.contact == "legacy",
        moves_out=reading.inside_floor == "moved_out",
        friction=reading.friction,
    )
