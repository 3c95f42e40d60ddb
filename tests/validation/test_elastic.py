"""Elastic bodies against mechanics: rigid motion, a vibrating bar, a disc under its own force."""

import numpy as np
import pytest

from snowrepro.composition.compose import compose
from snowrepro.scene.build import sample
from snowrepro.scene.press import external_force
from snowrepro.settings.case import Outline
from tests.validation.motion import ELASTIC, Motion, in_space

SPLINES = ("quadratic", "cubic")


def disc(radius: float, dx: float = 1.0) -> np.ndarray:
    """Particles of a disc in open space."""
    return sample(Outline(kind="circle", radius=radius), dx, 4, seed=0)[0] + radius + 8.3


@pytest.mark.parametrize("spline", SPLINES)
def test_rigid_translation(spline, compare):
    """A body that flies stays as it is."""
    case = compose([*ELASTIC, f"solver.spline={spline}"]).case
    start = disc(6.0)
    motion = Motion(case, in_space(case, start, 0.25), frame_time=0.1)
    velocity = np.array([0.7, 0.3])
    motion.set_velocity(np.tile(velocity, (len(start), 1)), np.zeros((len(start), 2, 2)))
    motion.advance(50)
    off = np.abs(motion.read("position") - start - 5.0 * velocity).max()
    compare(f"translation, {spline}: way off after 5 s [cells]", off, 0, abs=1e-10)
    strain = np.abs(motion.read("F_E") - np.eye(2)).max()
    compare(f"translation, {spline}: strain", strain, 0, abs=1e-10)


@pytest.mark.parametrize("spline", SPLINES)
def test_rigid_rotation(spline, compare):
    """Twenty seconds at one radian a second: angular momentum stays, kinetic energy never grows."""
    case = compose([*ELASTIC, f"solver.spline={spline}", "material.E=1e6"]).case
    places = disc(8.0)
    motion = Motion(case, in_space(case, places, 0.25), frame_time=0.1)
    arm = places - places.mean(axis=0)
    spin = np.array([[0.0, -1.0], [1.0, 0.0]])
    motion.set_velocity(arm @ spin.T, np.tile(spin, (len(places), 1, 1)))
    momentum, energy = [motion.angular_momentum()], [motion.kinetic_energy()]
    for _ in range(200):
        motion.advance()
        momentum.append(motion.angular_momentum())
        energy.append(motion.kinetic_energy())
    drift = np.abs(np.array(momentum) / momentum[0] - 1).max()
    compare(f"rotation, {spline}: drift of angular momentum in 20 s", drift, 0, abs=1e-10)
    compare(f"rotation, {spline}: growth of kinetic energy", max(energy) / energy[0] - 1, 0, abs=1e-12)
    compare(f"rotation, {spline}: kinetic energy left after 20 s", energy[-1] / energy[0], 1, rel=0.01)


def period_of_bar(dx: float, spline: str) -> float:
    """Period of the first longitudinal mode of a free bar, over theory's 2 L sqrt(rho / E)."""
    length, height, particles = 24.0, 6.0, 2.0 / dx
    case = compose([*ELASTIC, f"fidelity.dx={dx}", f"solver.spline={spline}", "material.nu=0", "material.E=1e5"]).case
    theory = 2 * length * np.sqrt(case.material.rho / case.material.E)
    spacing, end = 1 / particles, 6 * dx
    axes = [end + (np.arange(round(size * particles)) + 0.5) * spacing for size in (length, height)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    motion = Motion(case, in_space(case, places, spacing**2), frame_time=theory / 40)
    phase = np.pi * (places[:, 0] - end) / length
    velocity, gradient = np.zeros((len(places), 2)), np.zeros((len(places), 2, 2))
    velocity[:, 0] = 0.1 * np.cos(phase)
    gradient[:, 0, 0] = -0.1 * np.pi / length * np.sin(phase)
    motion.set_velocity(velocity, gradient)
    amplitude = []
    for _ in range(120):
        motion.advance()
        amplitude.append(motion.read("velocity")[:, 0] @ np.cos(phase))
    a = np.array(amplitude)
    i = np.flatnonzero(np.sign(a[1:]) != np.sign(a[:-1]))
    crossings = i + a[i] / (a[i] - a[i + 1])  # in frames, a fortieth of a period each
    return float(2 * np.polyfit(np.arange(len(crossings)), crossings, 1)[0] / 40)


@pytest.mark.slow
@pytest.mark.parametrize("spline", [pytest.param("quadratic", marks=pytest.mark.nightly), "cubic"])
def test_vibrating_bar(spline, compare):
    """Frequency within 1 % at the paper's grid spacing, and second order in it."""
    periods = {dx: period_of_bar(dx, spline) for dx in (2.0, 1.0, 0.5)}
    compare(f"bar, {spline}: period over theory at dx = 1", periods[1.0], 1, rel=0.01)
    error = [abs(periods[dx] - 1) for dx in (2.0, 1.0, 0.5)]
    order = np.log2(error[0] / error[2]) / 2
    compare(f"bar, {spline}: order of convergence", order, 2, abs=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("spline", [pytest.param("quadratic", marks=pytest.mark.nightly), "cubic"])
def test_disc_in_its_pressing_force(spline, compare):
    """The press's inward force on an elastic disc, let come to rest: its change of volume gives the bulk modulus.

    Theory: plane strain, free edge, b = -k r: u = A r + B r^3 with B = rho k / (8 (lambda + 2 mu)).
    """
    radius, pressure, E, nu = 12.0, 1e3, 1e6, 0.3
    case = compose([*ELASTIC, f"solver.spline={spline}", f"material.E={E}", f"material.nu={nu}"]).case
    places = disc(radius)
    motion = Motion(case, in_space(case, places, np.pi * radius**2 / len(places)))
    depth = np.zeros(len(places))
    force = external_force("radial_linear", places, depth, pressure, case.material.rho, radius, 2.0)
    motion.particles.write("force", force)
    motion.advance(100, damping=40.0)
    motion.advance(50, damping=8.0)
    assert np.abs(motion.read("velocity")).max() < 1e-4
    measured = float((np.linalg.det(motion.read("F_E")) - 1).mean())
    lam, mu = nu * E / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
    B = 2 * pressure / radius**2 / (8 * (lam + 2 * mu))
    A = -B * radius**2 * (2 * lam + 3 * mu) / (lam + mu)
    r2 = ((places - places.mean(axis=0)) ** 2).sum(axis=1)
    theory = float((2 * A + 4 * B * r2).mean())
    compare(f"pressed disc, {spline}: bulk modulus [Pa]", (lam + mu) * theory / measured, lam + mu, rel=0.01)
