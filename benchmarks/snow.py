"""The benchmark's snow: a body that lands on the floor and flows.  All calls of snowrepro's solver are here."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from snowrepro.composition.compose import compose
from snowrepro.mpm import diagnostics, solver
from snowrepro.mpm.constants import Constants, make_constants
from snowrepro.mpm.frame import Frame, read_outcomes
from snowrepro.scene.build import build_scene
from snowrepro.settings.case import Case

GRAVITY = 10.0  # as when the snow falls
SPEED = 30.0  # downward, at the start; the floor is a spacing and a half below
QUANTITIES = (  # what a peer may need
    "position", "velocity", "affine", "F_E", "J_P", "density", "young", "poisson", "hardening", "mass", "volume", "mu",
    "lam", "force",
)  # fmt: skip


@dataclass
class Snow:
    """A simulation in snowrepro, and its start for a peer.

    ``particles``: quantities by name, each (n, ...); ``distance`` (nx, ny) and ``normal`` (nx, ny, 2): of the floor on
    the nodes.  ``advance`` simulates a frame and returns its substeps; with True also sintering and diagnostics.
    ``read`` returns a quantity as it is now.
    """

    case: Case
    constants: Constants
    particles: dict[str, np.ndarray]
    distance: np.ndarray
    normal: np.ndarray
    advance: Callable[..., int]
    read: Callable[[str], np.ndarray]


def start_snow(scene: str, spline: str, dx: float = 1.0, width: float = 1.0, frame_time: float | None = None) -> Snow:
    """Start a simulation of a scene at a grid spacing ``dx`` [cells].

    Particles and substeps scale with dx; a frame keeps its number of substeps.
    ``width``: of the domain, in widths of the scene's own; the snow and its floor stay where they are.
    ``frame_time`` [s]: of a frame, where it is not to be dx times the usual.
    """
    case = _compose_case(scene, spline, dx, width, frame_time)
    built = build_scene(case)
    solver.start_taichi(case.solver, threads=1)
    constants = make_constants(case)
    particles, nodes, ledger = solver.allocate(case, built, constants)
    velocity = np.zeros((particles.count, 2))
    velocity[:, 1] = -SPEED
    particles.write("velocity", velocity)
    number, row = 0, None

    def advance(in_full: bool = False) -> int:
        """Simulate one frame and return its substeps."""
        nonlocal number, row
        solver.advance_frame(particles, nodes, ledger, constants, GRAVITY, 0.0, in_full)
        number += 1
        if in_full:
            row = diagnostics.measure(Frame(number, read_outcomes(ledger)[0], particles), case, row)
        if ledger.status[0] != 0:
            raise RuntimeError(f"the benchmark's snow diverged in frame {number}")
        return ledger.substeps[0]

    return Snow(
        case=case,
        constants=constants,
        particles={name: np.ascontiguousarray(particles.read(name)) for name in QUANTITIES},
        distance=built.node_distance,
        normal=built.node_normal,
        advance=advance,
        read=particles.read,
    )


def _compose_case(scene: str, spline: str, dx: float, width: float, frame_time: float | None) -> Case:
    """Compose what ``start_snow`` simulates."""
    overrides = [f"scene={scene}", f"solver.spline={spline}", f"reading.drop_height={1.5 * dx}", f"fidelity.dx={dx}"]
    usual = compose(overrides).case
    return compose(
        [
            *overrides,
            f"loading.frame_time={frame_time or usual.loading.frame_time * dx}",
            f"floor.width={usual.floor.width * width}",
            f"floor.drop_x={usual.floor.drop_x}",
            f"output.every={usual.loading.frames}",  # nothing is stored; with a million particles it would be refused
        ]
    ).case
