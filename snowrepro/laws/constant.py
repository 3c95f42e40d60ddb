"""Sintering at constant rates: what is left of sintering if neither stress nor force decides how fast it goes."""

from dataclasses import dataclass

from ..compiler import ti
from ..physics import sintering
from ..settings.case import Case
from ..settings.laws import ConstantRates
from .paper import PaperSintering, make_paper_sintering


@ti.data_oriented
@dataclass(frozen=True)
class ConstantSintering:
    """Constant rates of density and xi; moduli by Eq. 7, from ``paper``."""

    paper: PaperSintering
    rate: float  # of density over density [1/s]
    hardening_rate: float  # of xi [1/s]

    @ti.func
    def advance(self, rho, xi, sigma_m, b_norm, time_step, weight):
        """Return (rho, E, nu, xi) after one update."""
        E, nu = self.paper.moduli(sintering.relative_density(rho, self.paper.rho_max))
        new_rho = sintering.density_at_rate(rho, self.rate, time_step)
        return ti.min(new_rho, self.paper.rho_max), E, nu, xi + self.hardening_rate * time_step


def make_constant_sintering(case: Case, law: ConstantRates) -> ConstantSintering:
    """The constant sintering of a case."""
    return ConstantSintering(make_paper_sintering(case), law.rate, law.hardening_rate)
