"""Drive the kernels frame by frame: pressing stage, release, falling stage (Sec. 4.1)."""

import contextlib
import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import taichi as ti

from ..errors import ConfigError, Diverged
from ..scene.build import Scene
from ..scene.press import SHELL_CELLS, external_force
from ..settings.case import Case, Solver
from . import accounts, parallel, serial, state
from .constants import Constants, make_constants
from .home import leave_settings_out
from .indenter import Indenter, Place, depth_at, find_place, force_of, start_frame
from .ledger import TOTALS
from .taichi_private import leave_lines_unwrapped


@dataclass(frozen=True)
class Frame:
    """The run at the end of one frame; ``read`` gives a copy of a particle quantity by name.

    ``totals``: of TOTALS, what the frame's energy and momentum come to.  ``test``: of the indenter, if there is one.
    """

    number: int
    substeps: int
    smallest_step: float
    ended_inside: int
    top_speed2: float
    totals: dict[str, float]
    particles: state.Particles
    test: "Indentation | None" = None

    def read(self, name: str) -> np.ndarray:
        """A copy of one quantity of the particles, shape (n, *shape)."""
        return self.particles.read(name)

    def checkpoint(self) -> dict[str, np.ndarray]:
        """All that the next frames depend on, for ``frames`` to go on from."""
        whole = {quantity.name: self.read(quantity.name) for quantity in self.particles.quantities}
        place = self.test.place if self.test else None
        test = {"test_place": np.array([place.x, place.touch, place.vice])} if place else {}
        return {**whole, **test, "frame": np.array(self.number), "top_speed2": np.array(self.top_speed2)}


@dataclass(frozen=True)
class Indentation:
    """The indenter at the end of a frame: its place (none yet), depth below first touch, and the upward force on it."""

    place: Place | None
    depth: float
    force: float


def frame_of(number: int, particles: state.Particles, ledger: state.Ledger, test: Indentation | None = None) -> Frame:
    """The frame that the kernel has just ended, or frame 0 before the first."""
    return Frame(
        number,
        ledger.substeps[None],
        ledger.smallest_step[None],
        ledger.ended_inside[None],
        ledger.top_speed2[None],
        dict(zip(TOTALS, ledger.totals.to_numpy().tolist(), strict=True)),
        particles,
        test,
    )


def start_taichi(solver: Solver, threads: int) -> None:
    """Start Taichi afresh in the run's precision and without fast math, so that bits repeat.

    Raises ConfigError if the device is not there.
    """
    arch = ti.cuda if solver.device == "cuda" else ti.cpu
    real = ti.f32 if solver.precision == "f32" else ti.f64
    leave_lines_unwrapped()
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
    driver = serial if constants.summation == "in_order" else parallel
    driver.advance_frame(particles, nodes, ledger, constants, gravity, damping, int(sinters))
    accounts.fill_totals(particles, nodes, ledger, constants)


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
    loading = case.loading
    pressed = case.sintering.enabled or case.reading.unsintered == "pressed"

    first, place = 1, None
    if resume is None:
        yield frame_of(0, particles, ledger, _test_at(0, case, nodes, constants, place))
    else:
        particles.write_all(resume)
        ledger.top_speed2[None] = float(resume["top_speed2"])
        first = int(resume["frame"]) + 1
        place = Place(*resume["test_place"].tolist()) if "test_place" in resume else None
    for number in range(first, case.frames + 1):
        pressing = number <= loading.press_frames
        if number == loading.press_frames + 1:
            release(particles, at_rest=case.reading.release == "rest")
        if pressing and pressed:
            particles.write("force", _pressing_force(case, scene, particles.read("position"), number))
        if nodes.indenter and case.is_tested(number):
            place = place or find_place(case, particles.read("position"))
            start_frame(nodes.indenter, case, place, number)
        advance_frame(
            particles,
            nodes,
            ledger,
            constants,
            gravity=case.gravity_in(number),
            damping=case.damping_in(number),
            sinters=pressing and case.sintering.enabled,
        )
        _check(ledger, particles, constants, number)
        _check_volume(particles, case, number)
        yield frame_of(number, particles, ledger, _test_at(number, case, nodes, constants, place))


def _test_at(
    number: int, case: Case, nodes: state.Nodes, constants: Constants, place: Place | None
) -> Indentation | None:
    """What the indenter shows at the end of a frame."""
    if nodes.indenter is None:
        return None
    return Indentation(place, depth_at(case, number), force_of(nodes.indenter, constants))


def allocate(case: Case, scene: Scene, constants: Constants) -> tuple[state.Particles, state.Nodes, state.Ledger]:
    """Particles and nodes of the scene at frame 0, undeformed and at rest."""
    in_blocks = constants.summation == "in_order"
    particles = state.Particles(len(scene.positions), constants.material.STATE, in_blocks)
    particles.start(scene, case.material)
    nodes = state.Nodes(scene.node_distance, scene.node_normal, constants.summation == "fixed_point")
    ledger = state.Ledger()
    if case.indenter:
        radius = case.indenter.radius * case.reading.cell
        nodes.indenter = Indenter(radius, nodes.size, particles.count)
    if case.reading.initial_volume == "grid_density":
        serial.step_2_volume(particles, nodes, constants)
    return particles, nodes, ledger


def release(particles: state.Particles, at_rest: bool) -> None:
    """Frame 101: the external force goes; ``at_rest`` also takes the motion that pressing left."""
    for name in ("force", "velocity", "affine") if at_rest else ("force",):
        particles.write(name, np.zeros((particles.count, *state.SHAPES[name])))


def _pressing_force(case: Case, scene: Scene, positions: np.ndarray, frame: int) -> np.ndarray:
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


def _check(ledger: state.Ledger, particles: state.Particles, constants: Constants, frame: int) -> None:
    """Raise Diverged if the frame did not end well."""
    status = ledger.status[None]
    if status == state.RUNNING:
        return
    time = (frame - 1) * constants.frame_time + ledger.elapsed[None]
    where = f"in frame {frame} at t = {time:.4g} s"
    if status == state.TOO_MANY_SUBSTEPS:
        raise Diverged(
            f"diverged {where}: the time step fell to {ledger.smallest_step[None]:.2g} s, "
            f"with which a frame of {constants.frame_time:g} s needs more than {constants.max_substeps} substeps",
            frame,
        )
    p = ledger.particle[None]
    x, y = particles.position[p]
    raise Diverged(f"diverged {where}: particle {p} at ({x:.4g}, {y:.4g}) {_cause(p, particles)}", frame)


def _cause(p: int, particles: state.Particles) -> str:
    """What is wrong with particle p."""
    if not particles.wave_speed2[p] > 0.0 or not np.isfinite(particles.wave_speed2[p]):
        return "has a strain that is inverted or not finite"
    if not particles.poisson[p] < 0.5:
        return f"has a Poisson's ratio of {particles.poisson[p]:.3g}, which must stay below 0.5"
    return "left the grid"


def _check_volume(particles: state.Particles, case: Case, frame: int) -> None:
    """Raise Diverged if many particles are crushed to the lowest J_P: they are no longer followed.

    The upper bound is that of loose powder, whose stiffness Eq. 1 has long taken away.
    """
    low, _ = case.reading.plastic_volume
    part = float((particles.read("J_P") <= low).mean())
    if part > case.solver.max_bounded:
        raise Diverged(
            f"diverged in frame {frame} at t = {frame * case.loading.frame_time:.4g} s: {part:.0%} of the particles "
            f"are crushed to the lowest J_P, {low:g}, beyond which the law does not describe snow",
            frame,
        )
