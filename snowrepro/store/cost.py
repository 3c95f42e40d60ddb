"""What the time of a run depends on."""

import functools
from dataclasses import dataclass

from ..scene.outline import area
from ..settings.case import Case, Outline


@dataclass(frozen=True)
class Kind:
    """Runs of one kind take the same time.  ``work``: of a frame, particles per grid spacing; substeps shorten so."""

    shape: str
    floor: str
    sintered: bool
    pressure: float
    fidelity: str
    solver: str
    indented: bool
    frames: int
    work: float


def kind_of(case: Case) -> Kind:
    """The kind of a run."""
    fidelity, solver = case.fidelity, case.solver
    particles = count_particles(case)
    return Kind(
        shape=case.shape.name,
        floor=case.floor.name,
        sintered=case.sintering.enabled,
        pressure=case.pressure,
        fidelity=fidelity.name,
        solver=f"{solver.transfer} {solver.spline} {solver.precision} {solver.device}",
        indented=case.indenter is not None,
        frames=case.frames,
        work=particles / fidelity.dx,
    )


def count_particles(case: Case) -> float:
    """How many particles the area of the snow has room for."""
    return _area(case.shape.outline) * case.fidelity.particles_per_cell / case.fidelity.dx**2


@functools.lru_cache(maxsize=256)
def _area(outline: Outline) -> float:
    return area(outline)
