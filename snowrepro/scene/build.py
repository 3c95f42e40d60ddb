"""Build the scene of a run: particles, and the floor's signed distance on the grid's nodes."""

from dataclasses import dataclass

import numpy as np

from ..config import Config, Outline
from ..errors import ConfigError
from . import outline as geometry

WALL_CELLS = 3.0  # the box around the scene is a wall this many grid spacings inside the grid
HEADROOM = 6.0  # free height above the snow [cells]
JITTER = 0.25  # largest shift of a particle from its lattice place [grid spacings]


@dataclass(frozen=True)
class Scene:
    """What the solver starts from; lengths in the reading's unit.

    ``positions`` (n, 2), ``depth`` (n,) below the snow's surface, ``mass`` and ``volume`` of a particle
    at unit depth, ``node_distance`` (nx, ny) and ``node_normal`` (nx, ny, 2) of floor and walls,
    ``radius`` of the disc of the snow's area.
    """

    positions: np.ndarray
    depth: np.ndarray
    mass: float
    volume: float
    node_distance: np.ndarray
    node_normal: np.ndarray
    radius: float


def build_scene(config: Config) -> Scene:
    """Place the snow above the floor.  Raises ConfigError for a bad outline, and where things do not fit."""
    for kind, part in (("shape", config.shape), ("floor", config.floor)):
        flaw = geometry.flaw(part.outline)
        if flaw:
            raise ConfigError(f"the outline of {kind} '{part.name}' cannot be used: {flaw}")
    places, depth = sample(config.shape.outline, config.fidelity.dx, config.fidelity.particles_per_cell, config.seed)
    shift = _place_of_snow(config)
    width, height = domain(config)
    _check_fit(config, places + shift, width, height)

    cell, dx = config.reading.cell, config.fidelity.dx
    counts = np.array([np.ceil(width / dx), np.ceil(height / dx)], dtype=int) + 1
    nodes = np.stack(np.meshgrid(*(np.arange(n) * dx for n in counts), indexing="ij"), axis=-1).reshape(-1, 2)
    distance, normal = floor_and_walls(config.floor.outline, nodes, counts, dx)

    area = geometry.area(config.shape.outline) * cell**2
    return Scene(
        positions=(places + shift) * cell,
        depth=depth * cell,
        mass=config.material.rho * area / len(places),
        volume=area / len(places),
        node_distance=distance.reshape(counts) * cell,
        node_normal=normal.reshape(*counts, 2),
        radius=float(np.sqrt(area / np.pi)),
    )


def sample(outline: Outline, dx: float, particles_per_cell: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Particles in an outline: places (n, 2) and depth below the surface (n,), both in cells.

    n = round(area x particles_per_cell / dx^2), so that equal masses add up to density x area.  They
    are the n places deepest inside of a square lattice with a seeded offset, each shifted by a
    uniform jitter (legacy Taichi: +-0.25 cell at 4 a cell).
    """
    rng = np.random.default_rng(seed)
    spacing = dx / np.sqrt(particles_per_cell)
    count = round(geometry.area(outline) / spacing**2)
    low, high = geometry.extent(outline)
    offset = rng.uniform(0.0, spacing, size=2)
    axes = [np.arange(low[d] - 2 * spacing, high[d] + 3 * spacing, spacing) + offset[d] for d in range(2)]
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    distance, _ = geometry.signed_distance(outline, lattice)
    kept = np.sort(np.argsort(distance, kind="stable")[:count])
    jitter = rng.uniform(-JITTER, JITTER, size=(count, 2)) * (2 * spacing)
    return lattice[kept] + jitter, -distance[kept]


def floor_and_walls(
    floor: Outline, points: np.ndarray, node_counts: np.ndarray, dx: float
) -> tuple[np.ndarray, np.ndarray]:
    """Signed distance (n,) and normal (n, 2) of the nearest of the floor and the box's four walls [cells]."""
    distance, normal = geometry.signed_distance(floor, points)
    far = (node_counts - 1) * dx
    for axis in range(2):
        for wall, sign in ((WALL_CELLS * dx, 1.0), (far[axis] - WALL_CELLS * dx, -1.0)):
            to_wall = sign * (points[:, axis] - wall)
            closer = to_wall < distance
            distance = np.where(closer, to_wall, distance)
            normal[closer] = np.eye(2)[axis] * sign
    return distance, normal


def domain(config: Config) -> tuple[float, float]:
    """Width and height of the box around the scene [cells]."""
    low, high = geometry.extent(config.shape.outline)
    walls = 2 * WALL_CELLS * 2.0  # sized for the coarsest fidelity, so that all share one box
    height = config.floor.surface + config.reading.drop_height + (high - low)[1] + HEADROOM + walls
    return config.floor.width, float(np.ceil(height))


def _place_of_snow(config: Config) -> np.ndarray:
    """Shift that puts the outline's centre over ``drop_x`` and its lowest point ``drop_height`` above the floor."""
    low, _ = geometry.extent(config.shape.outline)
    centre = geometry.centroid(config.shape.outline)
    return np.array([config.floor.drop_x - centre[0], config.floor.surface + config.reading.drop_height - low[1]])


def _check_fit(config: Config, places: np.ndarray, width: float, height: float) -> None:
    """Refuse a scene whose snow leaves the box or starts in the floor."""
    margin = (WALL_CELLS + 1.0) * config.fidelity.dx
    low, high = places.min(axis=0), places.max(axis=0)
    if (low < margin).any() or high[0] > width - margin or high[1] > height - margin:
        raise ConfigError(
            f"shape '{config.shape.name}' does not fit the domain of floor '{config.floor.name}': the snow spans "
            f"x {low[0]:.1f} to {high[0]:.1f} and y {low[1]:.1f} to {high[1]:.1f} cells, the domain is {width:g} x "
            f"{height:g} cells with a margin of {margin:g}"
        )
    distance, _ = geometry.signed_distance(config.floor.outline, places)
    if distance.min() < config.fidelity.dx:
        raise ConfigError(
            f"shape '{config.shape.name}' touches floor '{config.floor.name}' at the start: "
            f"the gap is {distance.min():.2f} cells, at least {config.fidelity.dx:g} are needed"
        )
    floor_low, floor_high = geometry.extent(config.floor.outline)
    if (floor_low < 0).any() or floor_high[0] > width or floor_high[1] > height:
        raise ConfigError(
            f"floor '{config.floor.name}' lies outside its domain of {width:g} x {height:g} cells: it spans "
            f"x {floor_low[0]:g} to {floor_high[0]:g} and y {floor_low[1]:g} to {floor_high[1]:g}"
        )
