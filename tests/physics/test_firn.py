"""Mechanisms of pressure sintering: public firn models, a published fit, measured rates, and what must rise."""

from pathlib import Path

import numpy as np
import pytest

from snowrepro.compiler import ti
from snowrepro.physics import firn
from snowrepro.reference.firn import barnola
from snowrepro.reference.snow import crocus

pytestmark = pytest.mark.usefixtures("taichi")
VALUES = ti.types.ndarray(dtype=ti.f64, ndim=1)
MEASURED = np.loadtxt(Path(__file__).parent / "compaction_furman_goldsby.csv", delimiter=",", skiprows=2)


@ti.kernel
def fill_rates(
    sigma: VALUES, rho: VALUES, grain: ti.f64, diffusion: ti.f64, creep: ti.f64, n: ti.template(), rates: VALUES,
    others: VALUES,
):  # fmt: skip
    for i in range(sigma.shape[0]):
        rates[i] = firn.creep_rate(sigma[i], rho[i] / firn.RHO_ICE, creep, n)
        others[i] = firn.diffusion_rate(sigma[i], rho[i] / firn.RHO_ICE, grain, diffusion)


@ti.kernel
def fill_settling(sigma: VALUES, rho: VALUES, below_melting: ti.f64, fineness: ti.f64, c: ti.f64, rates: VALUES):
    for i in range(sigma.shape[0]):
        rates[i] = firn.settling_rate(sigma[i], rho[i], below_melting, fineness, c)


def rates_of(sigma, rho, creep, n, grain=1e-3, diffusion=0.0) -> tuple[np.ndarray, np.ndarray]:
    """Rates of creep and of diffusion."""
    sigma, rho = (np.array(each, dtype=float) for each in np.broadcast_arrays(np.atleast_1d(sigma), rho))
    rates, others = np.zeros_like(rho), np.zeros_like(rho)
    fill_rates(sigma, rho, grain, diffusion, creep, n, rates, others)
    return rates, others


def settle(sigma, rho, below_melting, fineness=1.0, c=250.0) -> np.ndarray:
    sigma, rho = (np.array(each, dtype=float) for each in np.broadcast_arrays(np.atleast_1d(sigma), rho))
    rates = np.zeros_like(rho)
    fill_settling(sigma, rho, below_melting, fineness, c, rates)
    return rates


def test_creep_with_the_power_of_three_is_barnolas():
    """Above 800 kg/m^3 Barnola et al. have Wilkinson and Ashby's formula, with (3/16)(27/16) A_0 for A."""
    rho = np.array([830.0, 860.0, 900.0])
    constant = 3 / 16 * 27 / 16 * 2.54e4 * firn.arrhenius(60e3, 263.15)
    rates, _ = rates_of(2e5, rho, constant, 3.0)
    np.testing.assert_allclose(rho * rates, barnola(rho, 263.15, 2e5), rtol=1e-11)


def test_settling_is_that_of_crocus():
    """The Community Firn Model's number (c 358, f_2 4), and Vionnet et al.'s viscosity."""
    assert 300 * settle(1e4, 300, 10, 4.0, 358.0).item() == pytest.approx(4.353179768e-05, rel=1e-8, abs=0)
    rho = np.linspace(50, 550, 11)
    np.testing.assert_allclose(settle(1e4, rho, 10), 1e4 / crocus(rho, 10), rtol=1e-12)


def test_diffusion_by_hand():
    """At 263.15 K, 1 mm and D = 0.6: lattice 40/3 * 1.4718e-15 * 3.2712e-29 / (3.6332e-21 * 1e-6) 1/(Pa s)."""
    constant = firn.lattice_constant(263.15, 1e-3)
    assert constant == pytest.approx(40 / 3 * 1.4718e-15 * 3.2712e-29 / (3.6332e-21 * 1e-6), rel=1e-3, abs=0)
    pore = 5e-4 * 0.4 ** (1 / 3)
    _, rate = rates_of(1e5, 0.6 * 917, 0.0, 3.0, diffusion=constant)
    assert rate.item() == pytest.approx(constant * (1e5 / 0.6 + 0.13 / pore), rel=1e-11, abs=0)


def test_furman_and_goldsbys_fit_gives_their_measured_rates():
    """Sixteen rates at 233 K: the faster of dislocation creep and sliding, on average within a factor of two."""
    _, radius, D, stress, measured = MEASURED.T
    modelled = np.zeros(len(D))
    for i, grain in enumerate(2e-6 * radius):
        for constant, n in (
            (firn.dislocation_constant(233.0), firn.DISLOCATION_POWER),
            (firn.sliding_constant(233.0, grain), firn.SLIDING_POWER),
        ):
            modelled[i] = max(modelled[i], rates_of(1e6 * stress[i : i + 1], 917 * D[i : i + 1], constant, n)[0][0])
    error = np.log(modelled / measured)
    assert abs(error.mean()) < np.log(2)
    assert np.corrcoef(np.log(modelled), np.log(measured))[0, 1] > 0.9


def test_creep_by_hand():
    """D = 0.85 at 233 K and 1 MPa: 2 A 0.15 / (1 - 0.15^(1/n))^n (2/n)^n with n = 3.74."""
    A, n = firn.dislocation_constant(233.0), 3.74
    expected = 2 * A * 0.15 / (1 - 0.15 ** (1 / n)) ** n * (2 / n) ** n
    assert rates_of(1e6, 0.85 * 917, A, n)[0].item() == pytest.approx(expected, rel=1e-11, abs=0)


@pytest.mark.parametrize(
    "constant",
    [
        firn.dislocation_constant,
        lambda T: firn.sliding_constant(T, 1e-3),
        lambda T: firn.lattice_constant(T, 1e-3),
        lambda T: firn.boundary_constant(T, 1e-3),
    ],
)
def test_every_mechanism_is_faster_where_it_is_warmer(constant):
    rates = [constant(T) for T in np.linspace(220, 273.15, 20)]
    assert (np.diff(rates) > 0).all()
    assert settle(1e4, 300, 2) > settle(1e4, 300, 25)


def test_ten_degrees_by_hand():
    """60 kJ/mol: 1.67 times as fast at -5 as at -10 C."""
    assert firn.dislocation_constant(268.15) / firn.dislocation_constant(263.15) == pytest.approx(1.667, abs=2e-3)
