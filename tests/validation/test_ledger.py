"""The ledgers: every frame's change of energy and momentum has a cause, and what has none is bounded."""

import numpy as np
import pytest

from snowrepro.composition.compose import compose
from snowrepro.mpm import solver
from snowrepro.mpm.constants import Constants
from snowrepro.mpm.frame import read_outcomes
from snowrepro.mpm.ledger import WORKS
from snowrepro.run import simulate
from tests import twin
from tests.conftest import SMALL
from tests.validation.motion import ELASTIC, Motion, in_space, over_floor
from tests.validation.test_elastic import disc

HIGH = ["reading.drop_height=30", "loading.frames=40"]


def turnover(run, first: int, last: int) -> float:
    """Energy that went through the ledger's causes in the frames after ``first`` up to ``last``."""
    return float(sum(abs(run[name][first + 1 : last + 1]).sum() for name in WORKS))


def unclosed(run, first: int, last: int) -> float:
    return float(abs(run.unclosed_energy[first + 1 : last + 1]).sum())


def test_every_frame_of_a_run_closes(small_run, compare):
    """Pressed, falling, breaking on the floor: momentum to round-off, energy but for the stepping in time."""
    scale = float(abs(small_run.momentum_y).max())
    for axis in "xy":
        rest = float(abs(small_run[f"unclosed_momentum_{axis}"]).max()) / scale
        compare(f"ledger: momentum {axis} without a cause, of the largest", rest, 0, abs=1e-13)
    pressed, fallen = (0, 20), (20, 60)
    compare(
        "ledger: energy without a cause, pressed",
        unclosed(small_run, *pressed) / turnover(small_run, *pressed),
        0,
        abs=0.06,
    )
    compare(
        "ledger: energy without a cause, fallen",
        unclosed(small_run, *fallen) / turnover(small_run, *fallen),
        0,
        abs=0.02,
    )


def test_what_is_unclosed_has_the_same_bits_on_every_python(small_run):
    """Plain additions in order; sum() of Python 3.12 and later would compensate their rounding."""
    run = {name: small_run[name].values for name in ("kinetic_energy", "elastic_energy", *WORKS)}
    change = np.diff(run["kinetic_energy"]) + np.diff(run["elastic_energy"])
    explained = np.zeros_like(change)
    for name in WORKS:
        explained += run[name][1:]
    np.testing.assert_array_equal(small_run.unclosed_energy[1:], change - explained)


def test_each_cause_acts_when_it_should(small_run):
    """Pressing and sintering up to the release, gravity and the floor behind it; losses only ever lose."""
    up_to, behind = slice(2, 21), slice(21, 61)  # in frame 1 nothing is stressed yet
    for name in ("pressing_work", "sintering_work"):
        assert float(abs(small_run[name][up_to]).min()) > 0
        assert float(abs(small_run[name][behind]).max()) == 0
    for name in ("gravity_work", "floor_work"):
        assert float(abs(small_run[name][up_to]).max()) == 0
        assert float(abs(small_run[name][behind]).max()) > 0
    assert float(small_run.plastic_work.max()) <= 0
    assert float(small_run.transfer_work.max()) <= 1e-9 * turnover(small_run, 0, 60)
    assert float(small_run.floor_work.min()) < 0
    assert float(abs(small_run.damping_work).max()) == 0


@pytest.mark.slow
def test_what_does_not_close_is_the_step_in_time(compare):
    """A pressed elastic body: half the time step, half the rest."""
    rests = []
    for cfl in (0.2, 0.1, 0.05):
        run = simulate(compose([*SMALL, *ELASTIC, "pressure=300", "loading.frames=20", f"solver.cfl={cfl}"]))
        rests.append(unclosed(run, 0, 20) / turnover(run, 0, 20))
    compare("ledger: order of the rest in the time step", np.log2(rests[0] / rests[2]) / 2, 1, abs=0.2)
    assert rests[2] < 0.02


def test_free_fall_turns_potential_into_kinetic_energy():
    """Nothing else acts on a body at rest in itself, well above the floor."""
    run = simulate(compose([*SMALL, "sintering=none", "reading.unsintered=not_pressed", *HIGH]))
    fallen = float(run.gravity_work.sum())
    steps = run.substeps.values[21:]
    early = 0.5 * float(run.total_mass[0]) * 40.0**2 * (0.02**2 / steps).sum()  # gravity's speed comes a step early
    rest = fallen - float(run.kinetic_energy[40])
    assert rest == pytest.approx(early, rel=1e-9)
    assert float(run.unclosed_energy.sum()) == pytest.approx(-rest, rel=1e-6)
    others = [name for name in WORKS if name != "gravity_work"]
    assert sum(float(abs(run[name]).sum()) for name in others) < 1e-9 * fallen


def test_sintering_puts_in_what_the_moduli_gain():
    """A body under strain whose stiffness grows in place: the ledger books the growth and nothing else."""
    case = compose([*ELASTIC, "sintering=paper", "material.xi=5"]).case
    places = disc(6.0)
    solver.start_taichi(case.solver, threads=1)
    constants = Constants(**vars(solver.make_constants(case)) | {"frame_time": 1e-9})
    particles, nodes, ledger = solver.allocate(case, in_space(case, places, 0.25), constants)
    particles.write("F_E", np.tile(np.diag([0.99, 1.002]), (len(places), 1, 1)))
    particles.write("J_P", np.full(len(places), 0.9))
    particles.write("density", np.full(len(places), 150.0))  # whose modulus Eq. 7 has yet to give
    accounts = []
    for sinters in (False, True):
        solver.advance_frame(particles, nodes, ledger, constants, 0.0, 0.0, sinters)
        accounts.append(read_outcomes(ledger)[0].totals)
    before, after = accounts
    gained = after["elastic_energy"] - before["elastic_energy"]
    assert gained > 0.5 * before["elastic_energy"]
    assert after["sintering_work"] == pytest.approx(gained, rel=1e-5)
    assert abs(after["plastic_work"]) + abs(after["hardening_work"]) < 1e-9 * gained


def test_stopping_at_release_is_booked():
    """release=rest takes the kinetic energy, and the ledger says what took it."""
    run = simulate(compose([*SMALL, "pressure=3000", "reading.release=rest", "reading.gravity=0", "loading.frames=24"]))
    assert float(run.damping_work[21]) == pytest.approx(-float(run.kinetic_energy[20]))
    assert abs(float(run.unclosed_energy[21])) < 0.1 * float(run.kinetic_energy[20] + run.elastic_energy[20])
    assert abs(float(run.unclosed_momentum_x[21])) < 1e-9 * float(run.total_mass[0])


def test_energies_are_those_of_the_twin():
    """Kinetic energy with the affine motion's share, and elastic energy with hardened moduli, by another way."""
    case = compose(["fidelity=preview"]).case
    rng = np.random.default_rng(5)
    places = disc(6.0, dx=2.0)
    n = len(places)
    solver.start_taichi(case.solver, threads=1)
    constants = Constants(**vars(solver.make_constants(case)) | {"frame_time": 1e-12})
    particles, nodes, ledger = solver.allocate(case, in_space(case, places * 2, 1.0), constants)
    particles.write("F_E", np.eye(2) + rng.normal(0, 1e-3, (n, 2, 2)))
    particles.write("J_P", rng.uniform(0.7, 1.1, n))
    particles.write("velocity", rng.normal(0, 1, (n, 2)))
    solver.advance_frame(particles, nodes, ledger, constants, 0.0, 0.0, False)
    totals = read_outcomes(ledger)[0].totals
    F, J_P, mu, lam, volume, v, B, mass = (
        particles.read(name) for name in ("F_E", "J_P", "mu", "lam", "volume", "velocity", "affine", "mass")
    )
    h = twin.hardening_factor(5.0, J_P, -16.118, 5)
    elastic = (twin.energy_density(F, h * mu, h * lam) * volume).sum()
    kinetic = 0.5 * (mass * ((v**2).sum(axis=1) + (B**2).sum(axis=(1, 2)) / (4.0 / 3.0))).sum()
    assert np.abs(B).max() > 0.01
    assert totals["elastic_energy"] == pytest.approx(elastic, rel=1e-10)
    assert totals["kinetic_energy"] == pytest.approx(kinetic, rel=1e-12)


def test_friction_takes_what_a_sliding_block_loses(compare):
    """Stiff snow on a flat floor with mu = 0.3: the floor's work is - mu m g times the way, and the speed's loss."""
    case = compose([*ELASTIC, "reading.contact=coulomb", "reading.friction=0.3", "material.E=1e7"]).case
    places = np.stack(np.meshgrid(np.arange(60.25, 84, 0.5), np.arange(12.55, 20, 0.5)), axis=-1).reshape(-1, 2)
    motion = Motion(case, over_floor(case, places, 0.25, 60.0))
    motion.advance(50, 10.0, damping=20.0)
    n = len(places)
    motion.set_velocity(np.tile([8.0, 0.0], (n, 1)), np.zeros((n, 2, 2)))
    start, first, floor = motion.kinetic_energy(), motion.mean("position")[0], 0.0
    for _ in range(60):
        motion.advance(gravity=10.0)
        totals = read_outcomes(motion.ledger)[0].totals
        floor += totals["contact_work"] + totals["sliding_work"]
    way = motion.mean("position")[0] - first
    weight = n * 0.25 * 100.0 * 10.0
    assert way > 4
    compare("sliding block: work of the floor over - mu m g times the way", floor / (-0.3 * weight * way), 1, rel=0.01)
    compare(
        "sliding block: work of the floor over the kinetic energy lost",
        floor / (motion.kinetic_energy() - start),
        1,
        rel=0.02,
    )
