"""The indenter against mechanics: elastic and yielding blocks, sections, common motion, books, half the speed."""

import numpy as np
import pytest

from snowrepro.composition.compose import compose
from snowrepro.mpm.indenter import OPEN, force_of
from snowrepro.run import simulate
from snowrepro.summary.measure import measure_test, read_curve
from tests.conftest import QUICK
from tests.validation.motion import ELASTIC, Motion, in_space
from tests.validation.test_elastic import disc

FLAT = 1e7  # radius of a disc that is flat over a few cells [cells]
WIDE, TALL, LEFT, LOW = 12.0, 40.0, 20.25, 8.0  # a block that ends on a grid line, and its lower left corner [cells]
VICE = LOW + 4.0


def block(radius: float = FLAT, **overrides: float) -> Motion:
    """A block in open space, under a disc that is not there yet; no friction, no hardening."""
    given = [f"{name.replace('__', '.')}={value}" for name, value in overrides.items()]
    case = compose([*ELASTIC, "indenter=disc", f"indenter.radius={radius}", *given]).case
    axes = [np.arange(0.25, size, 0.5) + low for size, low in ((WIDE, LEFT), (TALL, LOW))]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    return Motion(case, in_space(case, np.vstack([places, [60.0, 60.0]]), 0.25), frame_time=0.02)


def press(motion: Motion, top: float, depth: float, speed: float, damping: float = 0.0) -> list[float]:
    """Move the disc down from ``top`` by ``depth``; the force in each frame."""
    indenter, forces = motion.nodes.indenter, []
    for frame in range(round(depth / (speed * 0.02))):
        bottom = top - frame * 0.02 * speed
        indenter.set((LEFT + WIDE / 2, bottom + indenter.radius), speed, VICE)
        motion.advance(damping=damping)
        forces.append(force_of(indenter, motion.constants))
    return forces


def hold(motion: Motion, bottom: float, frames: int) -> float:
    """Let the snow come to rest under a disc that stands still; the force at the end.

    The last frames are not damped: damping acts before contact, and would take its part of what presses on the disc.
    """
    indenter = motion.nodes.indenter
    indenter.set((LEFT + WIDE / 2, bottom + indenter.radius), 0.0, VICE)
    motion.advance(frames, damping=3.0)
    motion.advance(20)
    assert np.abs(motion.read("velocity")).max() < 1e-4
    return force_of(indenter, motion.constants)


@pytest.mark.nightly
@pytest.mark.parametrize("spline", ["quadratic", "cubic"])
@pytest.mark.parametrize("nu", [0.0, 0.2])
def test_an_elastic_block_is_squeezed(nu, spline, compare):
    """F / width = E / (1 - nu^2) times the strain within 1 %: by F_E, and by how much nearer two layers have come.

    The way of the disc is no measure of the strain: the few cells at the contact are softer than the rest, and take
    a tenth of a cell and more of it.
    """
    motion = block(material__nu=nu, solver__spline=spline)
    start, top = motion.read("position")[:, 1], LOW + TALL
    layers = [np.abs(start - y) < 0.3 for y in (LOW + 12.0, LOW + 28.0)]
    press(motion, top + 2.0, 2.6, 0.5)
    stress = hold(motion, top - 0.6, 500) / WIDE
    low, high = (motion.read("position")[layer, 1].mean() for layer in layers)
    shortened = 1.0 - (high - low) / (start[layers[1]].mean() - start[layers[0]].mean())
    middle = (start > LOW + 12.0) & (start < LOW + 28.0)
    by_strain = 1.0 - motion.read("F_E")[middle, 1, 1].mean()
    assert shortened > 0.01
    for how, strain in (("by F_E", by_strain), ("by two layers", shortened)):
        modulus = 1.4e5 / (1 - nu**2)
        compare(f"squeezed block, nu = {nu}, {spline}: E / (1 - nu^2) {how}", stress / strain, modulus, rel=0.01)


@pytest.mark.nightly
def test_a_yielding_block_is_squeezed(compare):
    """Ideally plastic, nu = 0: J times the Cauchy stress is E theta_c (1 - theta_c) in every section.

    Slowly, as plastic waves are slow: their speed is about sqrt(E theta_c / rho), 4 cells/s, and a disc at 0.2 cells/s
    finds the block 5 % off balance.  The mean over ten stretches of the way, as the force vibrates.
    """
    motion = block(material__nu=0.0, material__theta_c=0.01, material__theta_s=0.005)
    bottom = LOW + TALL - 2.0
    press(motion, LOW + TALL + 1.0, 3.0, 0.05)
    ratios = []
    for _ in range(10):
        force = np.mean(press(motion, bottom, 0.1, 0.05))
        bottom -= 0.1
        y, J = motion.read("position")[:, 1], np.linalg.det(motion.read("F_E")) * motion.read("J_P")
        middle = np.abs(y - (VICE + bottom) / 2) < 10.0
        ratios.append(force / (1.4e5 * 0.01 * 0.99 * WIDE * float((1.0 / J[middle]).mean())))
    assert J[middle].max() < 0.97  # it yields everywhere
    compare("yielding block: force over E theta_c (1 - theta_c) width / J", np.mean(ratios), 1, rel=0.02)


@pytest.mark.parametrize("radius", [FLAT, 8.0])
def test_what_moves_together_feels_no_force(radius, compare):
    """Galilei: disc and snow, overlapping, at one velocity: no force, no strain, and the snow keeps its velocity."""
    motion = block(radius)
    n = len(motion.read("mass"))
    motion.set_velocity(np.tile([0.0, -0.7], (n, 1)), np.zeros((n, 2, 2)))
    forces = []
    for frame in range(50):
        bottom = LOW + TALL - 1.0 - 0.7 * 0.02 * frame
        motion.nodes.indenter.set((LEFT + WIDE / 2, bottom + radius), 0.7, OPEN)
        motion.advance()
        forces.append(force_of(motion.nodes.indenter, motion.constants))
    yielding = 1.4e5 * 0.01 * WIDE
    compare(f"together, radius {radius:g}: force over the yield force", max(map(abs, forces)) / yielding, 0, abs=1e-6)
    np.testing.assert_allclose(motion.read("velocity"), np.tile([0.0, -0.7], (n, 1)), atol=1e-9)
    assert np.abs(motion.read("F_E") - np.eye(2)).max() < 1e-9


def test_what_the_disc_gives_the_snow_gets(compare):
    """A disc that meets a body in open space: its impulse is the body's momentum, and sets it in motion."""
    case = compose([*ELASTIC, "indenter=disc", "indenter.radius=6"]).case
    places = disc(8.0)
    motion = Motion(case, in_space(case, np.vstack([places, [60.0, 60.0]]), 0.25), frame_time=0.02)
    centre, top = places[:, 0].mean(), places[:, 1].max()
    impulse = 0.0
    for frame in range(60):
        motion.nodes.indenter.set((centre + 2.0, top + 8.0 - 3.0 * 0.02 * frame), 3.0, OPEN)
        motion.advance()
        impulse -= 0.02 * force_of(motion.nodes.indenter, motion.constants)
    momentum = float(motion.read("mass") @ motion.read("velocity")[:, 1])
    assert momentum < -0.1 * 3.0 * motion.read("mass").sum()
    compare("disc meets body: impulse over the momentum gained", impulse / momentum, 1, rel=1e-10)
    assert motion.read("velocity")[:, 0].mean() < -0.1  # pushed aside, as it is not met in the middle


def test_a_disc_that_goes_away_takes_nothing_along():
    """Contact parts: an overlapping disc that moves up leaves the snow at rest."""
    motion = block(8.0)
    motion.nodes.indenter.set((LEFT + WIDE / 2, LOW + TALL - 1.0 + 8.0), -0.5, OPEN)
    motion.advance(5)
    assert np.abs(motion.read("velocity")).max() < 1e-12


@pytest.mark.nightly
def test_the_force_is_that_of_a_section(compare):
    """Pressed, sintered snow under the disc: the force is the stress through a section above the vice, within 2 %.

    The section is a slab of two grid spacings; the sum of V tau_yy over its height is the force, here the mean over
    the second half of the test.
    """
    config = compose(["fidelity=preview", "pressure=3300", "indenter=disc", "indenter.speed=0.4"])
    carried = []

    def look(progress):
        if progress.frame > config.case.frames - 600 and progress.frame % 5 == 0:
            state = progress.checkpoint()
            low = state["test_place"][2] + 3.0
            slab = (state["position"][:, 1] > low) & (state["position"][:, 1] < low + 4.0)
            carried.append(-(state["volume"] * state["tau"][:, 1, 1])[slab].sum() / 4.0)

    run = simulate(config, look)
    force = float(run.indenter_force[-600:].mean())
    compare("indented: stress through a section over the force on the disc", np.mean(carried) / force, 1, rel=0.02)


@pytest.mark.nightly
@pytest.mark.parametrize(("pressure", "sintering"), [(340, "paper"), (340, "none"), (3300, "paper")])
def test_half_the_speed_gives_the_same_force(pressure, sintering, compare):
    """The force is that of a slow test, but for creep: hardness at half the speed is the same within 5 %.

    From one pressure to the next in experiments/hardness.yaml it changes by several times that.  It falls by as much
    again with each further halving, so it is no inertia, and changes less on the paper's grid.
    """
    common = ["fidelity=preview", "indenter=disc", f"pressure={pressure}", f"sintering={sintering}"]
    full, half = (measure_test(simulate(compose([*common, *more]))) for more in ([], ["indenter.speed=0.1"]))
    compare(f"half the speed, {pressure}, {sintering}: hardness", half["hardness"] / full["hardness"], 1, rel=0.05)


def test_the_books_close(compare):
    """A whole run with disc and vice: momentum has a cause in every frame to round-off, and so has the disc's work."""
    run = simulate(compose(QUICK))
    scale = float(abs(run.indenter_force).max()) * 0.02
    for axis in "xy":
        rest = float(abs(run[f"unclosed_momentum_{axis}"]).max()) / scale
        compare(f"indented: momentum {axis} without a cause, of the disc's largest impulse", rest, 0, abs=1e-12)
    depth, force = read_curve(run)
    assert depth[0] == pytest.approx(-4.0 + 0.04) and depth[-1] == pytest.approx(3.0, abs=0.04)
    work = float((force * 4.0 * 0.02).sum())
    given = float(run.floor_work[31:].sum())
    compare("indented: work of walls over force times way", given / work, 1, rel=0.05)
