"""Rates at which firn becomes denser, as glaciology has them: to compare with, never simulated.

Each gives d rho / dt [kg/m^3/s] at density ``rho`` [kg/m^3], temperature ``T`` [K] and stress ``sigma`` [Pa].  Formulas
and constants are those of the public Community Firn Model (UWGlaciology, MIT licence), whose own functions gave the
numbers in the tests.
"""

import numpy as np

RHO_ICE, GAS = 917.0, 8.314


def arthern(rho: np.ndarray | float, T: float, sigma: float, grain_radius2: float) -> np.ndarray:
    """Arthern et al. (2010), transient: creep through the lattice, slower above 550 kg/m^3; ``grain_radius2`` [m^2]."""
    rho = np.asarray(rho, dtype=float)
    k = np.where(rho < 550.0, 9.2e-9, 3.7e-9)
    return k * (RHO_ICE - rho) * np.exp(-60e3 / (GAS * T)) * sigma / grain_radius2


def barnola(rho: np.ndarray | float, T: float, sigma: float) -> np.ndarray:
    """Barnola et al. (1991) above 550 kg/m^3: dislocation creep, fitted up to 800 and around pores above; else NaN."""
    rho = np.asarray(rho, dtype=float)
    x, D = rho / 1000.0, rho / RHO_ICE
    fitted = 10.0 ** (-37.455 * x**3 + 99.743 * x**2 - 95.027 * x + 30.673)
    pores = (3.0 / 16.0) * (1.0 - D) / (1.0 - (1.0 - D) ** (1.0 / 3.0)) ** 3
    rate = rho * 2.54e4 * np.exp(-60e3 / (GAS * T)) * np.where(rho <= 800.0, fitted, pores) * (sigma / 1e6) ** 3
    return np.where(rho >= 550.0, rate, np.nan)
