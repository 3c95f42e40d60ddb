"""The paper's sintering: Eqs. 2, 6, 7 and 9."""

from dataclasses import dataclass

from ..compiler import ti
from ..physics import sintering
from ..physics.maxima import maximum_moduli
from ..settings.case import Case


@ti.data_oriented
@dataclass(frozen=True)
class PaperSintering:
    """Numbers of Table 1 and Eq. 8; densities in kg/m^3, moduli in the unit of E."""

    rho_max: float
    E_max: float
    nu_max: float
    poisson_cap: float
    C1: float
    C2: float
    C3: float
    C4: float
    C5: float

    @ti.func
    def advance(self, rho, xi, sigma_m, b_norm, time_step, weight):
        """Return (rho, E, nu, xi) after one update; E and nu are of the density before it, as Eq. 7 is printed."""
        rho_r = sintering.relative_density(rho, self.rho_max)
        grown_rho = sintering.density(rho, sigma_m, rho_r, b_norm, time_step, self.C1, self.C2)
        new_rho = ti.min(grown_rho, self.rho_max)
        E, nu = self.moduli(rho_r)
        return new_rho, E, nu, self.hardened(xi, sigma_m, b_norm, weight)

    @ti.func
    def moduli(self, rho_r):
        """Eq. 7: (E, nu) of a relative density."""
        E = sintering.youngs_modulus(rho_r, self.E_max, self.C3)
        return E, ti.min(sintering.poissons_ratio(rho_r, self.nu_max), self.poisson_cap)

    @ti.func
    def hardened(self, xi, sigma_m, b_norm, weight):
        """Eq. 9: xi after one update."""
        return sintering.hardening_coefficient(xi, sigma_m, b_norm, weight, self.C4, self.C5)


def make_paper_sintering(case: Case) -> PaperSintering:
    """The paper's sintering of a case."""
    material, sinters, reading = case.material, case.sintering, case.reading
    E_max, nu_max = maximum_moduli(
        material.E,
        material.nu,
        material.rho / sinters.rho_max,
        sinters.C3,
        as_printed=reading.poisson_denominator == "as_printed",
    )
    return PaperSintering(
        rho_max=sinters.rho_max,
        E_max=E_max,
        nu_max=nu_max,
        poisson_cap=reading.poisson_cap,
        C1=sinters.C1,
        C2=sinters.C2,
        C3=sinters.C3,
        C4=sinters.C4,
        C5=sinters.C5,
    )
