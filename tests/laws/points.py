"""Points of the snow of a configuration, and the strength of Cam clay."""

import numpy as np

from snowrepro.compiler import ti
from snowrepro.composition.compose import compose
from snowrepro.mpm import point


@ti.kernel
def fill_caps(particles: ti.template(), constants: ti.template(), caps: ti.types.ndarray(dtype=ti.f64, ndim=1)):
    for p in range(particles.count):
        K = particles.lam[p] + particles.mu[p]
        caps[p] = constants.material.cap(particles.J_P[p], K, particles.hardening[p])


class Points(point.Points):
    """``count`` points of the snow of these overrides."""

    def __init__(self, count: int, *overrides: str):
        case = compose(list(overrides)).case
        super().__init__(case, count)
        self.bulk = case.material.lam + case.material.mu

    def cap(self) -> float:
        """p_c of the first point."""
        caps = np.zeros(self.particles.count)
        fill_caps(self.particles, self.constants, caps)
        return caps[0]
