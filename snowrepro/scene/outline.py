"""Geometry of closed outlines: area, centroid, extent, signed distance and outward normal.

An outline is a loop of straight edges and circular arcs.  An arc is an edge with a bulge, the tangent
of a quarter of its angle, as in the DXF format: 1 is a half circle, 0 is straight, and a positive one
turns left, so that it lies on the right of its chord.
Distances are negative inside.  No bit depends on which corner comes first or on the direction in
which the corners run.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from ..settings.case import Outline

TIE = 1e-9  # distances that differ by less are equal [cells]
FLAT = 1e-3  # how far a polyline may lie from its arc [cells]
SHARPEST = 5.0  # angle between two edges at a corner [degrees]


@dataclass(frozen=True)
class Loop:
    """Edges from ``start`` (k, 2) to ``end`` (k, 2) with ``bulge`` (k,), counter-clockwise [cells].

    For arcs, ``centre`` (k, 2) and ``radius`` (k,), nan where an edge is straight; ``right`` (k, 2)
    is the unit normal on the right of the chord, which points outward.
    """

    start: np.ndarray
    end: np.ndarray
    bulge: np.ndarray
    centre: np.ndarray
    radius: np.ndarray
    right: np.ndarray


def loop_of(outline: Outline) -> Loop:
    """The outline as edges, counter-clockwise from its leftmost corner."""
    corners = _corners(outline)
    if _signed_area(_loop(corners)) < 0:
        # Edge i runs from corner i: backwards, its bulge belongs to the corner that it ended in.
        corners = np.column_stack([corners[:, :2], -np.roll(corners[:, 2], 1)])[::-1]
    first = np.lexsort((corners[:, 1], corners[:, 0]))[0]
    return _loop(np.roll(corners, -first, axis=0))


def area(outline: Outline) -> float:
    """Area [cells^2]."""
    return _signed_area(loop_of(outline))


def centroid(outline: Outline) -> np.ndarray:
    """Centre of area [cells], shape (2,)."""
    loop = loop_of(outline)
    a, b = loop.start, loop.end
    moment = ((a + b) * _cross(a, b)[:, None]).sum(axis=0) / 6.0
    curved = loop.bulge != 0
    chord = np.linalg.norm(b - a, axis=1)[curved, None]
    caps = _cap_areas(loop)[curved, None] * loop.centre[curved] + chord**3 / 12.0 * loop.right[curved]
    return (moment + caps.sum(axis=0)) / _signed_area(loop)


def extent(outline: Outline) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner of the bounding box [cells], each shape (2,)."""
    loop = loop_of(outline)
    points = [loop.start]
    for direction in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
        arms = loop.radius[:, None] * np.array(direction)
        points.append((loop.centre + arms)[_on_arc(loop, arms)])
    stacked = np.concatenate(points)
    return stacked.min(axis=0), stacked.max(axis=0)


def polyline(outline: Outline) -> np.ndarray:
    """Corners (m, 2) of a polygon that follows the outline within FLAT."""
    loop = loop_of(outline)
    pieces = []
    for a, bulge, centre, radius in zip(loop.start, loop.bulge, loop.centre, loop.radius, strict=True):
        if bulge == 0:
            pieces.append(a[None])
            continue
        angle = 4.0 * np.arctan(bulge)
        count = int(np.ceil(abs(angle) / (2.0 * np.arccos(1.0 - min(FLAT / radius, 0.5)))))
        turn = np.linspace(0.0, angle, count, endpoint=False)
        arm = a - centre
        around = np.outer(np.cos(turn), arm) + np.outer(np.sin(turn), [-arm[1], arm[0]])
        pieces.append(centre + around)
    return np.concatenate(pieces)


def flaw(outline: Outline) -> str | None:
    """What makes an outline unusable: a repeated or too sharp corner, no area, a crossing; None if nothing does."""
    corners = _corners(outline)
    size = float(np.ptp(corners[:, :2], axis=0).max())
    gaps = np.abs(corners[:, :2] - np.roll(corners[:, :2], -1, axis=0)).max(axis=1)
    if (gaps <= 1e-9 * size).any():
        repeated = int(np.argmin(gaps)) + 1
        return f"corner {repeated} is repeated by the next (an outline closes by itself)"
    ring = shapely.Polygon(polyline(outline))
    if ring.convex_hull.area <= 1e-9 * size**2:
        return "it has no area"
    if not ring.is_valid:
        place = shapely.is_valid_reason(ring).partition("[")[2].rstrip("]").split()  # "Self-intersection[20 20]"
        return f"it crosses or touches itself near ({', '.join(place)})"
    loop = loop_of(outline)
    tangent_end, tangent_start = _tangents(loop)
    onward = np.linalg.norm(np.roll(tangent_end, 1, axis=0) + tangent_start, axis=1)
    if onward.min() < 2.0 * np.sin(np.radians(SHARPEST / 2.0)):
        x, y = loop.start[onward.argmin()]
        return f"its corner at ({x:g}, {y:g}) is sharper than {SHARPEST:g} degrees"
    return None


def signed_distance(outline: Outline, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Exact distance to the outline and outward unit normal at ``points`` (n, 2); shapes (n,), (n, 2).

    Where several places of the outline are nearest, the normal is the mean of theirs.
    """
    nearest = np.full(len(points), np.inf)
    normal = np.zeros_like(points)
    inside = np.zeros(len(points), dtype=bool)
    for foot, face, valid in _feet(loop_of(outline), points):
        away = points - foot
        distance = np.where(valid, np.hypot(away[:, 0], away[:, 1]), np.inf)
        behind = (away * face).sum(axis=1) < 0
        sign = np.where(behind, -1.0, 1.0)
        # On the outline the direction away is round-off: take its own normal there.
        outward = np.where((distance > TIE)[:, None], (sign / np.maximum(distance, TIE))[:, None] * away, face)
        inside = np.where(distance < nearest, behind, inside)
        nearest, normal = nearer(nearest, normal, distance, outward)
    return np.where(inside, -nearest, nearest), unit(normal)


def nearer(
    distance: np.ndarray, normal: np.ndarray, other: np.ndarray, other_normal: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The nearer of two surfaces, point by point; the sum of their normals where they are equally near.

    A sum that cancels keeps the first normal.
    """
    tie = np.isfinite(other) & (np.abs(other - distance) <= TIE)
    both = normal + other_normal
    keeps = np.hypot(both[:, 0], both[:, 1]) < 1e-6
    summed = np.where(keeps[:, None], normal, both)
    closer = ~tie & (other < distance)
    chosen = np.where(tie[:, None], summed, np.where(closer[:, None], other_normal, normal))
    return np.minimum(distance, other), chosen


def unit(vectors: np.ndarray) -> np.ndarray:
    """Each of ``vectors`` (n, 2) at length one."""
    return vectors / np.hypot(vectors[:, 0], vectors[:, 1])[:, None]


def gap_above(body: Outline, ground: Outline, aside: float) -> float:
    """How far ``body``, shifted ``aside``, could sink before it met the highest part of ``ground`` below it.

    Negative if it has to rise; inf if no ground is below.
    """
    upper, lower = polyline(body) + np.array([aside, 0.0]), polyline(ground)
    x = np.concatenate([upper[:, 0], lower[:, 0]])
    underside = _heights(upper, x, np.minimum, np.inf)
    surface = _heights(lower, x, np.maximum, -np.inf)
    return float((underside - surface).min())


def _heights(corners: np.ndarray, x: np.ndarray, extreme: np.ufunc, none: float) -> np.ndarray:
    """Lowest or highest point of a polygon at each ``x``; ``none`` where it has no point."""
    result = np.full(len(x), none)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        spans = (x >= min(a[0], b[0])) & (x <= max(a[0], b[0]))
        if a[0] == b[0]:
            height = extreme(a[1], b[1])
        else:
            height = a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1])
        result = np.where(spans, extreme(result, height), result)
    return result


def _corners(outline: Outline) -> np.ndarray:
    """Corners and bulges (k, 3) as given; a circle is two half circles."""
    if outline.radius is not None and outline.kind == "circle":
        (x, y), r = outline.centre, outline.radius
        return np.array([[x - r, y, 1.0], [x + r, y, 1.0]])
    return np.array([(*corner, 0.0)[:3] for corner in outline.points or ()])


def _loop(corners: np.ndarray) -> Loop:
    """Edges of corners (k, 3) in the order given."""
    start, bulge = corners[:, :2], corners[:, 2]
    end = np.roll(start, -1, axis=0)
    along = end - start
    chord = np.hypot(along[:, 0], along[:, 1])
    safe = np.where(chord > 0, chord, 1.0)[:, None]
    right = np.column_stack([along[:, 1], -along[:, 0]]) / safe
    b = np.where(bulge == 0, np.nan, bulge)
    radius = chord * (1.0 + b**2) / (4.0 * np.abs(b))
    centre = 0.5 * (start + end) - (0.25 * chord * (1.0 - b**2) / b)[:, None] * right
    return Loop(start, end, bulge, centre, radius, right)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1]


def _cap_areas(loop: Loop) -> np.ndarray:
    """Signed area between each arc and its chord; zero where straight."""
    angle = 4.0 * np.arctan(loop.bulge)
    return np.where(loop.bulge == 0, 0.0, 0.5 * loop.radius**2 * (angle - np.sin(angle)))


def _signed_area(loop: Loop) -> float:
    """Positive where the edges run counter-clockwise."""
    return float(0.5 * _cross(loop.start, loop.end).sum() + _cap_areas(loop).sum())


def _on_arc(loop: Loop, arms: np.ndarray) -> np.ndarray:
    """Whether arm i, from the centre of edge i, points to its arc; False where the edge is straight."""
    middle = np.sign(loop.bulge)[:, None] * loop.right
    return _in_sector(arms, middle, loop.bulge)


def _in_sector(arms: np.ndarray, middle: np.ndarray, bulge: np.ndarray | float) -> np.ndarray:
    """Whether ``arms`` (n, 2) point to an arc: the cosine to its ``middle`` against that of half its angle."""
    half = (1.0 - bulge**2) / (1.0 + bulge**2)
    return (arms * middle).sum(axis=-1) >= np.hypot(arms[..., 0], arms[..., 1]) * half - TIE


def _feet(loop: Loop, points: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray | bool]]:
    """For each corner and edge: its nearest place to each point, the outward normal there, and where it counts.

    An edge counts where its nearest place lies between its ends, a corner everywhere.
    """
    tangent_end, tangent_start = _tangents(loop)
    for i, (a, b) in enumerate(zip(loop.start, loop.end, strict=True)):
        mean = tangent_start[i] + tangent_end[i - 1]
        yield a, np.array([mean[1], -mean[0]]), True
        if loop.bulge[i] == 0:
            along = b - a
            t = ((points - a) * along).sum(axis=1) / (along**2).sum()
            yield a + t[:, None] * along, loop.right[i], (t > 0) & (t < 1)
        else:
            arms = points - loop.centre[i]
            length = np.hypot(arms[:, 0], arms[:, 1])[:, None]
            side = np.sign(loop.bulge[i])
            middle = side * loop.right[i]
            towards = np.where(length > TIE, arms / np.maximum(length, TIE), middle)
            foot = loop.centre[i] + loop.radius[i] * towards
            yield foot, side * towards, _in_sector(arms, middle, loop.bulge[i])


def _tangents(loop: Loop) -> tuple[np.ndarray, np.ndarray]:
    """Unit direction of each edge at its end and at its start, (k, 2) each."""
    chord = np.column_stack([-loop.right[:, 1], loop.right[:, 0]])
    half = 2.0 * np.arctan(loop.bulge)  # an arc leaves its chord at half its angle
    cos, sin = np.cos(half)[:, None], np.sin(half)[:, None]
    left = -loop.right
    return chord * cos + left * sin, chord * cos - left * sin
