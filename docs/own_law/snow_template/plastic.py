"""A material: elastic in Hencky strain, and plastic where the shear stress reaches a strength that nothing changes."""

from dataclasses import dataclass
from typing import ClassVar

from pydantic import Field

from snowrepro.compiler import ti
from snowrepro.laws.hencky import HenckyMaterial
from snowrepro.laws.quantity import Quantity
from snowrepro.own_law import OwnLaw
from snowrepro.physics import hencky
from snowrepro.settings.base import Settings


class Parameters(Settings):
    """What ``material.law.parameters`` may set."""

    strength: float = Field(500.0, gt=0, description="largest shear stress in the plane [unit of E]")


@ti.data_oriented
@dataclass(frozen=True)
class Plastic(HenckyMaterial):
    """Its stress, energy, work of flow and stiffness are those of every material in Hencky strain."""

    strength: float

    STATE: ClassVar = (Quantity("slipped", (), "plastic strain in shear", "1", stored=True),)

    @ti.func
    def relax(self, F, R, state, mu, lam, xi):
        """Return (F_E, state): the shear strain is cut where its stress passes the strength; volume is kept."""
        e, half, along, across = hencky.strain(F, R)
        largest = self.strength / (2.0 * mu)
        F_E = F
        if half > largest:
            F_E = hencky.deformation(e, largest, along, across, R)
            state[1] += half - largest
        return F_E, state


def make_plastic(case, parameters):
    """The law of a case with its parameters."""
    return Plastic(parameters.strength)


LAW = OwnLaw(make_plastic, Parameters)
