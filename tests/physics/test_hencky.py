"""Hencky elasticity: logarithm and power without the C library, stress as the slope of the energy, objectivity."""

import math

import numpy as np
import pytest
from scipy.linalg import logm

from snowrepro.compiler import ti
from snowrepro.physics import elasticity, hencky

MU, LAM = 3.0, 5.0
pytestmark = pytest.mark.usefixtures("taichi")
VALUES = ti.types.ndarray(dtype=ti.f64, ndim=1)
MATRICES = ti.types.ndarray(dtype=ti.types.matrix(2, 2, ti.f64), ndim=1)


@ti.kernel
def fill_logs(x: VALUES, logs: VALUES, powers: VALUES, exponent: ti.f64):
    for i in range(x.shape[0]):
        logs[i] = hencky.bounded_log(x[i])
        powers[i] = hencky.bounded_power(x[i], exponent)


@ti.kernel
def fill_stress(F: MATRICES, tau: MATRICES, again: MATRICES, energy: VALUES):
    for i in range(F.shape[0]):
        R = elasticity.polar_rotation(F[i])
        tau[i] = hencky.kirchhoff_stress(F[i], R, MU, LAM)
        energy[i] = hencky.energy_density(F[i], R, MU, LAM)
        e, half, along, across = hencky.strain(F[i], R)
        again[i] = hencky.deformation(e, half, along, across, R)


@ti.kernel
def fill_stiffness(tau: MATRICES, stiffness: VALUES):
    for i in range(tau.shape[0]):
        stiffness[i] = hencky.stiffness(tau[i], MU, LAM)


def stress_of(F: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stress, energy, and F put together again from its strain."""
    tau, again, energy = np.zeros_like(F), np.zeros_like(F), np.zeros(len(F))
    fill_stress(np.ascontiguousarray(F), tau, again, energy)
    return tau, energy, again


def draw(seed: int, count: int = 200, size: float = 0.3) -> np.ndarray:
    """Deformations that are not inverted, in any orientation."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(-math.pi, math.pi, count)
    turned = np.moveaxis(np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]), -1, 0)
    return turned @ (np.eye(2) + rng.uniform(-size, size, (count, 2, 2)))


def test_logarithm_and_power_are_those_of_the_library():
    x = np.geomspace(1e-6, 1e6, 2001)
    logs, powers = np.zeros_like(x), np.zeros_like(x)
    fill_logs(x, logs, powers, 3.74)
    np.testing.assert_allclose(logs, np.log(x), atol=3e-14)
    np.testing.assert_allclose(powers, x**3.74, rtol=1e-12)


def test_the_logarithm_of_a_small_strain_keeps_its_digits():
    strain = np.geomspace(1e-9, 1e-2, 200)
    logs, _ = np.zeros_like(strain), np.zeros_like(strain)
    fill_logs(1.0 + strain, logs, _, 1.0)
    np.testing.assert_allclose(logs, np.log1p((1.0 + strain) - 1.0), rtol=1e-15)


def test_stress_is_that_of_the_matrix_logarithm():
    """tau = 2 mu eps + lambda tr eps, with eps = ln(F F^T) / 2."""
    F = draw(0)
    tau, energy, again = stress_of(F)
    eps = np.array([logm(f @ f.T).real / 2 for f in F])
    e = np.trace(eps, axis1=1, axis2=2)
    np.testing.assert_allclose(tau, 2 * MU * eps + LAM * e[:, None, None] * np.eye(2), atol=1e-12)
    np.testing.assert_allclose(energy, MU * (eps**2).sum(axis=(1, 2)) + LAM / 2 * e**2, atol=1e-12)
    np.testing.assert_allclose(again, F, atol=1e-13)


def test_stress_is_the_slope_of_the_energy():
    """tau : L = d psi(F + s L F) / ds, by differences of fourth order."""
    F, h = draw(1), 1e-3
    L = np.random.default_rng(2).normal(0, 1, F.shape)
    energy = [stress_of(F + s * L @ F)[1] for s in (-2 * h, -h, h, 2 * h)]
    slope = (8 * (energy[2] - energy[1]) - (energy[3] - energy[0])) / (12 * h)
    power = (stress_of(F)[0] * L).sum(axis=(1, 2))
    np.testing.assert_allclose(slope, power, atol=1e-8 * np.abs(power).max())


def test_stress_does_not_depend_on_the_observer():
    F, (Q, Q_0) = draw(3), draw(4, 2, 0.0)
    tau, turned = stress_of(F)[0], stress_of(Q @ F @ Q_0)[0]
    np.testing.assert_allclose(turned, Q @ tau @ Q.T, atol=1e-12)


def test_stiffness_is_that_along_the_axis_of_the_largest_compression():
    """lambda + 2 mu - tau_1 with the smallest principal stress tau_1, as long as it is negative."""
    tau = np.random.default_rng(5).normal(0, 1, (200, 2, 2))
    tau += tau.transpose(0, 2, 1)
    least = np.linalg.eigvalsh(tau)[:, 0]
    assert (least < 0).sum() > 20 and (least > 0).sum() > 20
    stiffness = np.zeros(len(tau))
    fill_stiffness(tau, stiffness)
    np.testing.assert_allclose(stiffness, LAM + 2 * MU - np.minimum(least, 0), rtol=1e-13)
