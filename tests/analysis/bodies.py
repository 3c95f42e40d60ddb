"""Built bodies of snow on lattices of any direction, and what can happen to them; lengths are in cells of the paper.

Each function of ``places`` (n, 2) returns where the particles are afterwards.
"""

import numpy as np

RADIUS = 22.0


def fill_disc(per_cell: int = 4, degrees: float = 0.0, seed: int | None = None, radius: float = RADIUS) -> np.ndarray:
    """Particles of a disc around the origin, (n, 2): on a square lattice turned by ``degrees``, or anywhere."""
    if seed is not None:
        side = 2 * radius
        places = np.random.default_rng(seed).uniform(-radius, radius, (int(side * side * per_cell), 2))
    else:
        spacing = per_cell**-0.5
        line = np.arange(-1.5 * radius, 1.5 * radius, spacing) + spacing / 2
        places = turn(np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2), np.radians(degrees))
    return places[(places**2).sum(axis=1) < radius**2]


def fill_layer(length: float = 60.0, thickness: float = 6.0, per_cell: int = 4) -> np.ndarray:
    """Particles of a flat layer around the origin, (n, 2)."""
    spacing = per_cell**-0.5
    along, across = (np.arange(-size / 2, size / 2, spacing) + spacing / 2 for size in (length, thickness))
    return np.stack(np.meshgrid(along, across), axis=-1).reshape(-1, 2)


def fill_box(side: float = 12.0, spacing: float = 0.5) -> np.ndarray:
    """Particles of a box in three dimensions around the origin, (n, 3)."""
    line = np.arange(-side / 2, side / 2, spacing) + spacing / 2
    return np.stack(np.meshgrid(line, line, line), axis=-1).reshape(-1, 3)


def turn(places: np.ndarray, angle: float) -> np.ndarray:
    """Turn everything by ``angle`` about the origin."""
    return places @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def crush_below(places: np.ndarray, least: float = 0.4, over: float = 30.0) -> np.ndarray:
    """Press a body flat from below: to ``least`` of its height at its bottom, not at all ``over`` cells above it."""
    heights = np.linspace(-RADIUS, RADIUS, 2001)
    scale = np.clip(least + (1 - least) * (heights + RADIUS) / over, least, 1.0)
    pressed = np.cumsum(scale) * (heights[1] - heights[0])
    return np.stack([places[:, 0], np.interp(places[:, 1], heights, pressed)], axis=1)


def break_apart(places: np.ndarray, pieces: int = 12, seed: int = 3) -> np.ndarray:
    """Break a body into ``pieces`` around random points; each turns and flies off."""
    rng = np.random.default_rng(seed)
    centres = rng.uniform(-RADIUS, RADIUS, (pieces, 2))
    return _scatter(places, ((places[:, None] - centres) ** 2).sum(axis=2).argmin(axis=1), rng, 6.0)


def crumble(places: np.ndarray, size: float, seed: int = 4) -> np.ndarray:
    """Break a body into squares of side ``size``; each turns and flies off."""
    squares = np.unique(np.floor(places / size), axis=0, return_inverse=True)[1].ravel()
    return _scatter(places, squares, np.random.default_rng(seed), 2.0)


def _scatter(places: np.ndarray, piece: np.ndarray, rng: np.random.Generator, spread: float) -> np.ndarray:
    """Turn each ``piece`` (n,) at random, and move its centre to ``spread`` times as far from the origin."""
    moved = np.empty_like(places)
    for number in np.unique(piece):
        mine = piece == number
        centre = places[mine].mean(axis=0)
        moved[mine] = turn(places[mine] - centre, rng.uniform(-3, 3)) + spread * centre
    return moved


def fall_to_heap(places: np.ndarray, right_of: float, seed: int = 5) -> tuple[np.ndarray, np.ndarray]:
    """Let all that lies ``right_of`` fly as a cloud, and lie as dense as before in another order: both states."""
    rng = np.random.default_rng(seed)
    loose = np.flatnonzero(places[:, 0] > right_of)
    cloud, heap = places.copy(), places.copy()
    cloud[loose] += rng.normal(0, 15, (len(loose), 2))
    heap[loose] = places[rng.permutation(loose)] + [20.0, 0.0]
    return cloud, heap


def throw_dust(places: np.ndarray, share: float, seed: int = 6) -> tuple[np.ndarray, float]:
    """Throw single particles far away: where all are, and which part of them was thrown."""
    rng = np.random.default_rng(seed)
    thrown = rng.random(len(places)) < share
    moved = places + np.where(thrown[:, None], rng.normal(0, 40, places.shape), 0.0)
    return moved, float(thrown.mean())


def bend(places: np.ndarray, radius: float) -> np.ndarray:
    """Bend a layer about a circle of ``radius``."""
    x, y = places.T
    return np.stack([(radius + y) * np.sin(x / radius), (radius + y) * np.cos(x / radius)], axis=1)
