"""Pressure sintering: density (Eqs. 2 and 6), elasticity (Eq. 7; Eq. 8 in ``maxima``) and plasticity (Eq. 9)."""

from ..compiler import ti
from .elasticity import bounded_exp


@ti.func
def density(rho, sigma_m, rho_r, b_norm, time_step, C1, C2):
    """Eq. 2: density after one update of length ``time_step`` under stress sigma_m and force |b|."""
    return rho + time_step * rho * (C1 * (sigma_m / rho_r) + C2 * b_norm)


@ti.func
def density_at_rate(rho, rate, time_step):
    """Density after one update at a rate of densification (1/rho) d rho/dt [1/s]: a step of Eq. 2 with another rate."""
    return rho + time_step * rho * rate


@ti.func
def relative_density(rho, rho_max):
    """Eq. 6."""
    return rho / rho_max


@ti.func
def youngs_modulus(rho_r, E_max, C3):
    """Eq. 7, first part."""
    return E_max * bounded_exp(C3 * (1.0 - rho_r))


@ti.func
def poissons_ratio(rho_r, nu_max):
    """Eq. 7, second part."""
    return nu_max * ti.sqrt(rho_r / (3.0 - 2.0 * rho_r))


@ti.func
def hardening_coefficient(xi, sigma_m, b_norm, weight, C4, C5):
    """Eq. 9; ``weight`` is 1 as printed, or the part of a frame that the update stands for."""
    return xi + weight * (C4 * sigma_m + C5 * b_norm)
