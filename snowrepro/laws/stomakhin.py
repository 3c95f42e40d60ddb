"""The paper's material: fixed corotated elasticity, stretches that are clamped, moduli that harden (Eq. 1)."""

from dataclasses import dataclass
from typing import ClassVar

from ..compiler import ti
from ..physics import elasticity, plasticity
from ..settings.case import Case
from .quantity import Quantity


@ti.data_oriented
@dataclass(frozen=True)
class StomakhinMaterial:
    """Snow of Stomakhin et al. (2013); stretches and exponents have no unit."""

    lowest_stretch: float  # 1 - theta_c
    highest_stretch: float  # 1 + theta_s
    hardening_exponent: tuple[float, float]
    softening: float  # factor on xi where J_P > 1
    plastic_volume: tuple[float, float]

    STATE: ClassVar[tuple[Quantity, ...]] = ()

    @ti.func
    def relax(self, F, R, state, mu, lam, xi):
        """Return (F_E, state): F with its stretches clamped, and J_P with what the clamp took."""
        F_E, ratio = plasticity.clamp_stretches(F, R, self.lowest_stretch, self.highest_stretch)
        state[0] = elasticity.clamp(state[0] * ratio, self.plastic_volume[0], self.plastic_volume[1])
        return F_E, state

    @ti.func
    def factor(self, J_P, xi):
        """Eq. 1, with xi dx / length in place of xi where the point opens (J_P > 1) and a length is set.

        A crack is as wide as a few grid spacings, and over it stress falls as exp(-xi (J_P - 1)): opening it takes an
        energy in proportion to dx / xi (the crack band of Bazant and Oh 1983).  So scaled, it is the same on every
        grid.
        """
        coefficient = xi
        if ti.static(self.softening != 1.0):
            coefficient = ti.select(J_P > 1.0, self.softening * xi, xi)
        return elasticity.hardening_factor(coefficient, J_P, self.hardening_exponent[0], self.hardening_exponent[1])

    @ti.func
    def stress(self, F_E, R, mu, lam):
        """Kirchhoff stress."""
        return elasticity.kirchhoff_stress(F_E, R, mu, lam)

    @ti.func
    def stress_zz(self, F_E, mu, lam):
        """Kirchhoff stress out of the plane."""
        return elasticity.kirchhoff_stress_zz(F_E, lam)

    @ti.func
    def energy(self, F_E, R, mu, lam):
        """Elastic energy for each unit of volume at the start."""
        return elasticity.energy_density(F_E, R, mu, lam)

    @ti.func
    def flow_work(self, F_E, F, R, mu, lam):
        """Stress on the yield surface times the plastic strain."""
        return elasticity.work_of_strain(F_E, R, F - F_E, mu, lam)

    @ti.func
    def stiffness(self, F_E, tau, mu, lam):
        """P-wave modulus at rest, from which the stretches between the clamps hardly differ."""
        return lam + 2.0 * mu


def make_stomakhin(case: Case) -> StomakhinMaterial:
    """The paper's material of a case."""
    return StomakhinMaterial(
        lowest_stretch=1.0 - case.material.theta_c,
        highest_stretch=1.0 + case.material.theta_s,
        hardening_exponent=case.reading.hardening_exponent,
        softening=case.softening,
        plastic_volume=case.reading.plastic_volume,
    )
