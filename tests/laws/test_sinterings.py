"""Sintering at constant rates and by mechanisms, one update at a time."""

import functools

import numpy as np
import pytest

from snowrepro.compiler import ti
from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.laws.choose import make_sintering
from snowrepro.reference.snow import crocus

pytestmark = pytest.mark.usefixtures("taichi")
VALUES = ti.types.ndarray(dtype=ti.f64, ndim=1)
STRESSES = np.array([1e2, 1e3, 1e4, 1e5, 1e6])
DENSITIES = np.array([100.0, 300.0, 540.0, 560.0, 650.0, 700.0, 850.0])


@ti.kernel
def advance_once(
    law: ti.template(), rho: VALUES, xi: VALUES, sigma: VALUES, b: ti.f64, dt: ti.f64, E: VALUES, nu: VALUES
):
    for i in range(rho.shape[0]):
        rho[i], E[i], nu[i], xi[i] = law.advance(rho[i], xi[i], sigma[i], b, dt, 1.0)


@ti.kernel
def fill_rates(law: ti.template(), rho: VALUES, sigma: VALUES, rates: VALUES):
    for i in range(rho.shape[0]):
        rates[i] = law.rate(rho[i], sigma[i])


def advance(*overrides: str, rho=300.0, sigma=1e4, b=2.0, dt=0.02):
    """(rho, E, nu, xi) after one update from xi = 5."""
    law = make_sintering(compose(list(overrides)).case)
    values = [np.array([value]) for value in (rho, 5.0, sigma, 0.0, 0.0)]
    density, xi, stress, E, nu = values
    advance_once(law, density, xi, stress, b, dt, E, nu)
    return density[0], E[0], nu[0], xi[0]


@functools.cache
def rates_at(celsius: float) -> np.ndarray:
    """Rates of densification over DENSITIES and STRESSES."""
    law = make_sintering(compose(["sintering=maeno", f"sintering.law.temperature={celsius + 273.15}"]).case)
    rho, sigma = (each.ravel() for each in np.meshgrid(DENSITIES, STRESSES, indexing="ij"))
    rates = np.zeros_like(rho)
    fill_rates(law, rho, sigma, rates)
    return rates.reshape(len(DENSITIES), len(STRESSES))


def test_constant_rates_ask_for_neither_stress_nor_force():
    """rho (1 + rate dt), xi + hardening_rate dt, and Eq. 7's moduli of the density before."""
    overrides = ("sintering=constant", "sintering.law.rate=0.5", "sintering.law.hardening_rate=3")
    rho, E, nu, xi = advance(*overrides)
    assert (rho, xi) == pytest.approx((300 * 1.01, 5.06), rel=1e-14)
    assert advance(*overrides, sigma=1e6, b=50.0) == (rho, E, nu, xi)
    _, paper_E, paper_nu, _ = advance()
    assert (E, nu) == (paper_E, paper_nu)
    assert advance(*overrides, rho=699.0)[0] == 700.0


def test_mechanisms_change_density_and_nothing_else():
    """E, nu and xi are the paper's; the rate is multiplied by the time lapse."""
    _, *paper = advance()
    slow, *others = advance("sintering=maeno", "sintering.law.time_lapse=1")
    fast, *_ = advance("sintering=maeno", "sintering.law.time_lapse=1000")
    assert others == paper
    assert fast - 300 == pytest.approx(1000 * (slow - 300), rel=1e-4)
    assert slow - 300 == pytest.approx(0.02 * 300 * 1e4 / crocus(300.0, 10.0), rel=1e-4)


def test_warmer_snow_sinters_faster_everywhere():
    cold, cool, warm = (rates_at(celsius) for celsius in (-25, -10, -2))
    assert (cold > 0).all()
    assert (cool > cold).all() and (warm > cool).all()
    assert (np.diff(cool) >= 0).all()  # and faster under more stress


def test_rates_are_of_the_order_that_glaciology_has():
    """At -10 C: light snow within ten times the Community Firn Model's Crocus, firn from Barnola's to ten Artherns."""
    light, firn = rates_at(-10)[1, 2], rates_at(-10)[5, 3]  # 300 kg/m^3 at 1e4 Pa, 700 kg/m^3 at 1e5 Pa
    assert 0.1 < 300 * light / 4.353179768e-05 < 10
    assert 3.31704520e-08 < 700 * firn < 10 * 9.87133956e-07


def test_snow_in_the_oven_is_refused():
    with pytest.raises(ConfigError, match=r"sintering\.law\.temperature"):
        compose(["sintering=maeno", "sintering.law.temperature=280"])
