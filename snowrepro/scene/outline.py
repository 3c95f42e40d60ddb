"""Geometry of closed outlines: area, centroid, extent, signed distance and outward normal.

An outline is one or more loops of straight edges and circular arcs.  An arc is an edge with a bulge, the
tangent of a quarter of its angle, as in the DXF format: 1 is a half circle, 0 is straight, and a positive
one turns left, so that it lies on the right of its chord.  What lies in an odd number of loops is inside.
Distances are negative inside.  No bit depends on which corner or loop comes first or on the direction in
which the corners run.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from ..settings.case import Outline, Ring

TIE = 1e-9  # distances that differ by less are equal [cells]
FLAT = 1e-3  # how far a polyline may lie from its arc [cells]
FEW_EDGES = 64  # up to which all points are compared with all edges
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

    @cached_property
    def tangent_start(self) -> np.ndarray:
        """Unit direction of each edge at its start (k, 2)."""
        chord, cos, sin = self._turn
        return chord * cos + self.right * sin

    @cached_property
    def tangent_end(self) -> np.ndarray:
        """Unit direction of each edge at its end (k, 2)."""
        chord, cos, sin = self._turn
        return chord * cos - self.right * sin

    @cached_property
    def _turn(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Direction of each chord, and cosine and sine of the angle between it and its arc: half the arc's."""
        half = 2.0 * np.arctan(self.bulge)
        return np.column_stack([-self.right[:, 1], self.right[:, 0]]), np.cos(half)[:, None], np.sin(half)[:, None]


def loops_of(outline: Outline) -> list[Loop]:
    """The outline's curves as edges, each counter-clockwise from its leftmost corner, from left to right."""
    loops = [_upright_loop(_as_array(ring)) for ring in outline.curves]
    return sorted(loops, key=lambda loop: (*loop.start[0], *loop.end[0], _signed_area(loop)))


def fillings(loops: Sequence[Loop]) -> list[float]:
    """For each loop 1 if there is something in it, along its border, and -1 if it is a hole."""
    if len(loops) == 1:
        return [1.0]
    areas = [shapely.Polygon(_polyline(loop)) for loop in loops]
    tree = shapely.STRtree(areas)
    inner, outer = tree.query(areas, predicate="covered_by")
    around = np.bincount(inner[inner != outer], minlength=len(loops))
    return np.where(around % 2 == 0, 1.0, -1.0).tolist()


def area(outline: Outline) -> float:
    """Area [cells^2]."""
    loops = loops_of(outline)
    return sum(filling * _signed_area(loop) for filling, loop in zip(fillings(loops), loops, strict=True))


def centroid(outline: Outline) -> np.ndarray:
    """Centre of area [cells], shape (2,)."""
    loops = loops_of(outline)
    signed = list(zip(fillings(loops), loops, strict=True))
    moment = np.sum([filling * _moment(loop) for filling, loop in signed], axis=0)
    return moment / sum(filling * _signed_area(loop) for filling, loop in signed)


def extent(outline: Outline) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner of the bounding box [cells], each shape (2,)."""
    points = []
    for loop in loops_of(outline):
        points.append(loop.start)
        for direction in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
            arms = loop.radius[:, None] * np.array(direction)
            points.append((loop.centre + arms)[_on_arc(loop, arms)])
    stacked = np.concatenate(points)
    return stacked.min(axis=0), stacked.max(axis=0)


def polylines(outline: Outline) -> list[np.ndarray]:
    """Corners (m, 2) of polygons that follow the outline's loops within FLAT; holes run clockwise."""
    loops = loops_of(outline)
    followed = zip(fillings(loops), map(_polyline, loops), strict=True)
    return [corners if filling > 0 else corners[::-1] for filling, corners in followed]


def flaw(outline: Outline) -> str | None:
    """What makes an outline unusable: a repeated or too sharp corner, no area, a crossing; None if nothing does."""
    rings = [_as_array(ring) for ring in outline.curves]
    flaws = (f"{which}{flaw}" for which, ring in zip(_names(rings), rings, strict=True) if (flaw := _flaw_of(ring)))
    return next(flaws, None) or _flaw_between(outline)


def signed_distance(outline: Outline, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Exact distance to the outline and outward unit normal at ``points`` (n, 2); shapes (n,), (n, 2).

    Where several places of the outline are nearest, the normal is the mean of theirs.
    """
    loops = loops_of(outline)
    if len(loops) == 1:
        return _distance_to_loop(loops[0], points)
    nearest = np.full(len(points), np.inf)
    normal = np.zeros_like(points)
    inside = np.zeros(len(points), dtype=bool)
    for filling, loop in zip(fillings(loops), loops, strict=True):
        distance, outward = _distance_to_loop(loop, points)
        inside ^= distance < 0
        nearest, normal = nearer(nearest, normal, np.abs(distance), filling * outward)
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
    upper, lower = [corners + np.array([aside, 0.0]) for corners in polylines(body)], polylines(ground)
    x = np.concatenate([corners[:, 0] for corners in (*upper, *lower)])
    underside = _heights(upper, x, np.minimum, np.inf)
    surface = _heights(lower, x, np.maximum, -np.inf)
    return float((underside - surface).min())


def _heights(rings: Sequence[np.ndarray], x: np.ndarray, extreme: np.ufunc, none: float) -> np.ndarray:
    """Lowest or highest point of polygons at each ``x``; ``none`` where they have no point."""
    result = np.full(len(x), none)
    for a, b in (edge for corners in rings for edge in zip(corners, np.roll(corners, -1, axis=0), strict=True)):
        spans = (x >= min(a[0], b[0])) & (x <= max(a[0], b[0]))
        if a[0] == b[0]:
            height = extreme(a[1], b[1])
        else:
            height = a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1])
        result = np.where(spans, extreme(result, height), result)
    return result


def _as_array(ring: Ring) -> np.ndarray:
    """Corners and bulges (k, 3) as given."""
    return np.array([(*corner, 0.0)[:3] for corner in ring])


def _upright_loop(corners: np.ndarray) -> Loop:
    """Corners (k, 3) as edges, counter-clockwise from the leftmost."""
    if _signed_area(_loop(corners)) < 0:
        # Edge i runs from corner i: backwards, its bulge belongs to the corner that it ended in.
        corners = np.column_stack([corners[:, :2], -np.roll(corners[:, 2], 1)])[::-1]
    first = np.lexsort((corners[:, 1], corners[:, 0]))[0]
    return _loop(np.roll(corners, -first, axis=0))


def _polyline(loop: Loop) -> np.ndarray:
    """Corners (m, 2) of a polygon that follows a loop within FLAT."""
    return np.concatenate([line[:-1] for line in _edge_lines(loop)])


def _edge_lines(loop: Loop) -> list[np.ndarray]:
    """For each edge the corners (m, 2) of a line that follows it within FLAT, both its ends included."""
    lines = []
    for a, b, bulge, centre, radius in zip(loop.start, loop.end, loop.bulge, loop.centre, loop.radius, strict=True):
        if bulge == 0:
            lines.append(np.stack([a, b]))
            continue
        angle = 4.0 * np.arctan(bulge)
        count = int(np.ceil(abs(angle) / (2.0 * np.arccos(1.0 - min(FLAT / radius, 0.5)))))
        turn = np.linspace(0.0, angle, count, endpoint=False)
        arm = a - centre
        around = np.outer(np.cos(turn), arm) + np.outer(np.sin(turn), [-arm[1], arm[0]])
        lines.append(np.concatenate([centre + around, b[None]]))
    return lines


def _names(rings: Sequence[np.ndarray]) -> list[str]:
    """What a message calls each curve: nothing where there is but one."""
    return [""] if len(rings) == 1 else [f"curve {number} of {len(rings)}: " for number in range(1, len(rings) + 1)]


def _flaw_of(corners: np.ndarray) -> str | None:
    """What makes one curve of corners (k, 3) unusable."""
    size = float(np.ptp(corners[:, :2], axis=0).max())
    gaps = np.abs(corners[:, :2] - np.roll(corners[:, :2], -1, axis=0)).max(axis=1)
    if (gaps <= 1e-9 * size).any():
        repeated = int(np.argmin(gaps)) + 1
        return f"corner {repeated} is repeated by the next (an outline closes by itself)"
    ring = shapely.Polygon(_polyline(_upright_loop(corners)))
    if ring.convex_hull.area <= 1e-9 * size**2:
        return "it has no area"
    if not ring.is_valid:
        place = shapely.is_valid_reason(ring).partition("[")[2].rstrip("]").split()  # "Self-intersection[20 20]"
        return f"it crosses or touches itself near ({', '.join(place)})"
    loop = _upright_loop(corners)
    onward = np.linalg.norm(np.roll(loop.tangent_end, 1, axis=0) + loop.tangent_start, axis=1)
    if onward.min() < 2.0 * np.sin(np.radians(SHARPEST / 2.0)):
        x, y = loop.start[onward.argmin()]
        return f"its corner at ({x:g}, {y:g}) is sharper than {SHARPEST:g} degrees"
    return None


def _flaw_between(outline: Outline) -> str | None:
    """What two curves of an outline have to do with each other that they must not; they may touch in points."""
    areas = [shapely.Polygon(corners) for corners in map(_polyline, loops_of(outline))]
    one, other = shapely.STRtree(areas).query(areas, predicate="intersects")
    for i, j in zip(one[one < other], other[one < other], strict=True):
        shared = areas[i].exterior.intersection(areas[j].exterior)
        if areas[i].overlaps(areas[j]) or areas[i].equals(areas[j]) or shared.length > 0:
            x, y = shared.representative_point().coords[0]
            return f"two of its curves cross or run along each other near ({x:g}, {y:g})"
    return None


def _distance_to_loop(loop: Loop, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signed distance and outward normal of one loop, as of an outline that has no other."""
    nearest = np.full(len(points), np.inf)
    normal = np.zeros_like(points)
    inside = np.zeros(len(points), dtype=bool)
    for i, near in enumerate(_points_near_edges(loop, points)):
        for foot, face, valid in _feet(loop, i, points[near]):
            away = points[near] - foot
            distance = np.where(valid, np.hypot(away[:, 0], away[:, 1]), np.inf)
            behind = (away * face).sum(axis=1) < 0
            sign = np.where(behind, -1.0, 1.0)
            # On the outline the direction away is round-off: take its own normal there.
            outward = np.where((distance > TIE)[:, None], (sign / np.maximum(distance, TIE))[:, None] * away, face)
            inside[near] = np.where(distance < nearest[near], behind, inside[near])
            nearest[near], normal[near] = nearer(nearest[near], normal[near], distance, outward)
    return np.where(inside, -nearest, nearest), unit(normal)


def _points_near_edges(loop: Loop, points: np.ndarray) -> Sequence[np.ndarray | slice]:
    """For each edge the indices of those points that it, or its first corner, may be nearest to.

    The result of a search where there are many edges; all points where there are few.
    """
    if len(loop.bulge) <= FEW_EDGES:
        return [slice(None)] * len(loop.bulge)
    tree = shapely.STRtree([shapely.LineString(corners) for corners in _edge_lines(loop)])
    spots = shapely.points(points)
    (spot, _), distance = tree.query_nearest(spots, return_distance=True, all_matches=False)
    reach = np.full(len(points), np.inf)
    reach[spot] = distance + 3.0 * FLAT
    spot, edge = tree.query(spots, predicate="dwithin", distance=reach)
    order = np.lexsort((spot, edge))
    near = np.split(spot[order], np.searchsorted(edge[order], np.arange(1, len(loop.bulge))))
    return [np.union1d(near[i - 1], near[i]) for i in range(len(near))]


def _moment(loop: Loop) -> np.ndarray:
    """Integral of (x, y) over the area in a loop, shape (2,)."""
    a, b = loop.start, loop.end
    moment = ((a + b) * _cross(a, b)[:, None]).sum(axis=0) / 6.0
    curved = loop.bulge != 0
    chord = np.linalg.norm(b - a, axis=1)[curved, None]
    caps = _cap_areas(loop)[curved, None] * loop.centre[curved] + chord**3 / 12.0 * loop.right[curved]
    return moment + caps.sum(axis=0)


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


def _feet(loop: Loop, i: int, points: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray | bool]]:
    """Of edge i and its first corner: the nearest place to each point, the outward normal there, and where it counts.

    An edge counts where its nearest place lies between its ends, a corner everywhere.
    """
    a, b = loop.start[i], loop.end[i]
    mean = loop.tangent_start[i] + loop.tangent_end[i - 1]
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
