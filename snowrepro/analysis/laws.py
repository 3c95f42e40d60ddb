"""The paper's laws as curves over density, and how they stand to measured ones."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy.integrate import cumulative_trapezoid

from ..config import Config
from ..physics.sintering import maximum_moduli
from ..reference.snow import MODULI, Law

LEAST = 2  # measured laws, below which there is no range to lie in
STEPS = 400  # of density, over which time is summed


def youngs_modulus(rho: np.ndarray, config: Config) -> np.ndarray:
    """Eqs. 7 and 8: Young's modulus before hardening [unit of E] at densities ``rho`` (n,)."""
    E_max, _ = _maxima(config, as_printed=False)
    return E_max * np.exp(config.sintering.C3 * (1.0 - rho / config.sintering.rho_max))


def poissons_ratio(rho: np.ndarray, config: Config, as_printed: bool) -> np.ndarray:
    """Eqs. 7 and 8: Poisson's ratio [1] at densities ``rho`` (n,), without the reading's cap."""
    rho_r = rho / config.sintering.rho_max
    return _maxima(config, as_printed)[1] * np.sqrt(rho_r / (3.0 - 2.0 * rho_r))


def density_of_ratio(nu: float, config: Config, as_printed: bool) -> float:
    """The density at which Eqs. 7 and 8 reach a Poisson's ratio; infinite if none up to rho_max does."""
    nu_max = _maxima(config, as_printed)[1]
    rho_r = 3.0 * nu**2 / (nu_max**2 + 2.0 * nu**2)
    return rho_r * config.sintering.rho_max if rho_r <= 1.0 else float("inf")


def _maxima(config: Config, as_printed: bool) -> tuple[float, float]:
    material, sintering = config.material, config.sintering
    return maximum_moduli(material.E, material.nu, material.rho / sintering.rho_max, sintering.C3, as_printed)


def viscosity(rho: np.ndarray, config: Config) -> np.ndarray:
    """Eq. 2's first term as a viscosity [unit of E times s]: d rho/dt / rho = sigma_m / viscosity."""
    rho_r, C1 = np.asarray(rho) / config.sintering.rho_max, config.sintering.C1
    return rho_r / C1 if C1 else np.full_like(rho_r, np.inf)


def hardening_factor(xi: np.ndarray, J_P: np.ndarray, config: Config) -> np.ndarray:
    """Eq. 1: the factor on the moduli, its exponent bounded as in the run."""
    return np.exp(np.clip(xi * (1.0 - J_P), *config.reading.hardening_exponent))


def tabulated(laws: Sequence[Law]) -> pd.DataFrame:
    """Measured laws: a row a density [kg/m^3], a column a law, NaN outside its range."""
    rho = np.arange(min(law.low for law in laws), max(law.high for law in laws) + 1.0)
    return pd.DataFrame({law.name: law.at(rho) for law in laws}, index=pd.Index(rho, name="density"))


def slopes(table: pd.DataFrame) -> pd.DataFrame:
    """d ln(law) / d rho [m^3/kg] of tabulated laws, in the same shape."""

    def of_one(column: pd.Series) -> pd.Series:
        known = column.dropna()
        return pd.Series(np.gradient(np.log(known), known.index), known.index)

    return table.apply(of_one).reindex(table.index)


def comparable(table: pd.DataFrame) -> pd.DataFrame:
    """The rows in which enough laws were measured for a range."""
    return table[table.notna().sum(axis=1) >= LEAST]


def spans(holds: pd.Series) -> list[tuple[float, float]]:
    """First and last density of each stretch of neighbouring rows that are true."""
    stretch = (holds != holds.shift()).cumsum()
    return [(rows.index[0], rows.index[-1]) for _, rows in holds.groupby(stretch) if rows.iloc[0]]


def settling(law: Law, stress: float, start: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] (n,) at which snow of a measured viscosity has densities (n,) from ``start`` to ``end`` [kg/m^3].

    d rho/dt = rho stress / viscosity under a constant ``stress`` [Pa], as Crocus has it; NaN outside the law's range.
    """
    rho = np.geomspace(start, end, STEPS)
    return cumulative_trapezoid(law.at(rho) / (stress * rho), rho, initial=0.0), rho


def slope(config: Config) -> float:
    """The paper's d ln E / d rho [m^3/kg], the same at every density."""
    return -config.sintering.C3 / config.sintering.rho_max


def slope_within(config: Config) -> list[tuple[float, float]]:
    """Stretches of density [kg/m^3] in which the paper's slope of ln E lies among the measured ones."""
    measured = comparable(slopes(tabulated(MODULI)))
    return spans((measured.min(axis=1) <= slope(config)) & (slope(config) <= measured.max(axis=1)))


def level(config: Config) -> pd.Series:
    """Measured over the paper's modulus, by density [kg/m^3] and law, where there are enough laws for a range."""
    measured = comparable(tabulated(MODULI))
    return measured.div(youngs_modulus(measured.index.to_numpy(), config), axis=0).stack().dropna()
