"""Pressure sintering of ice grains, mechanism by mechanism, after Maeno and Ebinuma's list.

Each function gives the rate of densification (1/rho) d rho/dt [1/s] of snow of relative density D = rho / rho_ice under
a compressive stress sigma [Pa].  What depends on temperature alone is worked out before, in plain Python: a
mechanism's ``..._constant``.  Temperatures are in kelvin, grain sizes in metres, densities in kg/m^3.
"""

import math

from ..compiler import ti
from .elasticity import bounded_exp, clamp
from .hencky import LOG_RANGE, bounded_power

RHO_ICE = 917.0
GAS = 8.314  # J/(mol K), as in the public firn codes
BOLTZMANN = 1.380649e-23  # J/K
AVOGADRO = 6.02214076e23
MOLECULE = 1.97e-5 / AVOGADRO  # m^3, of a water molecule in ice (PISM)
MELTING = 273.15
SURFACE_ENERGY = 0.065  # J/m^2, of ice
BOUNDARY_WIDTH = 9.04e-10  # m (PISM)
MEGA = 1e6  # Pa in a MPa, in which the constants of creep are given


def arrhenius(energy: float, temperature: float) -> float:
    """exp(-Q / R T) of an activation energy [J/mol]."""
    return math.exp(-energy / (GAS * temperature))


def lattice_constant(temperature: float, grain: float) -> float:
    """Coble's (40/3) D_l Omega / (k T G^2) [1/(Pa s)], with PISM's D_l = 9.10e-4 exp(-59.4 kJ/mol / R T) m^2/s."""
    diffusion = 9.10e-4 * arrhenius(59.4e3, temperature)
    return 40.0 / 3.0 * diffusion * MOLECULE / (BOLTZMANN * temperature * grain**2)


def boundary_constant(temperature: float, grain: float) -> float:
    """Coble's 47.5 D_b delta Omega / (k T G^3) [1/(Pa s)], with PISM's D_b = 5.8e-4 exp(-49 kJ/mol / R T) m^2/s."""
    diffusion = 5.8e-4 * arrhenius(49e3, temperature)
    return 47.5 * diffusion * BOUNDARY_WIDTH * MOLECULE / (BOLTZMANN * temperature * grain**3)


DISLOCATION_POWER = 3.74
SLIDING_POWER = 1.625


def dislocation_constant(temperature: float) -> float:
    """Furman and Goldsby's A = 1.48e5 exp(-60 kJ/mol / R T) [MPa^-3.74/s], of dislocation creep."""
    return 1.48e5 * arrhenius(60e3, temperature)


def sliding_constant(temperature: float, grain: float) -> float:
    """Furman and Goldsby's 0.4431 exp(-49 kJ/mol / R T) / G^0.8966 [MPa^-1.625/s], of grain boundary sliding."""
    return 0.4431 * arrhenius(49e3, temperature) / grain**0.8966


@ti.func
def diffusion_rate(sigma, D, grain, constant):
    """Diffusion through the lattice or along boundaries: pressure sigma / D and the pores' own, 2 gamma / r_p.

    r_p = r (1 - D)^(1/3), as in the paper's unnumbered equation for the relative density, with r half the grain size.
    """
    pore = 0.5 * grain * bounded_power(1.0 - D, 1.0 / 3.0)
    return constant * (sigma / D + 2.0 * SURFACE_ENERGY / pore)


@ti.func
def creep_rate(sigma, D, constant, n):
    """Wilkinson and Ashby's creep around pores: 2 A (1-D) / (1 - (1-D)^(1/n))^n (2 sigma / n)^n, sigma in MPa there."""
    shell = 1.0 - bounded_power(1.0 - D, 1.0 / n)
    load = clamp(2.0 * sigma / (n * MEGA), LOG_RANGE[0], LOG_RANGE[1])
    return 2.0 * constant * (1.0 - D) * bounded_power(load / shell, n)


@ti.func
def settling_rate(sigma, rho, below_melting, fineness, c):
    """Crocus (Vionnet et al. 2012, Eq. 7): sigma over the viscosity of seasonal snow.

    ``fineness``: f_1 f_2 there, 1 for fine grains without water; ``c``: 250 kg/m^3 there, 358 in later versions.
    """
    viscosity = fineness * 7.62237e6 * (rho / c) * bounded_exp(0.1 * below_melting) * bounded_power_of_e(0.023 * rho)
    return sigma / viscosity


@ti.func
def bounded_power_of_e(x):
    """exp(x) for 0 <= x < 2 EXP_RANGE."""
    root = bounded_exp(0.5 * x)
    return root * root
