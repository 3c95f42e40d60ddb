"""What all materials in Hencky strain have in common: stress, energy and stiffness, without hardening of the moduli."""

from ..compiler import ti
from ..physics import elasticity, hencky


@ti.data_oriented
class HenckyMaterial:
    """Base of a material law: elastic in the logarithm of the stretch, with the moduli that sintering gives."""

    @ti.func
    def factor(self, J_P, xi):
        """Return 1: plastic volume hardens strength here, not stiffness."""
        return 1.0

    @ti.func
    def stress(self, F_E, R, mu, lam):
        """Kirchhoff stress."""
        return hencky.kirchhoff_stress(F_E, R, mu, lam)

    @ti.func
    def stress_zz(self, F_E, mu, lam):
        """Kirchhoff stress out of the plane."""
        e, _, _, _ = hencky.strain(F_E, elasticity.polar_rotation(F_E))
        return lam * e

    @ti.func
    def energy(self, F_E, R, mu, lam):
        """Elastic energy for each unit of volume at the start."""
        return hencky.energy_density(F_E, R, mu, lam)

    @ti.func
    def flow_work(self, F_E, F, R, mu, lam):
        """Stress on the yield surface times the plastic strain."""
        return hencky.flow_work(F_E, F, R, mu, lam)

    @ti.func
    def stiffness(self, F_E, tau, mu, lam):
        """P-wave modulus of snow under stress."""
        return hencky.stiffness(tau, mu, lam)
