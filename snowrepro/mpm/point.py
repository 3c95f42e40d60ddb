"""Points of a material that only see the strain that they are given: the solver's own stress update, without a grid."""

import numpy as np

from ..compiler import ti
from ..physics import elasticity
from ..settings.case import Case
from . import steps
from .constants import make_constants
from .state import Particles


@ti.kernel
def update(
    particles: ti.template(),
    constants: ti.template(),
    stresses: ti.types.ndarray(dtype=ti.types.matrix(2, 2, ti.f64), ndim=1),
    energies: ti.types.ndarray(dtype=ti.f64, ndim=1),
):
    """Return trial strains to the yield surface; fill the law's own stress, von Mises stress and elastic energy."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        for group in range(particles.lane_groups):
            steps.update_stress(group, particles, constants)
        for p in range(particles.count):
            particles.von_mises[p] = steps.von_mises(p, particles, constants)
            energies[p] = steps.elastic_energy(p, particles, constants)
            F_E, h = particles.F_E[p], particles.factor[p]
            R = elasticity.polar_rotation(F_E)
            stresses[p] = constants.material.stress(F_E, R, h * particles.mu[p], h * particles.lam[p])


VALUES = ti.types.ndarray(dtype=ti.f64, ndim=1)


@ti.kernel
def advance(
    constants: ti.template(), rho: VALUES, xi: VALUES, sigma: VALUES, b: VALUES, E: VALUES, nu: VALUES, dt: ti.f64
):
    """One update of the sintering law at points; rho and xi become those after it."""
    for p in range(rho.shape[0]):
        rho[p], E[p], nu[p], xi[p] = constants.sintering.advance(rho[p], xi[p], sigma[p], b[p], dt, 1.0)


def sinter_once(
    case: Case, rho: np.ndarray, sigma: np.ndarray, b: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return (rho, E, nu, xi) after one update of a frame's length, at points of unpressed xi; Taichi was started.

    ``rho``: density before; ``sigma``: von Mises stress; ``b``: external force; all (count,).
    """
    rho, sigma, b = (np.ascontiguousarray(each, dtype=float).copy() for each in (rho, sigma, b))
    E, nu, xi = np.zeros_like(rho), np.zeros_like(rho), np.full_like(rho, case.material.xi)
    advance(make_constants(case), rho, xi, sigma, b, E, nu, case.loading.frame_time)
    return rho, E, nu, xi


class Points:
    """``count`` points of unpressed snow of a case, each of one unit of volume; Taichi has been started.

    ``stresses`` (count, 2, 2): Kirchhoff stress, as the law gives it; ``energies`` (count,): elastic energy.
    """

    def __init__(self, case: Case, count: int) -> None:
        self.constants = make_constants(case)
        self.particles = Particles(count, self.constants.material.STATE)
        self.stresses, self.energies = np.zeros((count, 2, 2)), np.zeros(count)
        material = case.material
        values = {
            quantity.name: 0.0 if quantity.name == "position" else quantity.first(None, material)
            for quantity in self.particles.quantities
            if quantity.name not in ("mass", "volume")
        }
        values |= {"mass": material.rho, "volume": 1.0}
        shapes = self.particles.shapes
        self.particles.write_all({name: np.broadcast_to(values[name], (count, *shapes[name])) for name in shapes})

    def deform(self, increments: np.ndarray) -> None:
        """F_E becomes increment @ F_E, as in step 6, and the stress follows; (2, 2) for all points, or one each."""
        self.write("F_E", increments @ self.read("F_E"))
        update(self.particles, self.constants, self.stresses, self.energies)

    def save(self) -> dict[str, np.ndarray]:
        """A copy of all quantities, for ``load``."""
        return {name: self.read(name) for name in self.particles.shapes}

    def load(self, saved: dict[str, np.ndarray], turn: np.ndarray) -> None:
        """Put back what was saved, as an observer sees it who turned: F_E becomes ``turn`` @ F_E."""
        self.particles.write_all({**saved, "F_E": turn @ saved["F_E"]})

    def read(self, name: str) -> np.ndarray:
        """A copy of one quantity, shape (count, *shape)."""
        return self.particles.read(name)

    def write(self, name: str, values: np.ndarray) -> None:
        """Set one quantity of all points."""
        self.particles.write(name, values)
