"""A sintering: density and xi as in the paper, and Young's modulus by a power of density in place of Eq. 7."""

from dataclasses import dataclass

from pydantic import Field

from snowrepro.compiler import ti
from snowrepro.laws.paper import PaperSintering, make_paper_sintering
from snowrepro.own_law import OwnLaw
from snowrepro.physics import hencky
from snowrepro.settings.base import Settings


class Parameters(Settings):
    """What ``sintering.law.parameters`` may set."""

    exponent: float = Field(2.94, ge=0, le=10, description="of density: Sigrist (2006), Eq. 4.8 [1]")


@ti.data_oriented
@dataclass(frozen=True)
class PowerLaw:
    """E grows from that of the unpressed snow."""

    paper: PaperSintering
    rho: float  # of unpressed snow
    E: float
    exponent: float

    @ti.func
    def advance(self, rho, xi, sigma_m, b_norm, time_step, weight):
        """Return (rho, E, nu, xi) after one update."""
        new_rho, _, nu, new_xi = self.paper.advance(rho, xi, sigma_m, b_norm, time_step, weight)
        return new_rho, self.E * hencky.bounded_power(rho / self.rho, self.exponent), nu, new_xi


def make_power_law(case, parameters):
    """The law of a case with its parameters."""
    return PowerLaw(make_paper_sintering(case), case.material.rho, case.material.E, parameters.exponent)


LAW = OwnLaw(make_power_law, Parameters)
