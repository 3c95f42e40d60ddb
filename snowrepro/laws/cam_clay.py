"""Cohesive Cam clay: porous snow whose cap hardens as pores close, and as it sinters."""

from dataclasses import dataclass
from typing import ClassVar

from ..compiler import ti
from ..physics import cam_clay, elasticity, hencky
from ..settings.case import Case
from ..settings.laws import CamClay
from .hencky import HenckyMaterial
from .quantity import Quantity


@ti.data_oriented
@dataclass(frozen=True)
class CamClayMaterial(HenckyMaterial):
    """Cam clay; see ``physics.cam_clay``.  Sintering makes p_0 into p_0 xi / xi_0: Eq. 9's growth on the cap."""

    slope: float
    cohesion: float
    strength: float  # p_0 [unit of E]
    hardening: float
    grows_by_sinh: bool
    first_xi: float  # 0: the cap does not sinter
    plastic_volume: tuple[float, float]

    STATE: ClassVar[tuple[Quantity, ...]] = ()

    @ti.func
    def cap(self, J_P, K, xi):
        """p_c, the isotropic compressive strength [unit of E]."""
        p_0 = self.strength
        if ti.static(self.first_xi > 0):
            p_0 *= xi / self.first_xi
        p_c = cam_clay.cap_by_exp(p_0, self.hardening, J_P)
        if ti.static(self.grows_by_sinh):
            p_c = cam_clay.cap_by_sinh(p_0, K, self.hardening, J_P)
        return p_c

    @ti.func
    def relax(self, F, R, state, mu, lam, xi):
        """Return (F_E, state) on the ellipse of the plastic volume before the step; a point inside keeps its bits."""
        K = lam + mu
        e, half, along, across = hencky.strain(F, R)
        p, q = -K * e, 2.0 * mu * half
        new_p, new_q = cam_clay.return_to_ellipse(p, q, self.cap(state[0], K, xi), mu, K, self.slope, self.cohesion)
        new_e = -new_p / K
        returned = hencky.deformation(new_e, new_q / (2.0 * mu), along, across, R)
        yields = (new_p != p) | (new_q != q)
        F_E = F
        for i, j in ti.static(ti.ndrange(2, 2)):
            F_E[i, j] = ti.select(yields, returned[i, j], F[i, j])
        grown = state[0] * elasticity.bounded_exp(
            elasticity.clamp(e - new_e, -elasticity.EXP_RANGE, elasticity.EXP_RANGE)
        )
        state[0] = ti.select(yields, elasticity.clamp(grown, self.plastic_volume[0], self.plastic_volume[1]), state[0])
        return F_E, state


def make_cam_clay(case: Case, law: CamClay) -> CamClayMaterial:
    """The Cam clay of a case."""
    return CamClayMaterial(
        slope=law.slope,
        cohesion=law.cohesion,
        strength=law.strength,
        hardening=law.hardening,
        grows_by_sinh=law.cap == "sinh",
        first_xi=case.material.xi if law.sintered == "cap" else 0.0,
        plastic_volume=case.reading.plastic_volume,
    )
