"""The solver's choices: transfers conserve, precisions and ways of summing give the same run, or are refused."""

import numpy as np
import pytest

from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError, Diverged
from snowrepro.mpm import solver
from snowrepro.mpm.constants import make_constants
from snowrepro.mpm.frame import check_outcome, read_outcomes
from snowrepro.mpm.ledger import unclosed_share
from snowrepro.run import simulate
from snowrepro.scene.build import build_scene
from tests.conftest import SMALL
from tests.validation.test_restart import assert_same_bits

IMPACT = 48  # a frame in which the snow of SMALL is on the floor


def run(*overrides):
    return simulate(compose([*SMALL, "pressure=3000", *overrides]))


def furthest(one, other, frame):
    """Largest distance between the same particles of two runs [cells]."""
    apart = one.position.sel(snapshot=frame).values - other.position.sel(snapshot=frame).values
    return float(np.abs(apart).max())


@pytest.fixture(scope="module")
def fixed_point():
    """The small run by the parallel driver on one thread."""
    return run("solver.summation=fixed_point")


def test_fixed_point_gives_the_same_bits_at_any_number_of_threads(fixed_point):
    """Every array of the result, diagnostics too."""
    assert_same_bits(run("solver.summation=fixed_point", "threads=2"), fixed_point)


def test_the_parallel_driver_is_the_serial_one(small_run, fixed_point):
    """The same nine steps in another loop: apart only by what fixed point rounds."""
    assert fixed_point.substeps.equals(small_run.substeps)
    assert furthest(fixed_point, small_run, 20) < 1e-5
    assert furthest(fixed_point, small_run, IMPACT) < 1e-4
    assert float(abs(fixed_point.unclosed_momentum_y).max()) < 1e-10 * float(abs(small_run.momentum_y).max())


@pytest.mark.nightly
def test_springs_of_the_floor_are_summed_alike():
    """contact=penalty: the same bits on two threads, by the parallel driver what the serial one gives, books closed."""
    springs = ("reading.contact=penalty", "sintering=none")
    serial = run(*springs)
    one, two = (run(*springs, "solver.summation=fixed_point", f"threads={threads}") for threads in (1, 2))
    assert_same_bits(two, one)
    assert furthest(one, serial, IMPACT) < 1e-4
    scale = float(abs(serial.momentum_y).max())
    assert float(abs(serial.unclosed_momentum_y).max()) < 1e-12 * scale
    assert unclosed_share(serial) < 0.02


def test_atomic_sums_agree_and_cannot_be_called_deterministic(small_run):
    """Two threads in any order: the same to round-off; asked to repeat bits, it refuses and says what can."""
    atomic = run("solver.summation=atomic", "threads=2", "deterministic=false")
    assert furthest(atomic, small_run, IMPACT) < 1e-4
    with pytest.raises(ConfigError, match=r"deterministic=true cannot be had .*fixed_point"):
        compose(["solver.summation=atomic", "threads=2"])
    assert compose(["solver.summation=atomic"]).execution.deterministic  # one thread has one order


def test_single_precision_follows_double(small_run):
    """f32 stays within a thousandth of a cell to the release and a hundredth into the impact."""
    single = run("solver.precision=f32")
    assert 0 < furthest(single, small_run, 20) < 1e-3
    assert 0 < furthest(single, small_run, IMPACT) < 1e-2


@pytest.mark.parametrize("transfer", ["mls", "pic_flip"])
@pytest.mark.parametrize("spline", ["quadratic", "cubic"])
def test_each_transfer_conserves(transfer, spline):
    """Momentum has a cause in every frame, to round-off; energy but for the error of stepping in time."""
    other = run(f"solver.transfer={transfer}", f"solver.spline={spline}")
    scale = float(abs(other.momentum_y).max())
    assert float(abs(other.unclosed_momentum_x).max()) < 1e-13 * scale
    assert float(abs(other.unclosed_momentum_y).max()) < 1e-13 * scale
    assert unclosed_share(other.isel(frame=slice(21, None))) < 0.02
    assert float(other.J_P.min()) < 0.9  # it has hit the floor and yielded


def test_pic_loses_most_and_flip_least(small_run):
    """Kinetic energy lost in the transfer while the snow is pressed; APIC is between the two."""
    lost = {"apic": small_run}
    for name, flip in (("pic", 0.0), ("flip", 1.0)):
        lost[name] = run("solver.transfer=pic_flip", f"solver.flip={flip}", "loading.frames=21")
    pressed = {name: -float(result.transfer_work[1:21].sum()) for name, result in lost.items()}
    assert 0 < 2 * pressed["flip"] < pressed["apic"] < 0.1 * pressed["pic"]


def test_fixed_point_sums_hold_what_the_time_step_allows():
    """The fastest speed that max_substeps allows, of a thousand particles on one node, fits into 63 bits."""
    case = compose(["solver.summation=fixed_point"]).case
    constants = make_constants(case)
    fastest = constants.cfl * constants.dx * constants.max_substeps / constants.frame_time
    assert 1000 * build_scene(case).mass * fastest / constants.momentum_quantum < 2**62
    assert constants.momentum_quantum / build_scene(case).mass < 1e-9 * fastest


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["threads=2"], r"threads=2 needs solver.summation=fixed_point"),
        (["solver.device=cuda"], r"a GPU cannot sum in_order"),
        (["solver.transfer=picflip"], r"solver.transfer: should be 'apic', 'pic_flip' or 'mls'"),
        (["solver.pic_rate=5"], r"pic_rate is a choice of transfer=pic_flip, and transfer is apic"),
        (["solver.flip=1.5"], r"solver.flip: should be less than or equal to 1"),
        (["threads=0"], r"threads: should be greater than or equal to 1"),
    ],
)
def test_what_cannot_be_had_is_refused_before_any_work(overrides, message):
    with pytest.raises(ConfigError, match=message):
        compose(overrides)


def test_a_gpu_that_is_not_there_is_refused():
    """Taichi would go on with the CPU in silence."""
    config = compose([*SMALL, "solver.device=cuda", "solver.summation=fixed_point"])
    try:
        simulate(config)
    except ConfigError as error:
        assert "finds no CUDA device" in str(error)
    else:
        assert solver.ti.lang.impl.current_cfg().arch == solver.ti.cuda


@pytest.mark.parametrize(
    ("name", "value", "cause"),
    [
        ("position", 1e9, "left the grid"),
        ("F_E", -1.0, "has a strain that is inverted or not finite"),
        ("poisson", 0.5, "Poisson's ratio of 0.5, which must stay below"),
    ],
)
@pytest.mark.parametrize("summation", ["in_order", "fixed_point"])
def test_an_unsound_particle_ends_the_run_by_name(small_config, summation, name, value, cause):
    """The first of them is named, with its place and what is wrong, by either driver."""
    case = compose([*SMALL, f"solver.summation={summation}"]).case
    solver.start_taichi(case.solver, threads=1)
    constants = make_constants(case)
    particles, nodes, ledger = solver.allocate(case, build_scene(case), constants)
    values = particles.read(name)
    for p in (9, 7):
        values[p] = np.array([[value, 0], [0, 1]]) if name == "F_E" else value
    particles.write(name, values)
    with pytest.raises(Diverged, match=rf"diverged in frame 3 at t = .* particle 7 at .*({cause})"):
        for _ in range(3):
            solver.advance_frame(particles, nodes, ledger, constants, 0.0, 0.0, False)
            check_outcome(read_outcomes(ledger)[0], particles.read, constants, 3)
