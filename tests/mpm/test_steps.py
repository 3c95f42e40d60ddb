"""The nine steps: conservation in the transfer, the NumPy twin, small shear, time step, failures."""

import numpy as np
import pytest

from snowrepro.compiler import ti
from snowrepro.composition.compose import compose
from snowrepro.errors import Diverged
from snowrepro.mpm import serial, solver, steps, transfer
from snowrepro.mpm.cases import LANES, Cases
from snowrepro.mpm.constants import Constants, make_constants
from snowrepro.mpm.frame import check_outcome, read_outcomes
from snowrepro.mpm.state import Ledger, Nodes, Particles
from tests import twin

SIZE = (40, 36)
WHOLE = [0, *SIZE]  # all nodes are of one case
SPLINES = ("quadratic", "cubic")


def constants(spline: str, dx: float = 1.0, **changes) -> Constants:
    case = compose([f"solver.spline={spline}"]).case
    return Constants(**vars(make_constants(case)) | {"dx": dx, **changes})


def cloud(count: int, dx: float, seed: int = 0) -> dict[str, np.ndarray]:
    """Random particles in mid-grid with random motion and small random strain."""
    rng = np.random.default_rng(seed)
    return {
        "position": (rng.uniform(12, 22, (count, 2))) * dx,
        "velocity": rng.normal(0, 1, (count, 2)),
        "affine": rng.normal(0, 0.02, (count, 2, 2)) * dx,
        "F_E": np.eye(2) + rng.normal(0, 0.02, (count, 2, 2)),
        "J_P": rng.uniform(0.7, 1.1, count),
        "hardening": rng.uniform(0, 10, count),
        "factor": np.ones(count),
        "mass": rng.uniform(20, 30, count) * dx**2,
        "volume": rng.uniform(0.2, 0.3, count) * dx**2,
        "mu": rng.uniform(2e4, 6e4, count),
        "lam": rng.uniform(2e4, 4e4, count),
        "force": rng.normal(0, 0.5, (count, 2)),
        "density": np.full(count, 100.0),
        "young": np.full(count, 1.4e5),
        "poisson": np.full(count, 0.2),
    }


def place(state: dict[str, np.ndarray], far: float = 100.0, lanes: int = LANES) -> tuple[Particles, Nodes, Ledger]:
    """The state on a grid without a floor in reach."""
    particles = Particles(len(state["mass"]), lanes=lanes)
    for name, values in state.items():
        particles.write(name, values)
    nodes = Nodes(np.full(SIZE, far), np.tile([0.0, 1.0], (*SIZE, 1)))
    return particles, nodes, Ledger(Cases([particles.count], [SIZE]))


@ti.kernel
def scatter(particles: ti.template(), nodes: ti.template(), numbers: ti.template(), dt: ti.f64):
    ti.loop_config(serialize=True)
    for group in range(particles.lane_groups):
        transfer.group_to_grid(group, particles.count, ti.Vector(WHOLE), particles, nodes, numbers, dt)


@ti.kernel
def gather(particles: ti.template(), nodes: ti.template(), numbers: ti.template()):
    ti.loop_config(serialize=True)
    for group in range(particles.lane_groups):
        x, y = transfer.make_axis(particles, numbers), transfer.make_axis(particles, numbers)
        transfer.find_axis(group, 0, x, particles, numbers)
        transfer.find_axis(group, 1, y, particles, numbers)
        start = group * particles.lanes
        for k in range(ti.min(particles.lanes, particles.count - start)):
            p = start + k
            velocity, gradient, affine = transfer.grid_to_particle(
                p, k, x, y, ti.Vector(WHOLE), particles, nodes, numbers, 0.0
            )
            particles.velocity[p] = velocity
            particles.tau[p] = gradient
            particles.affine[p] = affine


@pytest.mark.parametrize("spline", SPLINES)
def test_transfer_conserves_mass_and_momentum(taichi, spline):
    """Grid totals equal particle totals to round-off, angular momentum with APIC's share included."""
    state = cloud(300, dx=0.5)
    state["force"] *= 0
    particles, nodes, _ = place(state)
    numbers = constants(spline, dx=0.5)
    scatter(particles, nodes, numbers, 0.0)
    mass, momentum = nodes.mass.to_numpy(), nodes.sums.to_numpy()[..., :2]
    m, v, x, B = (state[name] for name in ("mass", "velocity", "position", "affine"))
    assert mass.sum() == pytest.approx(m.sum(), rel=1e-13)
    np.testing.assert_allclose(momentum.sum(axis=(0, 1)), m @ v, rtol=0, atol=1e-12 * m.sum())
    where = np.stack(np.meshgrid(*(np.arange(n) * 0.5 for n in SIZE), indexing="ij"), axis=-1)
    on_grid = (where[..., 0] * momentum[..., 1] - where[..., 1] * momentum[..., 0]).sum()
    of_particles = (m * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0] + B[:, 1, 0] - B[:, 0, 1])).sum()
    assert on_grid == pytest.approx(of_particles, abs=1e-11 * m.sum() * 20)


@pytest.mark.parametrize("spline", SPLINES)
def test_internal_force_adds_no_momentum(taichi, spline):
    """Stress alone moves momentum between nodes but makes none."""
    state = cloud(200, dx=1.0, seed=1)
    state["velocity"] *= 0
    state["affine"] *= 0
    state["force"] *= 0
    particles, nodes, _ = place(state)
    tau = np.random.default_rng(2).normal(0, 1e4, (200, 2, 2))
    particles.write("tau", tau + tau.transpose(0, 2, 1))
    scatter(particles, nodes, constants(spline), 1e-3)
    sums = nodes.sums.to_numpy()
    impulse = sums[..., 2:]
    assert not sums[..., :2].any()
    assert np.abs(impulse).max() > 1
    assert np.abs(impulse.sum(axis=(0, 1))).max() < 1e-11 * np.abs(impulse).sum()


@pytest.mark.parametrize("transfer", ["apic", "mls"])
@pytest.mark.parametrize("spline", SPLINES)
def test_lane_groups_give_the_bits_of_single_particles(taichi, spline, transfer):
    """Several groups, the last of them not full, against groups of one: on the nodes, and back."""
    given = []
    numbers = constants(spline, dx=0.5, transfer=transfer)
    for lanes in (LANES, 1):
        particles, nodes, _ = place(cloud(2 * LANES + 5, dx=0.5), lanes=lanes)
        particles.write("tau", np.random.default_rng(2).normal(0, 1e4, (particles.count, 2, 2)))
        nodes.velocity.from_numpy(np.random.default_rng(3).normal(0, 1, (*SIZE, 2)))
        scatter(particles, nodes, numbers, 1e-3)
        move(particles, nodes, numbers, 1e-3)
        moved = [particles.read(name) for name in ("position", "velocity", "affine", "F_E")]
        given.append((nodes.mass.to_numpy(), nodes.sums.to_numpy(), *moved))
    assert given[0][0].any()
    for one, other in zip(*given, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("spline", SPLINES)
def test_linear_velocity_fields_come_back_exactly(taichi, spline):
    """A node velocity a + G x gives each particle that velocity, the gradient G, and B = D G."""
    particles, nodes, _ = place(cloud(50, dx=0.5))
    G, a = np.array([[0.3, -1.2], [0.7, 0.4]]), np.array([2.0, -1.0])
    where = np.stack(np.meshgrid(*(np.arange(n) * 0.5 for n in SIZE), indexing="ij"), axis=-1)
    nodes.velocity.from_numpy(a + where @ G.T)
    numbers = constants(spline, dx=0.5)
    gather(particles, nodes, numbers)
    np.testing.assert_allclose(particles.read("velocity"), a + particles.read("position") @ G.T, atol=1e-12)
    np.testing.assert_allclose(particles.read("tau"), np.tile(G, (50, 1, 1)), atol=1e-12)
    inertia = numbers.inertia * 0.25
    np.testing.assert_allclose(particles.read("affine"), np.tile(G * inertia, (50, 1, 1)), atol=1e-12)


@pytest.mark.parametrize("transfer", ["apic", "mls", "pic_flip"])
@pytest.mark.parametrize("spline", SPLINES)
def test_one_substep_equals_the_twin(taichi, spline, transfer):
    """Steps 1 to 9 with plastic flow, hardening, external force and gravity, against NumPy."""
    dt = 2e-4
    state = cloud(60, dx=1.0, seed=3)
    if transfer == "pic_flip":
        state["affine"] *= 0
    expected = twin.substep(state, SIZE, 1.0, spline, dt, 10.0, transfer)
    particles, nodes, ledger = place(state)
    serial.advance_frame(
        particles, nodes, ledger, constants(spline, frame_time=dt, cfl=1.0, transfer=transfer), 10.0, 0.0, 0
    )
    assert ledger.substeps[0] == 1
    assert ledger.status[0] == 0
    for name in ("position", "velocity", "affine"):
        np.testing.assert_allclose(particles.read(name), expected[name], rtol=1e-9, atol=1e-10)
    for p in range(60):  # the frame ends with one more return mapping
        F_E, J_P = twin.clamp_plastic(expected["F_E"][p], expected["J_P"][p], 0.99, 1.005)
        np.testing.assert_allclose(particles.read("F_E")[p], F_E, atol=1e-10)
        assert particles.read("J_P")[p] == pytest.approx(J_P, rel=1e-9)


def test_sintering_update_equals_the_twin(taichi):
    """Between steps 3 and 4: Eqs. 2 to 9 from the stress of the moment, once a frame."""
    state = cloud(40, dx=1.0, seed=4)
    numbers = constants("cubic", frame_time=1e-4, cfl=1.0)
    particles, nodes, ledger = place(state)
    serial.advance_frame(particles, nodes, ledger, numbers, 0.0, 0.0, 1)
    for p in range(40):
        F_E, J_P = twin.clamp_plastic(state["F_E"][p], state["J_P"][p], 0.99, 1.005)
        h = twin.hardening_factor(state["hardening"][p], J_P, -16.118, 5)
        sigma_m = twin.von_mises(F_E, J_P, h * state["mu"][p], h * state["lam"][p])
        b = np.linalg.norm(state["force"][p])
        rho_r = 100 / 700
        rho = 100 + 1e-4 * 100 * (5e-7 * sigma_m / rho_r + 1e-3 * b)
        assert particles.read("density")[p] == pytest.approx(rho, rel=1e-13)
        assert particles.read("hardening")[p] == pytest.approx(
            state["hardening"][p] + 1e-3 * sigma_m + 1e-3 * b, rel=1e-9
        )
        assert particles.read("young")[p] == pytest.approx(1.4e5, rel=1e-12)  # E^{n+1} follows rho^n


def test_pure_shear_in_tiny_steps_is_not_lost(taichi):
    """400 increments of 9e-6 add up to a shear of 3.6e-3 (ti.svd would leave 0)."""
    state = cloud(8, dx=1.0)
    state["F_E"] = np.tile(np.eye(2), (8, 1, 1))
    state["J_P"] = np.ones(8)
    particles, _, _ = place(state)
    numbers = constants("cubic")
    increment = np.array([[1.0, 9e-6], [0.0, 1.0]])
    for _ in range(400):
        particles.write("F_E", increment @ particles.read("F_E"))
        stress_only(particles, numbers)
    np.testing.assert_allclose(particles.read("F_E"), np.tile([[1.0, 3.6e-3], [0.0, 1.0]], (8, 1, 1)), atol=1e-15)
    tau = particles.read("tau")[:, 0, 1] / particles.read("mu")
    np.testing.assert_allclose(tau / np.exp(0), 3.6e-3, rtol=1e-3)


@ti.kernel
def stress_only(particles: ti.template(), numbers: ti.template()):
    ti.loop_config(serialize=True)
    for group in range(particles.lane_groups):
        steps.update_stress(group, True, particles, numbers)


@ti.kernel
def stress_of_what_flowed(particles: ti.template(), numbers: ti.template()):
    ti.loop_config(serialize=True)
    for group in range(particles.lane_groups):
        steps.update_stress(group, False, particles, numbers)


def test_groups_that_did_not_flow_keep_their_hardening_to_the_bit(taichi):
    """Of three groups one is stretched beyond the clamps, one a little and one not: the same as all done whole."""
    numbers = constants("cubic")
    stretch = np.repeat([1.1, 1.001, 1.0], LANES)[:, None, None]
    given = []
    for kernel in (stress_only, stress_of_what_flowed):
        particles, _, _ = place(cloud(3 * LANES, dx=1.0) | {"F_E": np.tile(np.eye(2), (3 * LANES, 1, 1))})
        stress_only(particles, numbers)
        before = particles.read("factor")
        particles.write("F_E", stretch * particles.read("F_E"))
        kernel(particles, numbers)
        given.append([particles.read(quantity.name) for quantity in particles.quantities])
    assert (particles.read("factor") != before).tolist() == [True] * LANES + [False] * 2 * LANES
    for whole, partial in zip(*given, strict=True):
        np.testing.assert_array_equal(whole, partial)


def test_time_step_follows_hardened_stiffness(taichi):
    """A hundred times the stiffness takes a tenth of the step, whether by E or by hardening."""
    taken = []
    for stiffness, exponent in ((1.0, 0.0), (100.0, 0.0), (1.0, np.log(100.0))):
        state = cloud(30, dx=1.0)
        state["velocity"] *= 0
        state["affine"] *= 0
        state["F_E"] = np.tile(np.eye(2), (30, 1, 1))
        state["volume"], state["mass"] = np.full(30, 0.25), np.full(30, 25.0)
        state["mu"], state["lam"] = np.full(30, 5e4 * stiffness), np.full(30, 4e4 * stiffness)
        state["hardening"], state["J_P"] = np.full(30, exponent / 0.5), np.full(30, 0.5)
        particles, nodes, ledger = place(state)
        serial.advance_frame(particles, nodes, ledger, constants("cubic", frame_time=0.02), 0.0, 0.0, 0)
        taken.append(ledger.smallest_step[0])
    assert taken[0] <= 0.4 / np.sqrt(1.4e5 / 100)
    assert taken[0] / taken[1] == pytest.approx(10, rel=0.35)  # frames hold whole numbers of steps
    assert taken[2] == pytest.approx(taken[1], rel=0.05)


def test_volume_from_the_grid(taichi, small_config):
    """Step 2: inside the body the grid's density is the sampled one; at the edge it is lower."""
    from snowrepro.scene.build import build_scene

    case = small_config.case
    scene = build_scene(case)
    particles, _, _ = solver.allocate(case, scene, make_constants(case))
    density = particles.read("mass") / particles.read("volume")
    assert np.median(density[scene.depth > 6]) == pytest.approx(100, rel=0.01)
    assert density[scene.depth < 1].mean() < 85


@pytest.mark.parametrize(("name", "value"), [("velocity", np.nan), ("velocity", 1e12), ("position", 1e9)])
def test_what_stops_being_finite_is_a_failure(taichi, small_config, name, value):
    """A particle that is not a number, or off the grid, ends the run with its number, frame and time."""
    from snowrepro.scene.build import build_scene

    case = small_config.case
    numbers = make_constants(case)
    particles, nodes, ledger = solver.allocate(case, build_scene(case), numbers)
    values = particles.read(name)
    values[7, 0] = value
    particles.write(name, values)
    with pytest.raises(Diverged, match=r"diverged in frame 3 at t = .*(particle \d+|time step fell)"):
        for _ in range(3):
            serial.advance_frame(particles, nodes, ledger, numbers, 0.0, 0.0, 0)
            check_outcome(read_outcomes(ledger)[0], particles.read, numbers, 3)


@ti.kernel
def move(particles: ti.template(), nodes: ti.template(), numbers: ti.template(), dt: ti.f64):
    ti.loop_config(serialize=True)
    for group in range(particles.lane_groups):
        steps.step_6_to_9_group(group, particles.count, ti.Vector(WHOLE), particles, nodes, numbers, dt, 10.0)


def test_what_the_floor_does_to_a_particle_is_booked(taichi):
    """Step 8 on a particle in the surface: Coulomb friction, its work and impulse; the one above feels nothing."""
    state = cloud(2, dx=1.0)
    state["position"] = np.array([[15.2, 14.0], [15.2, 17.0]])
    particles, nodes, _ = place(state)
    nodes.distance.from_numpy(np.tile(np.arange(SIZE[1]) - 14.0, (SIZE[0], 1)))
    nodes.velocity.from_numpy(np.tile([3.0, -2.0], (*SIZE, 1)))
    move(particles, nodes, constants("cubic", friction=0.25), 1e-3)
    mass = state["mass"]
    np.testing.assert_allclose(particles.read("velocity"), [[2.5, 0.0], [3.0, -2.0]], atol=1e-12)
    np.testing.assert_allclose(particles.read("sliding_work"), [0.5 * mass[0] * (2.5**2 - 13.0), 0], atol=1e-10)
    np.testing.assert_allclose(particles.read("sliding_impulse"), [[-0.5 * mass[0], 2.0 * mass[0]], [0, 0]], atol=1e-10)


def test_a_particle_that_is_moved_out_gains_height(taichi):
    """Half a spacing inside the floor, at rest: it comes to the surface, and the ledger books m g h."""
    state = cloud(1, dx=1.0)
    state["position"] = np.array([[15.2, 13.5]])
    particles, nodes, _ = place(state)
    nodes.distance.from_numpy(np.tile(np.arange(SIZE[1]) - 14.0, (SIZE[0], 1)))
    move(particles, nodes, constants("cubic"), 1e-3)
    assert particles.read("position")[0, 1] == pytest.approx(14.0)
    assert particles.read("lifting_work")[0] == pytest.approx(state["mass"][0] * 10.0 * 0.5)
