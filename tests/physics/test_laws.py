"""Eqs. 1 to 9 at one point: against values worked by hand and against the NumPy twin."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from snowrepro.compiler import ti
from snowrepro.physics import elasticity, plasticity, sintering
from snowrepro.physics.maxima import maximum_moduli
from tests import twin

pytestmark = pytest.mark.usefixtures("taichi")
anything = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=100)


@ti.kernel
def exp_of(x: ti.f64) -> ti.f64:
    return elasticity.bounded_exp(x)


@ti.kernel
def factor_of(xi: ti.f64, J_P: ti.f64, low: ti.f64, high: ti.f64) -> ti.f64:
    return elasticity.hardening_factor(xi, J_P, low, high)


@ti.kernel
def lame_of(E: ti.f64, nu: ti.f64) -> ti.math.vec2:
    mu, lam = elasticity.lame_parameters(E, nu)
    return ti.Vector([mu, lam])


@ti.kernel
def stress_of(a: ti.f64, b: ti.f64, c: ti.f64, d: ti.f64, mu: ti.f64, lam: ti.f64) -> ti.math.mat2:
    F = ti.Matrix([[a, b], [c, d]])
    return elasticity.kirchhoff_stress(F, elasticity.polar_rotation(F), mu, lam)


@ti.kernel
def von_mises_of(
    a: ti.f64, b: ti.f64, c: ti.f64, d: ti.f64, J_P: ti.f64, mu: ti.f64, lam: ti.f64, strain: ti.template()
) -> ti.f64:
    F = ti.Matrix([[a, b], [c, d]])
    J = F.determinant() * J_P
    zz = elasticity.kirchhoff_stress_zz(F, lam) / J if ti.static(strain) else 0.0
    return elasticity.von_mises_stress(elasticity.kirchhoff_stress(F, elasticity.polar_rotation(F), mu, lam) / J, zz)


@ti.kernel
def clamped_of(a: ti.f64, b: ti.f64, c: ti.f64, d: ti.f64, low: ti.f64, high: ti.f64) -> ti.types.vector(5, ti.f64):
    F = ti.Matrix([[a, b], [c, d]])
    F_E, ratio = plasticity.clamp_stretches(F, elasticity.polar_rotation(F), low, high)
    return ti.Vector([F_E[0, 0], F_E[0, 1], F_E[1, 0], F_E[1, 1], ratio])


@ti.kernel
def sintered(which: ti.template(), a: ti.f64, b: ti.f64, c: ti.f64, d: ti.f64, e: ti.f64, f: ti.f64) -> ti.f64:
    result = 0.0
    if ti.static(which == "density"):
        result = sintering.density(a, b, a / 700.0, c, d, e, f)
    elif ti.static(which == "young"):
        result = sintering.youngs_modulus(a, b, c)
    elif ti.static(which == "poisson"):
        result = sintering.poissons_ratio(a, b)
    else:
        result = sintering.hardening_coefficient(a, b, c, d, e, f)
    return result


def test_eq1_by_hand():
    """xi = 5, J_P = 0.8: exp(1) = 2.71828...; at J_P = 0 the exponent 5 is the cap, beyond it stays there."""
    assert factor_of(5.0, 0.8, -16.0, 5.0) == pytest.approx(2.718281828459045, rel=1e-14)
    assert factor_of(50.0, 0.5, -16.0, 5.0) == pytest.approx(148.4131591025766, rel=1e-14)
    assert factor_of(50.0, 2.0, -16.0, 5.0) == pytest.approx(1.1253517471925912e-07, rel=1e-13, abs=0)


@anything
@given(st.floats(-16.5, 16.5))
def test_bounded_exp_is_exp(x):
    """The polynomial stands for exp over the whole range that the bounds allow."""
    assert exp_of(x) == pytest.approx(math.exp(x), rel=2e-14, abs=0)


def test_lame_by_hand():
    """E = 1.4e5, nu = 0.2 (Table 1): mu = 1.4e5 / 2.4, lambda = 2.8e4 / 0.72."""
    mu, lam = lame_of(1.4e5, 0.2)
    assert mu == pytest.approx(58333.333333333336, rel=1e-15)
    assert lam == pytest.approx(38888.888888888891, rel=1e-15)


@anything
@given(st.floats(1.0, 1e9), st.floats(0.0, 0.45))
def test_lame_gives_back_the_moduli(E, nu):
    """E = mu (3 lambda + 2 mu) / (lambda + mu), nu = lambda / (2 (lambda + mu))."""
    mu, lam = lame_of(E, nu)
    assert mu * (3 * lam + 2 * mu) / (lam + mu) == pytest.approx(E, rel=1e-14)
    assert lam / (2 * (lam + mu)) == pytest.approx(nu, abs=1e-15)


def test_stress_of_uniaxial_stretch_by_hand():
    """F = diag(1.1, 1), mu = 3, lambda = 5: tau_xx = 2*3*0.1*1.1 + 5*0.1*1.1 = 1.21, tau_yy = 0.55."""
    tau = stress_of(1.1, 0.0, 0.0, 1.0, 3.0, 5.0)
    assert tau[0, 0] == pytest.approx(1.21, rel=1e-13)
    assert tau[1, 1] == pytest.approx(0.55, rel=1e-13)
    assert tau[0, 1] == tau[1, 0] == 0.0


matrices = st.tuples(*[st.floats(-0.4, 0.4)] * 4).map(lambda m: np.eye(2) + np.reshape(m, (2, 2)))
angles = st.floats(-math.pi, math.pi)


def rotation(angle):
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


@anything
@given(matrices, angles)
def test_stress_against_twin_under_any_rotation(F, angle):
    """tau = P F^T with the twin's P; a rotated body has the rotated stress (objectivity)."""
    Q = rotation(angle)
    F = Q @ F
    tau = np.array(stress_of(*F.ravel(), 3.0, 5.0).to_numpy())
    np.testing.assert_allclose(tau, twin.first_piola(F, 3.0, 5.0) @ F.T, atol=1e-12)


@anything
@given(matrices, angles, angles)
def test_laws_do_not_depend_on_the_observer(F, seen, laid):
    """tau(Q F) = Q tau(F) Q^T, tau(F Q) = tau(F) (isotropic), and likewise sigma_m and the clamp, to round-off."""
    Q, Q_0 = rotation(seen), rotation(laid)
    F_2 = Q @ F @ Q_0
    tau, tau_2 = (stress_of(*m.ravel(), 3.0, 5.0).to_numpy() for m in (F, F_2))
    np.testing.assert_allclose(tau_2, Q @ tau @ Q.T, atol=3e-14)
    sigma_m, sigma_m_2 = (von_mises_of(*m.ravel(), 0.8, 3.0, 5.0, True) for m in (F, F_2))
    assert sigma_m_2 == pytest.approx(sigma_m, abs=1e-12)
    (*F_E, ratio), (*F_E_2, ratio_2) = (clamped_of(*m.ravel(), 0.9, 1.1) for m in (F, F_2))
    np.testing.assert_allclose(np.reshape(F_E_2, (2, 2)), Q @ np.reshape(F_E, (2, 2)) @ Q_0, atol=1e-14)
    assert ratio_2 == pytest.approx(ratio, rel=1e-13)


def test_von_mises_by_hand():
    """Simple tension sigma_xx = 1.21 / 1.1, sigma_yy = sigma_zz = 0.5 (plane strain): sigma_m = 0.6."""
    assert von_mises_of(1.1, 0.0, 0.0, 1.0, 1.0, 3.0, 5.0, True) == pytest.approx(0.6, rel=1e-12)
    xx, yy = 1.1, 0.5
    by_hand = math.sqrt(xx**2 - xx * yy + yy**2)
    assert von_mises_of(1.1, 0.0, 0.0, 1.0, 1.0, 3.0, 5.0, False) == pytest.approx(by_hand, rel=1e-12)


@anything
@given(matrices, st.floats(0.2, 2.0), st.booleans())
def test_von_mises_against_twin(F, J_P, strain):
    """Eqs. 3 to 5 equal the invariant form sqrt(3/2 s:s) of the 3x3 stress."""
    expected = twin.von_mises(F, J_P, 3.0, 5.0, strain)
    assert von_mises_of(*F.ravel(), J_P, 3.0, 5.0, strain) == pytest.approx(expected, rel=1e-9, abs=1e-12)


@anything
@given(matrices, angles)
def test_plastic_clamp_against_twin(F, angle):
    """The closed form gives the SVD's return mapping, and J = J_E J_P to round-off."""
    F = rotation(angle) @ F
    *F_E, ratio = clamped_of(*F.ravel(), 0.99, 1.005)
    F_E = np.reshape(F_E, (2, 2))
    expected, J_P = twin.clamp_plastic(F, 1.0, 0.99, 1.005, (0.0, 1e9))
    np.testing.assert_allclose(F_E, expected, atol=1e-12)
    assert ratio == pytest.approx(J_P, rel=1e-12)
    assert np.linalg.det(F_E) * ratio == pytest.approx(np.linalg.det(F), rel=1e-12)


@anything
@given(matrices, angles)
def test_plastic_clamp_leaves_what_it_has_clamped(F, angle):
    """The stretches it returns are within the bounds, and a second return mapping changes nothing."""
    *F_E, _ = clamped_of(*(rotation(angle) @ F).ravel(), 0.99, 1.005)
    stretches = np.linalg.svd(np.reshape(F_E, (2, 2)), compute_uv=False)
    assert stretches.max() <= 1.005 + 1e-14
    assert stretches.min() >= 0.99 - 1e-14
    *again, ratio = clamped_of(*F_E, 0.99, 1.005)
    np.testing.assert_allclose(again, F_E, atol=1e-14)
    assert ratio == pytest.approx(1.0, abs=1e-13)


def test_elastic_points_keep_their_bits():
    """Inside the yield surface F is not rewritten."""
    F = (1.002, 1e-7, -3e-9, 0.995)
    *F_E, ratio = clamped_of(*F, 0.99, 1.005)
    assert tuple(F_E) == F
    assert ratio == 1.0


def test_eq2_by_hand():
    """rho = 100, rho_r = 1/7, sigma_m = 1000, |b| = 2, dt = 0.02: 100 + 2 (5e-7 * 7000 + 1e-3 * 2) = 100.011."""
    assert sintered("density", 100.0, 1000.0, 2.0, 0.02, 5e-7, 1e-3) == pytest.approx(100.011, rel=1e-14)


def test_eq6_eq7_eq8_by_hand():
    """rho_r0 = 1/7, C3 = -9: E_max = 1.4e5 e^(54/7); Eq. 7 gives back E0, nu0; at 300 kg/m^3 E = 1.4e5 e^(18/7)."""
    E_max, nu_max = maximum_moduli(1.4e5, 0.2, 1 / 7, -9, as_printed=False)
    assert E_max == pytest.approx(1.4e5 * math.exp(54 / 7), rel=1e-14)
    assert nu_max == pytest.approx(0.2 * math.sqrt(19), rel=1e-14)
    assert sintered("young", 1 / 7, E_max, -9.0, 0, 0, 0) == pytest.approx(1.4e5, rel=1e-13)
    assert sintered("young", 3 / 7, E_max, -9.0, 0, 0, 0) == pytest.approx(1.4e5 * math.exp(18 / 7), rel=1e-13)
    assert sintered("poisson", 1 / 7, nu_max, 0, 0, 0, 0) == pytest.approx(0.2, rel=1e-14)
    assert sintered("poisson", 1.0, nu_max, 0, 0, 0, 0) == pytest.approx(nu_max, rel=1e-14)


@anything
@given(st.floats(0.05, 0.95), st.floats(-16.0, 16.0), st.floats(0.0, 0.45))
def test_eq7_starts_where_eq8_was_told(rho_r0, C3, nu0):
    """Whatever the initial density: E and nu are E0 and nu0 there, and E is E_max in ice, at rho_r = 1."""
    E_max, nu_max = maximum_moduli(1.4e5, nu0, rho_r0, C3, as_printed=False)
    assert sintered("young", rho_r0, E_max, C3, 0, 0, 0) == pytest.approx(1.4e5, rel=1e-13)
    assert sintered("young", 1.0, E_max, C3, 0, 0, 0) == E_max
    assert sintered("poisson", rho_r0, nu_max, 0, 0, 0, 0) == pytest.approx(nu0, rel=1e-14)


def test_eq8_as_printed():
    """With 3 - rho_r as printed, nu starts at 0.2 sqrt(20/19) = 0.2052, not at 0.2."""
    _, nu_max = maximum_moduli(1.4e5, 0.2, 1 / 7, -9, as_printed=True)
    assert nu_max == pytest.approx(0.2 * math.sqrt(20), rel=1e-14)
    assert sintered("poisson", 1 / 7, nu_max, 0, 0, 0, 0) == pytest.approx(0.2 * math.sqrt(20 / 19), rel=1e-14)


def test_eq9_by_hand():
    """xi = 5, sigma_m = 1200, |b| = 3: 5 + 1.2 + 0.003; half of the growth at weight 1/2."""
    assert sintered("hardening", 5.0, 1200.0, 3.0, 1.0, 1e-3, 1e-3) == pytest.approx(6.203, rel=1e-14)
    assert sintered("hardening", 5.0, 1200.0, 3.0, 0.5, 1e-3, 1e-3) == pytest.approx(5.6015, rel=1e-14)
