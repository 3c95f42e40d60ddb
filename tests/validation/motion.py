"""Particles under control: a scene of one's own, advanced frame by frame."""

import numpy as np

from snowrepro.mpm import solver
from snowrepro.mpm.constants import Constants, make_constants
from snowrepro.scene.build import Scene, floor_and_walls
from snowrepro.settings.case import Case

# No plastic flow, no hardening, no sintering: what is left has closed solutions.
ELASTIC = (
    *("material.theta_c=0.5", "material.theta_s=0.5", "material.xi=0"),
    *("sintering=none", "reading.initial_volume=sampled"),
)


def over_floor(case: Case, positions: np.ndarray, volume: float, height: float) -> Scene:
    """Particles wherever a test wants them, over the floor of ``case``."""
    dx, width = case.dx, case.floor.width
    counts = (int(width / dx) + 1, int(height / dx) + 1)
    nodes = np.stack(np.meshgrid(*(np.arange(n) * dx for n in counts), indexing="ij"), axis=-1).reshape(-1, 2)
    distance, normal = floor_and_walls(case.floor.outline, nodes, width, height, 3 * dx)
    mass = case.material.rho * volume
    none = np.zeros(len(positions))
    return Scene(positions, none, mass, volume, distance.reshape(counts), normal.reshape(*counts, 2), 1.0)


def in_space(case: Case, positions: np.ndarray, volume: float | np.ndarray) -> Scene:
    """Particles with nothing around them; ``volume`` is one for all, or one each."""
    counts = tuple(np.ceil(positions.max(axis=0) / case.dx + 8).astype(int))
    mass = case.material.rho * volume
    far, up = np.full(counts, 1e9), np.tile([0.0, 1.0], (*counts, 1))
    return Scene(positions, np.zeros(len(positions)), mass, volume, far, up, 1.0)


def rings(inner: float, outer: float, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 2) about the origin and volumes (n,): particles on circles, whose shares fill the ring exactly.

    A lattice cut at the edge has cells that stick out: an error of its own, in a ring that breathes one
    of order 1.5 where this is of order 2.
    """
    count = round((outer - inner) / spacing)
    width = (outer - inner) / count
    places, volumes = [], []
    for i in range(count):
        r = inner + (i + 0.5) * width
        n = max(3, round(2 * np.pi * r / width))
        angle = 2 * np.pi * np.arange(n) / n + 1.1 * i  # no two circles in line
        places.append(r * np.stack([np.cos(angle), np.sin(angle)], axis=-1))
        volumes.append(np.full(n, 2 * np.pi * r * width / n))
    return np.concatenate(places), np.concatenate(volumes)


class Motion:
    """A scene in motion; ``advance`` steps it, ``read`` and ``mean`` look at it."""

    def __init__(self, case: Case, scene: Scene, frame_time: float | None = None):
        solver.start_taichi(case.solver, threads=1)
        constants = make_constants(case)
        self.constants = Constants(**vars(constants) | ({"frame_time": frame_time} if frame_time else {}))
        self.particles, self.nodes, self.ledger = solver.allocate(case, scene, self.constants)

    def advance(self, frames: int = 1, gravity: float = 0.0, damping: float = 0.0) -> None:
        """So many frames; a failure of the solver is one of the test."""
        for _ in range(frames):
            solver.advance_frame(self.particles, self.nodes, self.ledger, self.constants, gravity, damping, False)
            assert self.ledger.status[0] == 0

    def read(self, name: str) -> np.ndarray:
        return self.particles.read(name)

    def mean(self, name: str) -> np.ndarray:
        return self.particles.read(name).mean(axis=0)

    def set_velocity(self, velocity: np.ndarray, gradient: np.ndarray) -> None:
        """A velocity field at the particles (n, 2), with its gradient (n, 2, 2) in APIC's affine matrices."""
        inertia = self.constants.inertia * self.constants.dx**2
        self.particles.write("velocity", velocity)
        self.particles.write("affine", gradient * inertia)

    def angular_momentum(self) -> float:
        """About the origin, the affine matrices' share included."""
        m, x, v, B = (self.read(name) for name in ("mass", "position", "velocity", "affine"))
        return float((m * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0] + B[:, 1, 0] - B[:, 0, 1])).sum())

    def kinetic_energy(self) -> float:
        """Of the particles, the affine matrices' share included."""
        inertia = self.constants.inertia * self.constants.dx**2
        m, v, B = (self.read(name) for name in ("mass", "velocity", "affine"))
        return float(0.5 * (m * ((v**2).sum(axis=1) + (B**2).sum(axis=(1, 2)) / inertia)).sum())
