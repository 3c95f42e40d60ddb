"""The hardness test: a rigid disc that moves down into the snow, and a vice that holds the snow's lower half.

Both act on the nodes behind the floor's contact (step 5), the disc on particles too (step 8).  None of it is
compiled into a run without an indenter.
"""

from dataclasses import dataclass

import numpy as np

from ..compiler import ti
from ..errors import ConfigError
from ..settings.case import Case
from . import contact
from .constants import Constants

OPEN = -1e9  # height of a vice that holds nothing
AWAY = 1e9  # height of a disc that touches nothing


@ti.data_oriented
class Indenter:
    """Disc and vice as the kernels see them.

    ``centre`` and downward ``speed`` of the disc; ``vice``: the height up to which nodes rest; and the momentum that
    the disc gave to each node and particle in the frame.
    """

    def __init__(self, radius: float, node_counts: tuple[int, int], particle_slots: int):
        self.radius = radius
        self.centre = ti.Vector.field(2, float, shape=())
        self.speed = ti.field(float, shape=())
        self.vice = ti.field(float, shape=())
        self.node_impulse = ti.Vector.field(2, float, shape=node_counts)
        self.particle_impulse = ti.Vector.field(2, float, shape=particle_slots)
        self.impulse = ti.Vector.field(2, ti.f64, shape=())
        self.set((0.0, AWAY), 0.0, OPEN)

    def set(self, centre: tuple[float, float], speed: float, vice: float) -> None:
        """Where the disc begins a frame, how fast it moves down in it, and where the vice holds."""
        self.centre[None] = centre
        self.speed[None] = speed
        self.vice[None] = vice


@dataclass(frozen=True)
class Place:
    """Where a test is made: ``x`` of the disc, height of its lowest point at first ``touch``, and of the ``vice``."""

    x: float
    touch: float
    vice: float


def find_place(case: Case, positions: np.ndarray) -> Place:
    """Over the centroid of the snow (n, 2), from the first particle that the disc meets; the vice at the centroid.

    Raises ConfigError if the disc would come down to the vice.
    """
    assert case.indenter is not None
    cell = case.reading.cell
    radius, depth = case.indenter.radius * cell, case.indenter.depth * cell
    x, vice = positions.mean(axis=0)
    aside = positions[:, 0] - x
    met = np.abs(aside) < radius
    heights = positions[met, 1] - radius + np.sqrt(radius**2 - aside[met] ** 2)
    touch = float(heights.max(initial=vice))
    if touch - depth < vice + 2.0 * case.dx:
        raise ConfigError(
            f"indenter.depth ({case.indenter.depth:g} cells) reaches the vice: {(touch - vice) / cell:.3g} cells of "
            "the pressed snow stand out of it"
        )
    return Place(float(x), touch, float(vice))


def depth_at(case: Case, frame: int) -> float:
    """Depth of the disc below first touch at the end of a frame, in length units; NaN before the test."""
    assert case.indenter is not None
    moved = frame - case.frames_before_test
    if moved < 1:
        return float("nan")
    way = case.indenter.speed * moved * case.loading.frame_time
    return (way - case.approach) * case.reading.cell


def start_frame(indenter: Indenter, case: Case, place: Place, frame: int) -> None:
    """Put disc and vice where they are as a frame of the test begins."""
    assert case.indenter is not None
    speed = case.indenter.speed * case.reading.cell
    end = place.touch - depth_at(case, frame) + indenter.radius
    indenter.set((place.x, end + speed * case.loading.frame_time), speed, place.vice)


def force_of(indenter: Indenter, constants: Constants) -> float:
    """Upward force on the disc, the mean over the frame, at unit depth out of the plane."""
    _add_up(indenter)
    return -float(indenter.impulse[None][1]) / constants.frame_time


@ti.kernel
def _add_up(indenter: ti.template()):
    """The disc's impulse in one order, in f64."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        total = ti.Vector([ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)])
        for i, j in ti.ndrange(indenter.node_impulse.shape[0], indenter.node_impulse.shape[1]):
            total += indenter.node_impulse[i, j]
        for p in range(indenter.particle_impulse.shape[0]):
            total += indenter.particle_impulse[p]
        indenter.impulse[None] = total


@ti.func
def move(indenter: ti.template(), dt):
    """The disc goes on through a substep."""
    indenter.centre[None][1] -= dt * indenter.speed[None]


@ti.func
def against_disc(velocity, position, indenter: ti.template(), constants: ti.template()):
    """Velocity of what is at ``position`` after contact: free outside the disc and where it leaves it."""
    result = velocity
    arm = position - indenter.centre[None]
    distance = arm.norm()
    if distance < indenter.radius:
        own = ti.Vector([0.0, -indenter.speed[None]])
        result = own + contact.slide(velocity - own, arm / (distance + contact.TINY), constants.indenter_friction)
    return result


@ti.func
def node_velocity(i, j, velocity, mass, indenter: ti.template(), constants: ti.template()):
    """Step 5 behind the floor: rest in the vice, contact with the disc."""
    result = velocity
    position = ti.Vector([i * constants.dx, j * constants.dx])
    if position[1] <= indenter.vice[None]:
        result = ti.Vector([0.0, 0.0])
    else:
        result = against_disc(velocity, position, indenter, constants)
        indenter.node_impulse[i, j] += mass * (result - velocity)
    return result


@ti.func
def particle_velocity(p, velocity, position, mass, indenter: ti.template(), constants: ti.template()):
    """Step 8: contact of particle p with the disc."""
    result = against_disc(velocity, position, indenter, constants)
    indenter.particle_impulse[p] += mass * (result - velocity)
    return result
