"""Geometry of closed outlines: area, centroid, signed distance and outward normal.

Distances are negative inside.  Nothing depends on which vertex comes first or on the direction in
which the vertices run.
"""

import numpy as np

from ..config import Outline


def area(outline: Outline) -> float:
    """Area [cells^2]."""
    if outline.kind == "circle":
        return float(np.pi * outline.radius**2)
    return abs(_signed_area(_corners(outline)))


def flaw(outline: Outline) -> str | None:
    """What makes an outline unusable: a repeated corner, no area, edges that cross or touch; None if nothing does."""
    if outline.kind == "circle":
        return None
    corners = _corners(outline)
    edges = np.roll(corners, -1, axis=0) - corners
    size = float(np.abs(edges).max())
    if (np.abs(edges).max(axis=1) <= 1e-9 * size).any():
        return "a corner is repeated"
    count = len(corners)
    for i in range(count):
        for j in range(i + 1, count):
            neighbours = j == i + 1 or (i == 0 and j == count - 1)
            if not neighbours and _meet(corners[i], edges[i], corners[j], edges[j]):
                return f"the edges that start at corners {i + 1} and {j + 1} cross or touch"
    if abs(_signed_area(corners)) <= 1e-9 * size**2:
        return "it has no area"
    return None


def _meet(a: np.ndarray, along_a: np.ndarray, b: np.ndarray, along_b: np.ndarray) -> bool:
    """Whether two edges, each a start and a vector, have a point in common."""

    def side(start: np.ndarray, along: np.ndarray, point: np.ndarray) -> float:
        return float(along[0] * (point[1] - start[1]) - along[1] * (point[0] - start[0]))

    sides_b = side(a, along_a, b), side(a, along_a, b + along_b)
    sides_a = side(b, along_b, a), side(b, along_b, a + along_a)
    if sides_a == (0.0, 0.0) or sides_b == (0.0, 0.0):  # on one line: do they overlap?
        low = np.maximum(np.minimum(a, a + along_a), np.minimum(b, b + along_b))
        high = np.minimum(np.maximum(a, a + along_a), np.maximum(b, b + along_b))
        return bool((low <= high).all())
    return sides_a[0] * sides_a[1] <= 0 and sides_b[0] * sides_b[1] <= 0


def extent(outline: Outline) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner of the bounding box [cells], each shape (2,)."""
    if outline.kind == "circle":
        return np.full(2, -outline.radius), np.full(2, outline.radius)
    corners = _corners(outline)
    return corners.min(axis=0), corners.max(axis=0)


def centroid(outline: Outline) -> np.ndarray:
    """Centre of area [cells], shape (2,)."""
    if outline.kind == "circle":
        return np.zeros(2)
    a = _corners(outline)
    b = np.roll(a, -1, axis=0)
    cross = a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1]
    return ((a + b) * cross[:, None]).sum(axis=0) / (6.0 * _signed_area(a))


def signed_distance(outline: Outline, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Exact distance to the outline and outward unit normal at ``points`` (n, 2); shapes (n,), (n, 2).

    On the outline itself, and where the nearest point is not unique, the normal is one of the valid ones.
    """
    if outline.kind == "circle":
        radius = np.linalg.norm(points, axis=1)
        upward = np.tile([0.0, 1.0], (len(points), 1))  # at the centre, where every direction is nearest
        outward = np.divide(points, radius[:, None], out=upward, where=radius[:, None] > 0)
        return radius - outline.radius, outward
    return _polygon_distance(_corners(outline), points)


def _corners(outline: Outline) -> np.ndarray:
    """Corners of a polygon as an array (k, 2)."""
    return np.asarray(outline.points, dtype=float)


def _signed_area(corners: np.ndarray) -> float:
    """Positive where the corners run counter-clockwise."""
    x, y = corners.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _polygon_distance(corners: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance to the nearest edge or corner, its sign by crossing number."""
    start, end = corners, np.roll(corners, -1, axis=0)
    best = np.full(len(points), np.inf)
    nearest = np.zeros_like(points)
    edge_normal = np.zeros_like(points)
    inside = np.zeros(len(points), dtype=bool)
    turn = np.sign(_signed_area(corners))
    for a, b in zip(start, end, strict=True):
        edge = b - a
        t = np.clip((points - a) @ edge / (edge @ edge), 0.0, 1.0)
        foot = a + t[:, None] * edge
        squared = ((points - foot) ** 2).sum(axis=1)
        closer = squared < best
        best = np.where(closer, squared, best)
        nearest[closer] = foot[closer]
        edge_normal[closer] = turn * np.array([edge[1], -edge[0]]) / np.linalg.norm(edge)
        spans = (a[1] > points[:, 1]) != (b[1] > points[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = a[0] + (points[:, 1] - a[1]) / edge[1] * edge[0]
        inside ^= spans & (points[:, 0] < crossing)
    distance = np.sqrt(best)
    away = np.where(inside[:, None], nearest - points, points - nearest)
    normal = np.where(distance[:, None] > 1e-12, away / np.maximum(distance, 1e-300)[:, None], edge_normal)
    return np.where(inside, -distance, distance), normal
