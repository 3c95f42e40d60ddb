"""A stiff elastic disc on an incline: it rolls, or slips and is spun up, by Coulomb's friction."""

from dataclasses import dataclass

import numpy as np

from snowrepro.composition.compose import compose
from tests.validation.motion import ELASTIC, Motion, over_floor, rings

GRAVITY = 10.0
SPACING = 0.5  # of particles [cells]


@dataclass(frozen=True)
class Incline:
    """A disc of ``radius`` cells on a slope of so many ``degrees`` with a coefficient of ``friction``."""

    radius: float
    degrees: float
    friction: float

    @property
    def directions(self) -> np.ndarray:
        """Unit vectors down the slope and away from it, one a row."""
        cos, sin = np.cos(np.radians(self.degrees)), np.sin(np.radians(self.degrees))
        return np.array([[cos, -sin], [sin, cos]])

    @property
    def rolls(self) -> bool:
        """Whether friction suffices to roll without slipping."""
        return bool(np.tan(np.radians(self.degrees)) <= 3 * self.friction)

    @property
    def theory(self) -> tuple[float, float]:
        """Acceleration down the slope [cells/s^2] and of the spin [1/s^2] of a rigid disc that starts at rest."""
        sin, cos = np.sin(np.radians(self.degrees)), np.cos(np.radians(self.degrees))
        rolling = GRAVITY * sin * 2 / 3
        if self.rolls:
            return rolling, rolling / self.radius
        return GRAVITY * (sin - self.friction * cos), 2 * self.friction * GRAVITY * cos / self.radius


def start_disc(incline: Incline, contact: str, young: float = 1e7, *overrides: str) -> Motion:
    """The disc at rest, its edge on the slope; its particles lie on circles, so that it is round."""
    _, up = incline.directions
    radius = incline.radius
    width = 80 + 4 * radius
    rise = width * np.tan(np.radians(incline.degrees))
    case = compose(
        [
            *(*ELASTIC, f"reading.contact={contact}", f"reading.friction={incline.friction}", f"material.E={young}"),
            *(f"floor.outline.points=[[0,0],[{width},0],[0,{rise}]]", f"floor.width={width}", *overrides),
        ]
    ).case
    places, volumes = rings(0.0, radius, SPACING)
    foot = np.array([20 + radius, rise - (20 + radius) * np.tan(np.radians(incline.degrees))])
    scene = over_floor(case, foot + radius * up + places, volumes, np.ceil(rise + 2 * radius + 20))
    return Motion(case, scene)


def find_motion(motion: Motion, down: np.ndarray) -> tuple[float, float]:
    """Speed of the centre down the slope, and spin by the angular momentum; inertia is that of the mass on the grid."""
    mass, x, v, B = (motion.read(name) for name in ("mass", "position", "velocity", "affine"))
    centre, mean = (np.average(values, axis=0, weights=mass) for values in (x, v))
    arm, own = x - centre, v - mean
    momentum = mass @ (arm[:, 0] * own[:, 1] - arm[:, 1] * own[:, 0] + B[:, 1, 0] - B[:, 0, 1])
    spread = 2 * motion.constants.inertia * motion.constants.dx**2
    return float(mean @ down), float(-momentum / (mass @ ((arm**2).sum(axis=1) + spread)))


def accelerate(incline: Incline, motion: Motion, frames: int) -> tuple[float, float]:
    """Acceleration and that of the spin, fitted to the last two thirds of so many frames."""
    down, _ = incline.directions
    rows = []
    for _ in range(frames):
        motion.advance(gravity=GRAVITY)
        rows.append(find_motion(motion, down))
    times = motion.constants.frame_time * np.arange(1, frames + 1)
    late = slice(frames // 3, None)
    speed, spin = np.polyfit(times[late], np.array(rows)[late], 1)[0]
    return float(speed), float(spin)
