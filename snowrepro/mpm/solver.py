"""Drive the kernels frame by frame: pressing stage, release, falling stage (Sec. 4.1)."""

import contextlib
import io
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from ..compiler import name_compiler, ti
from ..errors import ConfigError
from ..scene.build import Scene
from ..scene.press import SHELL_CELLS, external_force
from ..settings.case import Case, Solver
from . import accounts, parallel, serial, state
from .cases import LANES, Cases
from .constants import Constants, make_constants
from .frame import Frame, Indentation, check_frame, read_outcomes
from .home import leave_settings_out
from .indenter import Indenter, Place, depth_at, find_place, force_of, start_frame
from .taichi_private import leave_lines_unwrapped, round_each


class Orders(NamedTuple):
    """What acts in a frame of a case: gravity [length/s^2], damping [1/s], and whether it sinters."""

    gravity: float
    damping: float
    sinters: bool


def make_orders(case: Case, number: int) -> Orders:
    """What acts in a frame of a case."""
    sinters = case.sintering.enabled and number <= case.loading.press_frames
    return Orders(case.gravity_in(number), case.damping_in(number), sinters)


def start_taichi(solver: Solver, threads: int) -> None:
    """Start Taichi afresh in the run's precision, so that bits repeat: without fast math, on a GPU as on the CPU.

    Or Quadrants in its place, see ``compiler``.  Raises ConfigError if the device is not there, or was not checked.
    """
    if solver.device == "cuda" and name_compiler() != "taichi":
        raise ConfigError(f"solver.device=cuda needs taichi: what {name_compiler()} gives on a GPU was not checked")
    arch = ti.cuda if solver.device == "cuda" else ti.cpu
    real = ti.f32 if solver.precision == "f32" else ti.f64
    leave_lines_unwrapped()
    round_each(solver.device == "cuda")
    leave_settings_out()  # those that were set since this program was loaded
    with contextlib.redirect_stdout(io.StringIO()):  # it announces itself
        ti.init(arch=arch, default_fp=real, default_ip=ti.i32, fast_math=False, cpu_max_num_threads=threads)
    if solver.device == "cuda" and ti.lang.impl.current_cfg().arch != ti.cuda:  # it falls back to the CPU
        raise ConfigError("solver.device=cuda: Taichi finds no CUDA device here; solver.device=cpu runs everywhere")


def advance_frame(
    particles: state.Particles,
    nodes: state.Nodes,
    ledger: state.Ledger,
    constants: Constants,
    gravity: float,
    damping: float,
    sinters: bool,
) -> None:
    """Advance one frame with the driver that the summation asks for; see ``serial.advance_frame``."""
    if constants.summation == "in_order":
        serial.advance_frame(particles, nodes, ledger, constants, gravity, damping, int(sinters))
        accounts.fill_totals(particles, nodes, ledger, constants)
    else:
        parallel.advance_frame(particles, nodes, ledger, constants, gravity, damping, int(sinters))


def frames(
    case: Case, scene: Scene, resume: Mapping[str, np.ndarray] | None = None, threads: int = 1
) -> Iterator[Frame]:
    """Yield frame 0 (the start) and then each frame to the last.

    With ``resume``, a frame's checkpoint, yield the frames behind it: the same bits as without a stop.
    Raises Diverged with cause, particle, frame and time when the run stops being a simulation.
    """
    start_taichi(case.solver, threads)
    constants = make_constants(case)
    particles, nodes, ledger = allocate(case, scene, constants)

    first, place = 1, None
    if resume is None:
        yield Frame(0, read_outcomes(ledger)[0], particles, _test_at(0, case, nodes, constants, place))
    else:
        particles.write_all(resume)
        ledger.top_speed2[0] = float(resume["top_speed2"])
        first = int(resume["frame"]) + 1
        place = Place(*resume["test_place"].tolist()) if "test_place" in resume else None
    for number in range(first, case.frames + 1):
        if is_release(case, number):
            for name in find_released(case):
                particles.write(name, np.zeros((particles.count, *state.SHAPES[name])))
        if is_pressed(case, number):
            particles.write("force", make_pressing_force(case, scene, particles.read("position"), number))
        if nodes.indenter and case.is_tested(number):
            place = place or find_place(case, particles.read("position"))
            start_frame(nodes.indenter, case, place, number)
        advance_frame(particles, nodes, ledger, constants, *make_orders(case, number))
        outcome = read_outcomes(ledger)[0]
        check_frame(outcome, particles.read, case, constants, number)
        yield Frame(number, outcome, particles, _test_at(number, case, nodes, constants, place))


def _test_at(
    number: int, case: Case, nodes: state.Nodes, constants: Constants, place: Place | None
) -> Indentation | None:
    """What the indenter shows at the end of a frame."""
    if nodes.indenter is None:
        return None
    return Indentation(place, depth_at(case, number), force_of(nodes.indenter, constants))


def allocate(case: Case, scene: Scene, constants: Constants) -> tuple[state.Particles, state.Nodes, state.Ledger]:
    """Particles and nodes of the scene at frame 0, undeformed and at rest."""
    in_order = constants.summation == "in_order"
    lanes = LANES if case.solver.device == "cpu" else 1
    particles = state.Particles(len(scene.positions), constants.material.STATE, lanes)
    particles.start(scene, case.material)
    nodes = state.Nodes(scene.node_distance, scene.node_normal, constants.summation == "fixed_point")
    ledger = state.Ledger(Cases([particles.count], [nodes.size]), by_threads=not in_order)
    if case.indenter:
        radius = case.indenter.radius * case.reading.cell
        nodes.indenter = Indenter(radius, nodes.size, particles.slots)
    if case.reading.initial_volume == "grid_density":
        find_volumes = serial.step_2_volume if in_order else parallel.find_volumes
        find_volumes(particles, nodes, ledger, constants)
    return particles, nodes, ledger


def is_release(case: Case, number: int) -> bool:
    """Whether pressing ends as a frame begins."""
    return number == case.loading.press_frames + 1


def find_released(case: Case) -> tuple[str, ...]:
    """What becomes zero at the release: the external force, and by some readings the motion that pressing left."""
    return ("force", "velocity", "affine") if case.reading.release == "rest" else ("force",)


def is_pressed(case: Case, number: int) -> bool:
    """Whether the external force acts in a frame."""
    return number <= case.loading.press_frames and (case.sintering.enabled or case.reading.unsintered == "pressed")


def make_pressing_force(case: Case, scene: Scene, positions: np.ndarray, frame: int) -> np.ndarray:
    """The external force b of one frame, as an acceleration (n, 2)."""
    ramp = case.reading.press_ramp
    share = min(1.0, frame / ramp) if ramp else 1.0
    return external_force(
        case.reading.press,
        positions,
        scene.depth,
        share * case.pressure,
        case.material.rho,
        scene.radius,
        SHELL_CELLS * case.reading.cell,
    )
