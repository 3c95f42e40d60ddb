"""The step's own stress update on single points, led along paths of strain with closed solutions."""

import numpy as np
import pytest

from snowrepro.compiler import ti
from snowrepro.composition.compose import compose
from snowrepro.mpm import steps
from snowrepro.mpm.constants import make_constants
from snowrepro.mpm.state import Particles
from tests import twin

E, NU, XI, RHO, THETA_C, THETA_S = 1.4e5, 0.2, 5.0, 100.0, 0.01, 0.005  # Table 1
MU, LAM = twin.lame(E, NU)
pytestmark = pytest.mark.usefixtures("taichi")


@ti.kernel
def update_stress(particles: ti.template(), constants: ti.template()):
    ti.loop_config(serialize=True)
    for group in range(particles.lane_groups):
        steps.update_stress(group, True, particles, constants)


class Points:
    """Points of Table 1's snow that only ever see the strain that they are given."""

    def __init__(self, count: int, *overrides: str):
        self.constants = make_constants(compose(list(overrides)).case)
        self.particles = Particles(count)
        values = {"hardening": XI, "J_P": 1.0, "mass": RHO, "volume": 1.0, "mu": MU, "lam": LAM}
        for name, value in values.items():
            self.particles.write(name, np.full(count, value))
        self.particles.write("F_E", np.tile(np.eye(2), (count, 1, 1)))

    def deform(self, increment: np.ndarray) -> None:
        """F_E becomes increment @ F_E, as in step 6, and the stress follows."""
        self.particles.write("F_E", increment @ self.read("F_E"))
        update_stress(self.particles, self.constants)

    def read(self, name: str) -> np.ndarray:
        return self.particles.read(name)


def test_uniaxial_compression_and_back(compare):
    """Elastic to 1 - theta_c, then hardening at a constant elastic stretch; back, it yields at 1 + theta_s.

    With s the total stretch: f = s until f = 0.99, from then on f = 0.99 and J_P = s / 0.99, on the way
    back f = 0.99 s / s_least until f = 1.005, from then on J_P = s / 1.005.
    tau_xx = h (2 mu + lambda) (f - 1) f and tau_yy = h lambda (f - 1) f with h = exp(xi (1 - J_P)).
    """
    least = 0.8
    path = np.concatenate([np.linspace(1, least, 81)[1:], np.linspace(least, 0.9, 161)[1:]])
    turn = 80
    point, before, rows = Points(1), 1.0, []
    for s in path:
        point.deform(np.diag([s / before, 1.0]))
        tau = point.read("tau")[0]
        rows.append((point.read("F_E")[0, 0, 0], point.read("J_P")[0], tau[0, 0], tau[1, 1], tau[0, 1]))
        before = s
    f, J_P, tau_xx, tau_yy, tau_xy = np.array(rows).T

    low, high = 1 - THETA_C, 1 + THETA_S
    elastic = np.where(np.arange(len(path)) < turn, np.maximum(path, low), np.minimum(low * path / least, high))
    plastic = path / elastic
    h = np.exp(XI * (1 - plastic))
    compare("compression path: elastic stretch, deviation", np.abs(f / elastic - 1).max(), 0, abs=1e-13)
    compare("compression path: J_P, deviation", np.abs(J_P / plastic - 1).max(), 0, abs=1e-13)
    stress = h * (2 * MU + LAM) * (elastic - 1) * elastic
    scale = np.abs(stress).max()
    compare("compression path: tau_xx, deviation over its largest", np.abs(tau_xx - stress).max() / scale, 0, abs=1e-11)
    other = h * LAM * (elastic - 1) * elastic
    compare("compression path: tau_yy, deviation over tau_xx", np.abs(tau_yy - other).max() / scale, 0, abs=1e-11)
    assert not tau_xy.any()

    yielded = J_P[:turn] < 1 - 1e-12
    onset = path[:turn][yielded].max()  # steps of 0.0025
    compare("compression path: last elastic stretch", path[:turn][~yielded].min(), low, abs=1e-12)
    compare("compression path: first stretch with yield", onset, low, abs=2.5e-3 + 1e-12)
    slope = np.polyfit(J_P[:turn][yielded], np.log(-tau_xx[:turn][yielded]), 1)[0]
    compare("compression path: slope of ln |tau_xx| over J_P, -xi", slope, -XI, rel=1e-9)


def test_equal_compression_from_all_sides(compare):
    """Hydrostatic path to s = 0.9: both stretches clamp, J_P = (s / 0.99)^2, and the stress is a pressure."""
    point, s = Points(1), 0.9
    for _ in range(50):
        point.deform(np.eye(2) * s ** (1 / 50))
    J_P, f = (s / (1 - THETA_C)) ** 2, 1 - THETA_C
    compare("hydrostatic path: J_P", point.read("J_P")[0], J_P, rel=1e-13)
    pressure = np.exp(XI * (1 - J_P)) * (2 * MU * (f - 1) * f + LAM * (f**2 - 1) * f**2)
    tau = point.read("tau")[0]
    compare("hydrostatic path: tau_xx [Pa]", tau[0, 0], pressure, rel=1e-11)
    np.testing.assert_allclose(tau, np.eye(2) * pressure, atol=1e-9 * abs(pressure))


def test_volume_is_shared_out_between_elastic_and_plastic(compare):
    """On 200 random paths of 100 steps, J_E J_P stays the product of the steps' determinants to round-off."""
    rng = np.random.default_rng(0)
    points, J = Points(200), np.ones(200)
    for _ in range(100):
        increment = np.eye(2) + rng.normal(0, 3e-3, (200, 2, 2))
        points.deform(increment)
        J *= np.linalg.det(increment)
    J_P = points.read("J_P")
    assert np.ptp(J_P) > 0.05  # they have yielded
    product = np.linalg.det(points.read("F_E")) * J_P
    compare("random paths: J_E J_P over J, deviation", np.abs(product / J - 1).max(), 0, abs=1e-12)
    stretches = np.linalg.svd(points.read("F_E"), compute_uv=False)
    compare("random paths: beyond 1 + theta_s", max(stretches.max() - 1 - THETA_S, 0), 0, abs=1e-13)
    compare("random paths: beyond 1 - theta_c", max(1 - THETA_C - stretches.min(), 0), 0, abs=1e-13)


def test_stress_is_the_slope_of_the_energy(compare):
    """tau : L = d psi(exp(sL) F) / ds for random F and L: the solver's stress and the measured energy are one law.

    With theta_c, theta_s wide and J_P = 0.9 the hardened moduli stand in both; differences of fourth order.
    """
    rng = np.random.default_rng(1)
    count, h = 100, 1e-3
    points = Points(count, "material.theta_c=0.9", "material.theta_s=0.9")
    points.particles.write("J_P", np.full(count, 0.9))
    F, L = np.eye(2) + rng.uniform(-0.2, 0.2, (count, 2, 2)), rng.normal(0, 1, (count, 2, 2))
    points.deform(F)
    hardened = np.exp(XI * 0.1)

    def energy(s):
        return twin.energy_density(F + s * L @ F, hardened * MU, hardened * LAM)

    slope = (8 * (energy(h) - energy(-h)) - (energy(2 * h) - energy(-2 * h))) / (12 * h)
    power = (points.read("tau") * L).sum(axis=(1, 2))
    assert np.abs(power).max() > 1e4
    compare(
        "stress and energy: d psi - tau : L, relative", np.abs(slope - power).max() / np.abs(power).max(), 0, abs=1e-9
    )
    compare("stress and energy: energy at rest", twin.energy_density(np.eye(2)[None], MU, LAM)[0], 0, abs=1e-9)


def test_wave_speed_of_a_hardened_point():
    """c^2 = h (lambda + 2 mu) V / m, on which the time step rests: with h = e^(5 0.1) at J_P = 0.9."""
    point = Points(1)
    point.particles.write("J_P", np.array([0.9]))
    point.deform(np.eye(2))
    expected = np.exp(XI * 0.1) * (LAM + 2 * MU) / RHO
    assert point.read("wave_speed2")[0] == pytest.approx(expected, rel=1e-13)


def test_the_ledger_of_a_point_that_yields_closes(compare):
    """Energy gained = work of the strain + plastic flow + hardening, along a compression to 0.8 in 4,000 steps.

    The work is the integral of tau_xx d ln s by the trapezium rule; the energy is the twin's.
    """
    point, before, tau, work = Points(1), 1.0, 0.0, 0.0
    for s in np.linspace(1, 0.8, 4001)[1:]:
        point.deform(np.diag([s / before, 1.0]))
        now = point.read("tau")[0, 0, 0]
        work += 0.5 * (tau + now) * np.log(s / before)
        before, tau = s, now
    h = np.exp(XI * (1 - point.read("J_P")[0]))
    gained = twin.energy_density(point.read("F_E"), h * MU, h * LAM)[0]
    flow, hardening = point.read("plastic_work")[0], point.read("hardening_work")[0]
    assert flow < 0 < hardening < gained < -flow
    compare(
        "compression path: energy without a cause, of the work", (gained - work - flow - hardening) / work, 0, abs=1e-4
    )
    closed = (np.exp(XI * (1 - 0.8 / 0.99)) - 1) * twin.energy_density(np.diag([0.99, 1.0])[None], MU, LAM)[0]
    compare("compression path: energy by hardening", hardening, closed, rel=1e-3)
