"""What the time of a run depends on."""

import functools
from dataclasses import dataclass

from ..config import Config, Outline
from ..scene.outline import area


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


def kind_of(config: Config) -> Kind:
    """The kind of a run."""
    fidelity, solver = config.fidelity, config.solver
    particles = _area(config.shape.outline) * fidelity.particles_per_cell / fidelity.dx**2
    return Kind(
        shape=config.shape.name,
        floor=config.floor.name,
        sintered=config.sintering.enabled,
        pressure=config.pressure,
        fidelity=fidelity.name,
        solver=f"{solver.transfer} {solver.spline} {solver.precision} {solver.device}",
        indented=config.indenter is not None,
        frames=config.frames,
        work=particles / fidelity.dx,
    )


@functools.lru_cache(maxsize=256)
def _area(outline: Outline) -> float:
    return area(outline)
