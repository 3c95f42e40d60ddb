"""Sand: snow as grains, held together by friction and by a cohesion that flow breaks for good."""

import math
from dataclasses import dataclass
from typing import ClassVar

from ..compiler import ti
from ..physics import elasticity, hencky, sand
from ..settings.case import Case
from ..settings.laws import Sand
from .hencky import HenckyMaterial
from .quantity import Quantity


@ti.data_oriented
@dataclass(frozen=True)
class SandMaterial(HenckyMaterial):
    """Sand; see ``physics.sand``.  Sintering makes c into c xi / xi_0: Eq. 9's growth on the cohesion."""

    sine: float  # of the angle of internal friction
    cohesion: float  # c, unbroken [unit of E]
    softening: float
    first_xi: float  # 0: the cohesion does not sinter
    plastic_volume: tuple[float, float]

    STATE: ClassVar[tuple[Quantity, ...]] = (
        Quantity("gap", (), "logarithm of the volume gained by coming apart", "1", stored=True),
        Quantity("broken", (), "plastic strain that broke cohesion", "1", stored=True),
    )

    @ti.func
    def relax(self, F, R, state, mu, lam, xi):
        """Return (F_E, state) in the cone of the cohesion before the step; a point inside keeps its bits."""
        K = lam + mu
        e, half, along, across = hencky.strain(F, R)
        c = sand.cohesion(self.cohesion, self.softening, state[2])
        if ti.static(self.first_xi > 0):
            c *= xi / self.first_xi
        new_e, new_half, gap = sand.return_to_cone(e, half, state[1], mu, K, self.sine, c)
        returned = hencky.deformation(new_e, new_half, along, across, R)
        yields = (new_e != e) | (new_half != half)
        F_E = F
        for i, j in ti.static(ti.ndrange(2, 2)):
            F_E[i, j] = ti.select(yields, returned[i, j], F[i, j])
        gained = elasticity.clamp(e - new_e, -elasticity.EXP_RANGE, elasticity.EXP_RANGE)
        J_P = state[0] * elasticity.bounded_exp(gained)
        state[0] = ti.select(yields, elasticity.clamp(J_P, self.plastic_volume[0], self.plastic_volume[1]), state[0])
        state[1] = gap
        state[2] += sand.ROOT_2 * (half - new_half) + ti.max(e - new_e, 0.0)
        return F_E, state


def make_sand(case: Case, law: Sand) -> SandMaterial:
    """The sand of a case."""
    return SandMaterial(
        sine=math.sin(math.radians(law.friction_angle)),
        cohesion=law.cohesion,
        softening=law.softening,
        first_xi=case.material.xi if law.sintered == "cohesion" else 0.0,
        plastic_volume=case.reading.plastic_volume,
    )
