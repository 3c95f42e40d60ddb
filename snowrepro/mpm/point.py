"""Points of a material that only see the strain that they are given: the solver's own stress update, without a grid."""

import numpy as np

from ..compiler import ti
from ..own_law import explain_errors
from ..physics import elasticity
from ..scene.build import Scene
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
            steps.update_stress(group, True, particles, constants)
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
    Raises ConfigError where a law that is somebody else's fails.
    """
    rho, sigma, b = (np.ascontiguousarray(each, dtype=float).copy() for each in (rho, sigma, b))
    E, nu, xi = np.zeros_like(rho), np.zeros_like(rho), np.full_like(rho, case.material.xi)
    constants = make_constants(case)
    with explain_errors("sintering", case.sintering.law, "fails"):
        advance(constants, rho, xi, sigma, b, E, nu, case.loading.frame_time)
    return rho, E, nu, xi


def _make_scene(count: int, rho: float) -> Scene:
    """A square of snow of so many particles, each of one unit of volume, without a floor."""
    side = np.ceil(np.sqrt(count))
    positions = np.stack(np.divmod(np.arange(count), side), axis=1) + 0.5
    depth = np.minimum(positions, side - positions).min(axis=1)
    distance, normal = np.ones((1, 1)), np.array([[[0.0, 1.0]]])
    return Scene(positions, depth, rho, 1.0, distance, normal, np.sqrt(count / np.pi))


class Points:
    """``count`` points of unpressed snow of a case, each of one unit of volume, side by side; Taichi has been started.

    ``stresses`` (count, 2, 2): Kirchhoff stress, as the law gives it; ``energies`` (count,): elastic energy.
    Raises ConfigError where a law that is somebody else's fails.
    """

    def __init__(self, case: Case, count: int) -> None:
        self.law = case.material.law
        self.constants = make_constants(case)
        self.particles = Particles(count, self.constants.material.STATE)
        self.stresses, self.energies = np.zeros((count, 2, 2)), np.zeros(count)
        with explain_errors("material", self.law, "has no first values"):
            self.particles.start(_make_scene(count, case.material.rho), case.material)

    def deform(self, increments: np.ndarray) -> None:
        """F_E becomes increment @ F_E, as in step 6, and the stress follows; (2, 2) for all points, or one each."""
        self.write("F_E", increments @ self.read("F_E"))
        with explain_errors("material", self.law, "fails"):
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
