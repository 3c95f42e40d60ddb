"""Build the scene of a run: particles, and the floor's signed distance on the grid's nodes."""

from dataclasses import dataclass

import numpy as np

from ..errors import ConfigError
from ..settings.case import Case, Floor, Outline
from . import outline as geometry
from .size import require_affordable

WALL_SPACINGS = 3.0  # the box around the scene is a wall this many grid spacings inside the grid
COARSEST = 2.0  # grid spacing that the domain is sized for, so that all fidelities share one [cells]
LEAST_CELLS = 16.0  # of snow
HEADROOM = 6.0  # free height above the snow [cells]
JITTER = 0.5  # largest shift of a particle from its lattice place [lattice spacings]


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


def build_scene(case: Case) -> Scene:
    """Place the snow above the floor.  Raises ConfigError for a bad outline, and where things do not fit."""
    for kind, part in (("shape", case.shape), ("floor", case.floor)):
        flaw = geometry.flaw(part.outline)
        if flaw:
            raise ConfigError(f"the outline of {kind} '{part.name}' cannot be used: {flaw}")
    check_size(case)
    cell, dx = case.reading.cell, case.fidelity.dx
    area = geometry.area(case.shape.outline)
    if area < LEAST_CELLS * dx**2:
        raise ConfigError(
            f"shape '{case.shape.name}' is too small: its area is {area:.3g} cells^2, at least "
            f"{LEAST_CELLS * dx**2:g} are needed at a grid spacing of {dx:g}"
        )
    width, height = domain(case)
    _check_floor(case, width)
    places, depth = sample(case.shape.outline, dx, case.fidelity.particles_per_cell, case.seed)
    places = places + place_of_snow(case)
    _check_fit(case, places, width, height)
    _check_indenter(case)

    counts = np.array([np.ceil(width / dx), np.ceil(height / dx)], dtype=int) + 1
    nodes = np.stack(np.meshgrid(*(np.arange(n) * dx for n in counts), indexing="ij"), axis=-1).reshape(-1, 2)
    far = (counts - 1) * dx
    distance, normal = floor_and_walls(case.floor.outline, nodes, far[0], far[1], WALL_SPACINGS * dx)
    return Scene(
        positions=places * cell,
        depth=depth * cell,
        mass=case.material.rho * area * cell**2 / len(places),
        volume=area * cell**2 / len(places),
        node_distance=distance.reshape(counts) * cell,
        node_normal=normal.reshape(*counts, 2),
        radius=float(np.sqrt(area / np.pi)) * cell,
    )


def check_size(case: Case) -> None:
    """Refuse a scene that would take too much memory, before any of it is there.  Raises ConfigError."""
    low, high = geometry.extent(case.shape.outline)
    box = float((high - low).prod())
    require_affordable(case, geometry.area(case.shape.outline), box, *domain(case))


def sample(outline: Outline, dx: float, particles_per_cell: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Particles in an outline: places (n, 2) and depth below the surface (n,), both in cells.

    n = round(area x particles_per_cell / dx^2), so that equal masses add up to density x area.  A square
    lattice with a seeded offset is jittered (legacy Taichi: +-0.25 cell at 4 a cell); the n places that
    are then deepest inside are kept, which are those inside but for a few at the edge.
    """
    rng = np.random.default_rng(seed)
    spacing = dx / np.sqrt(particles_per_cell)
    count = round(geometry.area(outline) / spacing**2)
    low, high = geometry.extent(outline)
    offset = rng.uniform(0.0, spacing, size=2)
    axes = [np.arange(low[d] - 2 * spacing, high[d] + 3 * spacing, spacing) + offset[d] for d in range(2)]
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    places = lattice + rng.uniform(-JITTER, JITTER, size=lattice.shape) * spacing
    distance, _ = geometry.signed_distance(outline, places)
    kept = np.sort(np.argsort(distance, kind="stable")[:count])
    return places[kept], -distance[kept]


def floor_and_walls(
    floor: Outline, points: np.ndarray, width: float, height: float, inset: float
) -> tuple[np.ndarray, np.ndarray]:
    """Signed distance (n,) and normal (n, 2) of the floor and of four walls ``inset`` inside the box [cells].

    The nearest counts, in whatever order they are taken; where several are, the mean of their normals.
    """
    distance, normal = geometry.signed_distance(floor, points)
    walls = (
        (points[:, 0] - inset, (1.0, 0.0)),
        (width - inset - points[:, 0], (-1.0, 0.0)),
        (points[:, 1] - inset, (0.0, 1.0)),
        (height - inset - points[:, 1], (0.0, -1.0)),
    )
    for to_wall, inward in walls:
        distance, normal = geometry.nearer(distance, normal, to_wall, np.broadcast_to(inward, normal.shape))
    return distance, geometry.unit(normal)


def domain(case: Case) -> tuple[float, float]:
    """Width and height of the box around the scene [cells]."""
    snow, floor = (geometry.extent(part.outline)[1][1] for part in (case.shape, case.floor))
    top = max(snow + place_of_snow(case)[1] + HEADROOM, floor)
    return domain_width(case.floor), float(np.ceil(top + COARSEST * WALL_SPACINGS))


def domain_width(floor: Floor) -> float:
    """Width of the box [cells]."""
    return floor.width or float(np.ceil(geometry.extent(floor.outline)[1][0]))


def place_of_snow(case: Case) -> np.ndarray:
    """Shift (2,) that puts the snow's centre over ``drop_x`` and lets it fall ``drop_height`` to the first touch."""
    body, floor = case.shape.outline, case.floor
    drop_x = floor.drop_x or 0.5 * domain_width(floor)
    aside = drop_x - geometry.centroid(body)[0]
    ground = COARSEST * WALL_SPACINGS - geometry.extent(body)[0][1]  # of the box, where no floor is below
    lift = max(ground, -geometry.gap_above(body, floor.outline, aside))
    return np.array([aside, lift + case.reading.drop_height])


def _check_floor(case: Case, width: float) -> None:
    """Refuse a floor that reaches out of its domain."""
    low, high = geometry.extent(case.floor.outline)
    if (low < 0).any() or high[0] > width:
        raise ConfigError(
            f"floor '{case.floor.name}' lies outside its domain, which is {width:g} cells wide from (0, 0): "
            f"it spans x {low[0]:g} to {high[0]:g} and y {low[1]:g} to {high[1]:g}"
        )


def _check_fit(case: Case, places: np.ndarray, width: float, height: float) -> None:
    """Refuse snow that leaves the box or starts in the floor."""
    dx = case.fidelity.dx
    margin = (WALL_SPACINGS + 1.0) * dx
    low, high = places.min(axis=0), places.max(axis=0)
    if (low < margin).any() or high[0] > width - margin or high[1] > height - margin:
        raise ConfigError(
            f"shape '{case.shape.name}' does not fit the domain of floor '{case.floor.name}': the snow spans "
            f"x {low[0]:.1f} to {high[0]:.1f} and y {low[1]:.1f} to {high[1]:.1f} cells, the domain is {width:g} x "
            f"{height:g} cells with a margin of {margin:g}"
        )
    distance, _ = geometry.signed_distance(case.floor.outline, places)
    if distance.min() < dx:
        raise ConfigError(
            f"shape '{case.shape.name}' touches floor '{case.floor.name}' at the start: "
            f"the gap is {distance.min():.2f} cells, at least {dx:g} are needed"
        )


def _check_indenter(case: Case) -> None:
    """Refuse a hardness test that the grid cannot resolve, or that goes down to where the snow is held."""
    test, outline = case.indenter, case.shape.outline
    if test is None:
        return
    if test.radius < 2.0 * case.fidelity.dx:
        raise ConfigError(
            f"indenter.radius ({test.radius:g} cells) must be at least two grid spacings ({2 * case.fidelity.dx:g})"
        )
    standing = geometry.extent(outline)[1][1] - geometry.centroid(outline)[1]
    if test.depth > standing - 2.0 * case.fidelity.dx:
        raise ConfigError(
            f"indenter.depth ({test.depth:g} cells) is more than shape '{case.shape.name}' has: {standing:.3g} cells "
            "of it stand out of the vice, which holds it up to its centroid, and two grid spacings must be left"
        )
