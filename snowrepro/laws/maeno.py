"""Sintering by mechanisms, with temperature and pores: what the paper left out of Maeno and Ebinuma's model.

At each point the fastest mechanism acts: diffusion through the lattice or along grain boundaries, dislocation creep, or
sliding of grain boundaries.  Light snow does none of these: it settles, by the law of Crocus.  Eqs. 7 and 9 are the
paper's.  The scalar stress is the paper's von Mises stress, whose numbers are taken as Pa, with lengths in cells too.
"""

from dataclasses import dataclass

from ..compiler import ti
from ..physics import firn, sintering
from ..settings.case import Case
from ..settings.laws import MaenoRates
from .paper import PaperSintering, make_paper_sintering

FINENESS, CROCUS_DENSITY = 1.0, 250.0  # of Vionnet et al. (2012)
MECHANISMS = (
    "diffusion through the lattice", "diffusion along grain boundaries", "dislocation creep",
    "sliding of grain boundaries", "settling",
)  # fmt: skip
VALUES, TABLE = ti.types.ndarray(dtype=ti.f64, ndim=1), ti.types.ndarray(dtype=ti.f64, ndim=2)


@ti.data_oriented
@dataclass(frozen=True)
class MaenoSintering:
    """Constants of the mechanisms at the temperature of the snow; see ``physics.firn``."""

    paper: PaperSintering
    grain: float  # m
    below_melting: float  # K
    settles_below: float  # kg/m^3
    time_lapse: float
    lattice: float
    boundary: float
    dislocation: float
    sliding: float

    @ti.func
    def rates(self, rho, sigma):
        """Rates of densification of real snow [1/s] by each of MECHANISMS, whichever acts."""
        D = rho / firn.RHO_ICE
        return ti.Vector(
            [
                firn.diffusion_rate(sigma, D, self.grain, self.lattice),
                firn.diffusion_rate(sigma, D, self.grain, self.boundary),
                firn.creep_rate(sigma, D, self.dislocation, firn.DISLOCATION_POWER),
                firn.creep_rate(sigma, D, self.sliding, firn.SLIDING_POWER),
                firn.settling_rate(sigma, rho, self.below_melting, FINENESS, CROCUS_DENSITY),
            ]
        )

    @ti.func
    def rate(self, rho, sigma):
        """Rate of densification of real snow [1/s], by the fastest mechanism."""
        rates = self.rates(rho, sigma)
        fastest = ti.max(rates[0], rates[1], rates[2], rates[3])
        return ti.select(rho < self.settles_below, rates[4], fastest)

    @ti.kernel
    def fill_rates(self, rho: VALUES, sigma: VALUES, rates: TABLE):
        """Fill ``rates`` (point, mechanism) of points of a density and a stress (point,)."""
        for i in range(rho.shape[0]):
            found = self.rates(rho[i], sigma[i])
            for m in ti.static(range(len(MECHANISMS))):
                rates[i, m] = found[m]

    @ti.func
    def advance(self, rho, xi, sigma_m, b_norm, time_step, weight):
        """Return (rho, E, nu, xi) after one update."""
        E, nu = self.paper.moduli(sintering.relative_density(rho, self.paper.rho_max))
        new_rho = sintering.density_at_rate(rho, self.time_lapse * self.rate(rho, sigma_m), time_step)
        return ti.min(new_rho, self.paper.rho_max), E, nu, self.paper.hardened(xi, sigma_m, b_norm, weight)


def make_maeno_sintering(case: Case, law: MaenoRates) -> MaenoSintering:
    """The mechanisms of a case, at its temperature."""
    return MaenoSintering(
        make_paper_sintering(case),
        grain=law.grain,
        below_melting=firn.MELTING - law.temperature,
        settles_below=law.settles_below,
        time_lapse=law.time_lapse,
        lattice=firn.lattice_constant(law.temperature, law.grain),
        boundary=firn.boundary_constant(law.temperature, law.grain),
        dislocation=firn.dislocation_constant(law.temperature),
        sliding=firn.sliding_constant(law.temperature, law.grain),
    )
