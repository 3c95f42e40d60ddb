"""Two elastic discs that collide (Sulsky, Chen and Schreyer 1994): contact comes from the grid alone."""

import numpy as np
import pytest

from snowrepro.composition.compose import compose
from tests import twin
from tests.validation.motion import ELASTIC, Motion, in_space, rings

RHO, E, NU, RADIUS = 100.0, 1e4, 0.3, 8.0
WAVE = np.sqrt(E / RHO)  # speed of a wave in a rod; a radius takes 0.8 s
SPEED = 0.05 * WAVE  # of each disc; both are flattened by a tenth of the radius
SPLINES = (pytest.param("quadratic", marks=pytest.mark.nightly), "cubic")


class Collision:
    """Two discs, the one at the left going right and the other left, stepped until they are well apart again."""

    def __init__(self, dx: float, spline: str, aside: float = 0.0):
        """``aside`` is how far the second disc's centre is above the first's."""
        case = compose(
            [
                *ELASTIC,
                *(f"material.rho={RHO}", f"material.E={E}", f"material.nu={NU}"),
                *("material.theta_c=0.9", "material.theta_s=0.9"),  # never reached
                *(f"solver.spline={spline}", f"fidelity.dx={dx}"),
            ]
        ).case
        places, volumes = rings(0.0, RADIUS, dx / 2)
        self.n, self.mass = len(places), volumes * RHO
        gap = 3 * dx  # on either spline they share no node at the start
        left = np.array([1.0, 1.0]) * (2 * RADIUS + 6 * dx)
        right = left + np.array([np.sqrt((2 * RADIUS) ** 2 - aside**2) + gap, aside])
        both = np.concatenate([places + left, places + right])
        frame_time = 0.05 * RADIUS / WAVE
        self.motion = Motion(case, in_space(case, both, np.tile(volumes, 2)), frame_time)
        velocity = np.repeat([[SPEED, 0.0], [-SPEED, 0.0]], self.n, axis=0)
        self.motion.set_velocity(velocity, np.zeros((2 * self.n, 2, 2)))
        count = int((gap / SPEED + 7 * RADIUS / WAVE) / frame_time)
        records = [self.look()]
        for _ in range(count):
            self.motion.advance()
            records.append(self.look())
        self.times = frame_time * np.arange(count + 1)
        self.velocities, self.centres, self.spin, self.energy = map(np.array, zip(*records, strict=True))

    def look(self):
        """Velocity and centre of each disc (2, 2), angular momentum, and kinetic and elastic energy together."""
        m, n = self.motion, self.n
        v, x = (
            np.array([np.average(whole[part], axis=0, weights=self.mass) for part in (slice(n), slice(n, None))])
            for whole in (m.read("velocity"), m.read("position"))
        )
        elastic = twin.energy_density(m.read("F_E"), m.read("mu"), m.read("lam")) @ m.read("volume")
        return v, x, m.angular_momentum(), m.kinetic_energy() + elastic

    def restitution(self) -> float:
        """Speed of parting over that of meeting."""
        closing = self.velocities[:, 0, 0] - self.velocities[:, 1, 0]
        return float(-closing[-1] / closing[0])

    def contact_time(self) -> float:
        """While 5 to 95 % of the momentum pass over; the grid blurs the first and the last touch."""
        v = self.velocities[:, 0, 0]
        return time_between(self.times, (v[0] - v) / (v[0] - v[-1]))


def time_between(times: np.ndarray, share: np.ndarray) -> float:
    """Time that a growing share takes from 0.05 to 0.95."""
    return float(np.interp(0.95, share, times) - np.interp(0.05, share, times))


def quasi_static_contact_time() -> float:
    """Contact time of the two discs, each as a mass on the spring of static theory.

    Hertz's line contact: a^2 = 4 P R (1 - nu^2) / (pi E), and the approach of contact and centre is
    P (1 - nu^2) / (pi E) (2 ln(4 R / a) - 1) (Johnson, Contact Mechanics, 1985, Eq. 5.57).
    """
    soft = (1 - NU**2) / (np.pi * E)
    force = E * RADIUS * np.linspace(0, 0.5, 5001)[1:] ** 2
    approach = force * soft * (2 * np.log(4 * RADIUS / np.sqrt(4 * force * RADIUS * soft)) - 1)
    mass, dt = RHO * np.pi * RADIUS**2, 1e-3 * RADIUS / WAVE
    x, v, velocities = 0.0, SPEED, [SPEED]
    while x >= 0:
        v -= dt * np.interp(x, approach, force, left=0) / mass
        x += dt * v
        velocities.append(v)
    share = (SPEED - np.array(velocities)) / (2 * SPEED)
    return time_between(dt * np.arange(len(share)), share)


@pytest.mark.slow
@pytest.mark.parametrize("spline", SPLINES)
def test_equal_discs_exchange_their_velocities(spline, compare):
    """Head-on: v after = -e v before, e to 1 with the grid; no energy is made; in contact as long as theory says.

    The theory of contact is static, but the disc's slowest vibration is no shorter than the contact: 15 % to spare.
    """
    coarse, fine = Collision(0.5, spline), Collision(0.25, spline)
    assert np.linalg.norm(fine.centres[-1, 1] - fine.centres[-1, 0]) > 2.1 * RADIUS
    assert np.linalg.norm(fine.centres[:, 1] - fine.centres[:, 0], axis=1).min() < 1.9 * RADIUS
    drift = np.abs(fine.velocities.sum(axis=1)).max() / SPEED
    compare(f"discs, {spline}: drift of momentum", drift, 0, abs=1e-12)
    compare(f"discs, {spline}: restitution at 64 cells a disc", fine.restitution(), 1, abs=0.04)
    assert 1 - fine.restitution() < 0.85 * (1 - coarse.restitution())
    growth = max((run.energy / run.energy[0]).max() - 1 for run in (coarse, fine))
    compare(f"discs, {spline}: growth of energy", growth, 0, abs=1e-12)
    compare(f"discs, {spline}: energy kept at 64 cells a disc", fine.energy[-1] / fine.energy[0], 1, abs=0.04)
    theory = quasi_static_contact_time()
    compare(f"discs, {spline}: time of contact [s], quasi-static", fine.contact_time(), theory, rel=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("spline", SPLINES)
def test_a_glancing_blow_keeps_both_momenta(spline, compare):
    """A disc hit off its centre turns aside and spins; momentum and angular momentum stay to round-off."""
    blow = Collision(1.0, spline, aside=RADIUS)
    drift = np.abs(blow.velocities.sum(axis=1)).max() / SPEED
    compare(f"glancing discs, {spline}: drift of momentum", drift, 0, abs=1e-12)
    spin = blow.spin / blow.spin[0] - 1
    compare(f"glancing discs, {spline}: drift of angular momentum", np.abs(spin).max(), 0, abs=1e-12)
    assert blow.energy.max() <= blow.energy[0] * (1 + 1e-12)
    assert blow.velocities[-1, 0, 1] < -0.2 * SPEED  # the blow acted, and downwards on the lower disc
