"""Cam clay: the return to the ellipse against a general solver, its flow, its cap, and runs with it."""

import numpy as np
import pytest
from scipy.optimize import root

from snowrepro.compiler import ti
from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.mpm.ledger import unclosed_share
from snowrepro.physics import cam_clay
from snowrepro.run import simulate
from tests.conftest import SMALL
from tests.laws.points import Points

M, BETA, MU, K = 0.5, 0.1, 5.8e4, 9.7e4
VALUES = ti.types.ndarray(dtype=ti.f64, ndim=1)
compiled = pytest.mark.usefixtures("taichi")


@ti.kernel
def fill_returned(p: VALUES, q: VALUES, p_c: VALUES, M: ti.f64, beta: ti.f64, new_p: VALUES, new_q: VALUES):
    for i in range(p.shape[0]):
        new_p[i], new_q[i] = cam_clay.return_to_ellipse(p[i], q[i], p_c[i], MU, K, M, beta)


@ti.kernel
def fill_caps(p_0: ti.f64, hardening: ti.f64, J_P: VALUES, by_sinh: VALUES, by_exp: VALUES):
    for i in range(J_P.shape[0]):
        by_sinh[i] = cam_clay.cap_by_sinh(p_0, K, hardening, J_P[i])
        by_exp[i] = cam_clay.cap_by_exp(p_0, hardening, J_P[i])


def return_to_ellipse(p, q, p_c, M=M, beta=BETA) -> tuple[np.ndarray, np.ndarray]:
    p, q, p_c = (np.array(each, dtype=float) for each in np.broadcast_arrays(p, q, p_c))
    new_p, new_q = np.zeros_like(p), np.zeros_like(p)
    fill_returned(p, q, p_c, M, beta, new_p, new_q)
    return new_p, new_q


def yield_of(p, q, p_c, M=M, beta=BETA):
    """y over the square of the ellipse's height."""
    return (q**2 + M**2 * (p + beta * p_c) * (p - p_c)) / (M * (1 + beta) * p_c / 2) ** 2


def solve_whole(p, q, M, beta) -> tuple[float, float]:
    """Return (p, q) over p_c by a general solver, from the nearest of 2,001 points of the ellipse.

    Three unknowns, and nothing known of the ellipse but y and its gradient: the plastic strain is g grad y.
    """

    def residual(unknown):
        new_p, new_q, g = unknown
        flow_p, flow_q = M**2 * (2 * new_p - (1 - beta)), 2 * new_q
        return [new_p - p + K / MU * g * flow_p, new_q - q + g * flow_q, new_q**2 + M**2 * (new_p + beta) * (new_p - 1)]

    angle = np.linspace(1e-3, np.pi - 1e-3, 2001)
    on_p = (1 - beta) / 2 + (1 + beta) / 2 * np.cos(angle)
    on_q = M * (1 + beta) / 2 * np.sin(angle)
    nearest = np.argmin((on_p - p) ** 2 * MU / K + (on_q - q) ** 2)
    first_g = max((q - on_q[nearest]) / (2 * on_q[nearest]), 0)
    found = root(residual, [on_p[nearest], on_q[nearest], first_g], tol=1e-13)
    assert np.abs(found.fun).max() < 1e-9
    return found.x[0], found.x[1]


@compiled
@pytest.mark.parametrize(("slope", "beta"), [(0.5, 0.1), (1.5, 0.0), (0.3, 1.0)])
def test_one_unknown_finds_what_a_general_solver_finds(slope, beta):
    """1,000 random trials, up to 20 times as far out as the ellipse is wide."""
    rng = np.random.default_rng(0)
    count = 1000
    p_c = 10 ** rng.uniform(1, 5, count)
    p = p_c * rng.uniform(-10, 10, count) * 10 ** rng.uniform(-2, 0.3, count)
    q = p_c * rng.uniform(0, 10, count) * 10 ** rng.uniform(-2, 0.3, count)
    new_p, new_q = return_to_ellipse(p, q, p_c, slope, beta)
    outside = yield_of(p, q, p_c, slope, beta) > 0
    assert 300 < outside.sum() < count
    np.testing.assert_array_equal(new_p[~outside], p[~outside])
    np.testing.assert_array_equal(new_q[~outside], q[~outside])
    assert np.abs(yield_of(new_p, new_q, p_c, slope, beta)[outside]).max() < 1e-10
    p, q, new_p, new_q = (each[outside] / p_c[outside] for each in (p, q, new_p, new_q))
    solved = np.array([solve_whole(*trial, slope, beta) for trial in zip(p, q, strict=True)])
    np.testing.assert_allclose(np.stack([new_p, new_q], axis=1), solved, atol=1e-7)


@compiled
def test_plastic_strain_is_normal_to_the_ellipse():
    """(p_tr - p) / K and (q_tr - q) / mu stand to one another as dy/dp and dy/dq do."""
    angle = np.linspace(0.05, np.pi - 0.05, 50)
    p_c = 1000.0
    p = 450 + 3000 * np.cos(angle)
    q = 3000 * np.sin(angle)
    new_p, new_q = return_to_ellipse(p, q, p_c)
    flow_p, flow_q = (p - new_p) / K, (q - new_q) / MU
    normal_p, normal_q = M**2 * (2 * new_p - (1 - BETA) * p_c), 2 * new_q
    sine = (flow_p * normal_q - flow_q * normal_p) / (np.hypot(flow_p, flow_q) * np.hypot(normal_p, normal_q))
    assert np.abs(sine).max() < 1e-9
    assert (flow_p * normal_p + flow_q * normal_q > 0).all()


@compiled
def test_the_tips_return_to_themselves():
    """Isotropic trials, beyond both strengths: p_c and -beta p_c, and no shear."""
    new_p, new_q = return_to_ellipse([5000.0, -5000.0], [0.0, 0.0], 1000.0)
    np.testing.assert_allclose(new_p, [1000.0, -100.0], rtol=1e-12)
    assert not new_q.any()


@compiled
def test_the_cap_by_hand():
    J_P = np.array([1.0, 0.5, 0.2, 3.0])
    by_sinh, by_exp = np.zeros(4), np.zeros(4)
    fill_caps(770.0, 0.3, J_P, by_sinh, by_exp)
    np.testing.assert_allclose(by_sinh[:3], K * np.sinh(np.arcsinh(770 / K) - 0.3 * np.log(J_P[:3])), rtol=1e-11)
    np.testing.assert_allclose(by_exp, 770 * J_P**-0.3, rtol=1e-12)
    assert by_sinh[3] == pytest.approx(0.77, rel=1e-12)  # snow that came apart


@compiled
def test_isotropic_compression_goes_along_the_cap():
    """p is elastic up to p_0, and then p_c of the plastic volume, a step behind."""
    point = Points(1, "material=cam_clay")
    pressures, caps = [], []
    for _ in range(400):
        caps.append(point.cap())
        point.deform(np.eye(2) * 0.9995)
        pressures.append(-np.trace(point.read("tau")[0]) / 2)
    pressures, caps = np.array(pressures), np.array(caps)
    elastic = -point.bulk * 2 * np.log(0.9995) * np.arange(1, 401)
    yielded = elastic > 770
    np.testing.assert_allclose(pressures[~yielded], elastic[~yielded], rtol=1e-9)
    np.testing.assert_allclose(pressures[yielded], caps[yielded], rtol=1e-9)
    assert pressures[-1] > 10 * 770


@compiled
@pytest.mark.parametrize("path", [np.diag([0.999, 1.0]), np.array([[1.0, 0.002], [0.0, 1.0]]), np.diag([0.999, 1.002])])
def test_compression_and_shear_stay_on_the_ellipse(path):
    """After yield, y(p, q) = 0 with the p_c of before the step; volume is shared between elastic and plastic."""
    point, J = Points(1, "material=cam_clay"), 1.0
    for step in range(300):
        cap = point.cap()
        point.deform(path)
        J *= np.linalg.det(path)
        tau = point.read("tau")[0]
        p, q = -np.trace(tau) / 2, np.hypot((tau[0, 0] - tau[1, 1]) / 2, tau[0, 1])
        assert yield_of(p, q, cap) < 1e-9
        if step > 60:
            assert yield_of(p, q, cap) == pytest.approx(0, abs=1e-9)
    assert np.linalg.det(point.read("F_E")[0]) * point.read("J_P")[0] == pytest.approx(J, rel=1e-12)


@compiled
def test_sheared_snow_goes_to_the_critical_state():
    """Under shear at constant volume the pressure settles where plastic flow has no volume: the ellipse's middle."""
    point = Points(1, "material=cam_clay")
    for _ in range(40):
        point.deform(np.eye(2) * 0.9995)
    for _ in range(4000):
        point.deform(np.array([[1.0, 0.001], [0.0, 1.0]]))
    tau = point.read("tau")[0]
    p, q = -np.trace(tau) / 2, np.hypot((tau[0, 0] - tau[1, 1]) / 2, tau[0, 1])
    assert p == pytest.approx((1 - BETA) / 2 * point.cap(), rel=1e-3)
    assert q == pytest.approx(M * (1 + BETA) / 2 * point.cap(), rel=1e-3)


@compiled
def test_sintering_grows_the_cap_or_nothing():
    """With xi ten times its first value p_0 is ten times as high, unless nothing is to grow."""
    for choice, times in (("cap", 10), ("nothing", 1)):
        point = Points(1, "material=cam_clay", f"material.law.sintered={choice}")
        point.write("hardening", np.full(1, 50.0))
        for _ in range(100):
            point.deform(np.diag([0.999, 0.999]))
            if point.read("J_P")[0] < 1:
                break
        onset = -np.trace(point.read("tau")[0]) / 2
        assert onset == pytest.approx(770 * times, rel=1e-9)


def test_wrong_parameters_are_refused():
    with pytest.raises(ConfigError, match=r"law.*cam_clay"):
        compose(["material=cam_clay", "material.law.name=jelly"])
    with pytest.raises(ConfigError, match=r"set xi, or law\.sintered=nothing"):
        compose(["material=cam_clay", "material.xi=0"])
    with pytest.raises(ConfigError, match="cohesion"):
        compose(["material=cam_clay", "material.law.cohesion=-1"])


def test_a_run_with_cam_clay_closes_its_ledger():
    """Pressed, sintered, falling and breaking: energy as well explained as the paper's material."""
    run = simulate(compose([*SMALL, "pressure=3000", "material=cam_clay"]))
    assert unclosed_share(run) < 0.06
    assert float(run.plastic_work.max()) <= 0
    assert float(abs(run.hardening_work).max()) == 0
    assert float(run.J_P.min()) < 0.95
