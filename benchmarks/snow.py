"""The benchmark's snow: a body that lands on the floor and flows.  All calls of snowrepro's solver are here."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from snowrepro.composition import compose
from snowrepro.config import Config
from snowrepro.mpm import diagnostics, solver
from snowrepro.mpm.laws import Laws, laws_of
from snowrepro.scene.build import build_scene

GRAVITY = 10.0  # as when the snow falls
SPEED = 30.0  # downward, at the start; the floor is a spacing and a half below
QUANTITIES = (
    "position velocity affine F_E J_P density young poisson hardening mass volume mu lam force".split()
)  # what a peer may need


@dataclass
class Snow:
    """A run in snowrepro, and its start for a peer: particle quantities (n, ...) and the floor on the nodes."""

    config: Config
    laws: Laws
    particles: dict[str, np.ndarray]
    distance: np.ndarray
    normal: np.ndarray
    advance: Callable[..., int]  # one frame, with True in full: with sintering and diagnostics; returns its substeps
    read: Callable[[str], np.ndarray]


def snow(scene: str, spline: str, dx: float = 1.0, width: float = 1.0, frame_time: float | None = None) -> Snow:
    """``dx`` in cells: particles and substeps scale with it, a frame keeps its number of substeps.

    ``width``: of the domain, in widths of the scene's own; the snow and its floor stay where they are.
    ``frame_time`` [s]: of a frame, where it is not to be dx times the usual.
    """
    config = _config(scene, spline, dx, width, frame_time)
    built = build_scene(config)
    solver.start_taichi(config)
    laws = laws_of(config)
    particles, nodes, ledger = solver.allocate(config, built, laws)
    velocity = np.zeros((particles.count, 2))
    velocity[:, 1] = -SPEED
    particles.write("velocity", velocity)
    number, row = 0, None

    def advance(in_full: bool = False) -> int:
        nonlocal number, row
        solver.advance_frame(particles, nodes, ledger, laws, GRAVITY, 0.0, in_full)
        number += 1
        if in_full:
            row = diagnostics.measure(solver.frame_of(number, particles, ledger), config, row)
        if ledger.status[None] != 0:
            raise RuntimeError(f"the benchmark's snow diverged in frame {number}")
        return ledger.substeps[None]

    return Snow(
        config=config,
        laws=laws,
        particles={name: np.ascontiguousarray(particles.read(name)) for name in QUANTITIES},
        distance=built.node_distance,
        normal=built.node_normal,
        advance=advance,
        read=particles.read,
    )


def _config(scene: str, spline: str, dx: float, width: float, frame_time: float | None) -> Config:
    """The run's configuration."""
    overrides = [f"scene={scene}", f"solver.spline={spline}", f"reading.drop_height={1.5 * dx}", f"fidelity.dx={dx}"]
    own = compose(overrides)
    return compose(
        [
            *overrides,
            f"loading.frame_time={frame_time or own.loading.frame_time * dx}",
            f"floor.width={own.floor.width * width}",
            f"floor.drop_x={own.floor.drop_x}",
        ]
    )
