"""Areas in the plane: from closed curves, fill rules and strokes to the corners of an outline."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Geometry, Polygon

from ..settings.case import MOST_CORNERS

TOLERANCE = 0.02  # of the outline [cells]
DECIMALS = 4  # of the corners, so that a run's identity does not hang on round-off
MOST_POINTS = 200_000  # of all curves of a drawing
MOST_MEETINGS = 200_000  # pairs of edges that may cross
MOST_COMPARISONS = 100_000_000  # of faces with edges
ARC_STEPS = 16  # of a quarter of a round join or cap
NEEDLE = 5.0  # angle of a corner that is cut off: the smallest that a scene takes [degrees]
MOST_CUTS = 8  # of one needle
FINEST = 1e-3  # detail of a line that counts [its width]
SMOOTH = 3.0  # a turn below this needs no mitre [degrees]

Curve = tuple[tuple[float, float], ...]


@dataclass
class Effort:
    """How much work a drawing may still make; what is asked for beyond that is refused before it is done."""

    points: int = MOST_POINTS
    meetings: int = MOST_MEETINGS
    comparisons: int = MOST_COMPARISONS

    def use_points(self, count: int) -> None:
        """Take ``count`` points along curves.  Raises ValueError if there are not so many left."""
        self.points -= count
        if self.points < 0:
            raise ValueError(f"it has more than {MOST_POINTS:,} points along its curves: simplify it")

    def use_meetings(self, edges: np.ndarray, margin: float = 0.0) -> None:
        """Take the pairs of edges (n, 2, 2) that may come nearer to each other than ``margin``, likewise."""
        boxes = shapely.box(*(edges.min(axis=1) - margin).T, *(edges.max(axis=1) + margin).T)
        tree, pairs = shapely.STRtree(boxes), -8 * len(boxes)  # each edge meets itself and its neighbours
        for first in range(0, len(boxes), 16):
            pairs += tree.query(boxes[first : first + 16]).shape[1]
            if pairs > self.meetings:
                raise ValueError("too many of its edges may cross or touch each other: simplify it")
        self.meetings -= max(pairs, 0)

    def use_comparisons(self, faces: int, edges: int) -> None:
        """Take the comparisons of the faces between curves with their edges, likewise."""
        self.comparisons -= faces * edges
        if self.comparisons < 0:
            raise ValueError("its curves divide the plane into too many areas: simplify it")


def fill(curves: Sequence[np.ndarray], rule: str, effort: Effort) -> Geometry:
    """The area that closed curves, each (n, 2), fill by the rule "nonzero" or "evenodd" of SVG.

    Raises ValueError if that takes more effort than is left.
    """
    rings = [ring for ring in map(without_repeats, curves) if len(ring) > 2]
    if not rings:
        return Polygon()
    if len(rings) == 1 and (polygon := Polygon(rings[0])).is_valid:
        return polygon
    ends = np.concatenate([np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings])
    effort.use_meetings(ends)
    lines = shapely.unary_union([shapely.LinearRing(ring) for ring in rings])
    faces = shapely.get_parts(shapely.polygonize([lines]))
    effort.use_comparisons(len(faces), len(ends))
    winding = _winding(rings, shapely.get_coordinates(shapely.point_on_surface(faces)))
    return shapely.coverage_union_all(faces[winding % 2 == 1 if rule == "evenodd" else winding != 0])


@dataclass(frozen=True)
class Pen:
    """How a line is drawn: its width, and its ends and corners as SVG names them."""

    width: float
    cap: str
    join: str
    mitre_limit: float


def stroke(curve: np.ndarray, is_closed: bool, pen: Pen, effort: Effort) -> Geometry:
    """The area of a line along a curve (n, 2).  Raises ValueError if that takes more effort than is left."""
    points, half = without_repeats(curve, is_closed), 0.5 * pen.width
    cap = {"butt": "flat"}.get(pen.cap, pen.cap)
    if len(points) == 1:
        dot = shapely.Point(points[0])
        return Polygon() if cap == "flat" else dot.buffer(half, quad_segs=ARC_STEPS, cap_style=cap)
    is_ring = is_closed and len(points) > 2
    points = _straightened(points, is_ring, FINEST * pen.width)
    effort.use_meetings(np.stack([points[:-1], points[1:]], axis=1), half)
    line = shapely.LinearRing(points) if is_ring else shapely.LineString(points)
    join = "round" if pen.join == "round" else "bevel"
    body = line.buffer(half, quad_segs=ARC_STEPS, cap_style=cap, join_style=join)
    tips = _mitres(points, is_ring, half, pen.mitre_limit) if pen.join == "miter" else []
    return shapely.union_all([body, *tips]) if tips else body


def unite(areas: Sequence[Geometry], effort: Effort) -> Geometry:
    """The area that is in at least one of some.  Raises ValueError if that takes more effort than is left."""
    if len(areas) == 1:
        return areas[0]
    effort.use_meetings(edges_of(areas))
    return shapely.union_all(areas)


def edges_of(areas: Sequence[Geometry]) -> np.ndarray:
    """The edges (n, 2, 2) around areas."""
    rings = shapely.get_rings(shapely.get_parts(areas))
    corners, ring = shapely.get_coordinates(rings, return_index=True)
    edges = np.stack([corners[:-1], corners[1:]], axis=1)
    return edges[ring[1:] == ring[:-1]]


def outline_of(area: Geometry, width: float) -> list[Curve]:
    """The curves around an area with y running down: upright, ``width`` cells wide, from the origin.

    The largest curve comes first.  Corners that TOLERANCE can spare are left out.  Raises ValueError if the area
    has no width.
    """
    bodies = [part for part in shapely.get_parts(area) if isinstance(part, Polygon) and part.area > 0]
    corners = shapely.get_coordinates(bodies) * [1.0, -1.0]
    span = np.ptp(corners[:, 0]) if len(corners) else 0.0
    if span <= 0:
        raise ValueError("the outline has no width")
    low, scale = corners.min(axis=0), width / span

    def to_cells(points: np.ndarray) -> np.ndarray:
        return (points * [1.0, -1.0] - low) * scale

    if len(bodies) == 1 and not bodies[0].interiors:
        return [_rounded(_blunted(_thinned(to_cells(shapely.get_coordinates(bodies[0])[:-1]))))]
    thinned = shapely.simplify(shapely.transform(shapely.MultiPolygon(bodies), to_cells), TOLERANCE)
    snapped = shapely.set_precision(thinned, 10.0**-DECIMALS)  # closes what gaps are thinner than that
    rings = shapely.get_rings(shapely.get_parts(snapped))
    sizes = shapely.area(shapely.polygons(rings))
    kept = [i for i in np.argsort(-sizes, kind="stable") if sizes[i] > TOLERANCE**2]
    if not kept:
        raise ValueError("the outline has no area")
    corners = int(shapely.get_num_coordinates(rings[kept]).sum()) - len(kept)
    if corners > MOST_CORNERS:
        raise ValueError(f"its outline has {corners:,} corners; at most {MOST_CORNERS:,} are allowed: simplify it")
    return [_rounded(_blunted(shapely.get_coordinates(rings[i])[:-1])) for i in kept]


def without_repeats(points: np.ndarray, is_closed: bool = True) -> np.ndarray:
    """Points (n, 2) without those that repeat the one before; of a closed curve the last does not repeat the first."""
    keep = np.ones(len(points), dtype=bool)
    keep[1:] = (points[1:] != points[:-1]).any(axis=1)
    kept = points[keep]
    return kept[:-1] if is_closed and len(kept) > 1 and (kept[0] == kept[-1]).all() else kept


def _straightened(points: np.ndarray, is_ring: bool, tolerance: float) -> np.ndarray:
    """Points (n, 2) of a line without those that a tolerance can spare; all of a ring that it would spare."""
    line = shapely.LinearRing(points) if is_ring else shapely.LineString(points)
    kept = shapely.get_coordinates(line.simplify(tolerance, preserve_topology=False))[: -1 if is_ring else None]
    return kept if len(kept) > (2 if is_ring else 1) else points


def _thinned(points: np.ndarray) -> np.ndarray:
    """Points (n, 2) of a closed curve without those that TOLERANCE can spare."""
    ring = shapely.LinearRing(points)
    return shapely.get_coordinates(ring.simplify(TOLERANCE) if len(points) > 3 else ring)[:-1]


def _blunted(points: np.ndarray) -> np.ndarray:
    """Points (n, 2) of a closed curve whose needles, which a scene would refuse, end where they are TOLERANCE wide."""
    for _ in range(MOST_CUTS):
        to_last, to_next = np.roll(points, 1, axis=0) - points, np.roll(points, -1, axis=0) - points
        last, following = np.hypot(*to_last.T), np.hypot(*to_next.T)
        cosine = (to_last * to_next).sum(axis=1) / (last * following)
        sharp = cosine > np.cos(np.radians(NEEDLE))
        if not sharp.any():
            break
        back = TOLERANCE / np.radians(NEEDLE)
        before = points + to_last * np.minimum(0.5, back / last)[:, None]
        after = points + to_next * np.minimum(0.5, back / following)[:, None]
        twice = np.stack([np.where(sharp[:, None], before, points), after], axis=1).reshape(-1, 2)
        points = twice[np.column_stack([np.ones_like(sharp), sharp]).ravel()]
    return points


def _rounded(points: np.ndarray) -> Curve:
    """Points as corners of a configuration; what rounding makes equal to its neighbour is left out."""
    corners = [(round(x, DECIMALS), round(y, DECIMALS)) for x, y in points.tolist()]
    return tuple(corner for i, corner in enumerate(corners) if corner != corners[i - 1])


def _winding(rings: Sequence[np.ndarray], points: np.ndarray) -> np.ndarray:
    """How often the rings go around each of ``points`` (n, 2), shape (n,).

    Counted along a ray to the right: an edge that goes up crosses it once, one that goes down back.
    """
    starts = np.concatenate(rings)
    ends = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
    (x0, y0), (x1, y1) = starts.T, ends.T
    winding = np.zeros(len(points), dtype=int)
    for i, (x, y) in enumerate(points):
        up, down = (y0 <= y) & (y1 > y), (y1 <= y) & (y0 > y)
        side = (x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)  # above zero left of the edge
        winding[i] = np.count_nonzero(up & (side > 0)) - np.count_nonzero(down & (side < 0))
    return winding


def _mitres(points: np.ndarray, is_ring: bool, half: float, limit: float) -> list[Polygon]:
    """The tips outside of a line's corners that are no sharper than the limit of mitres allows."""
    before, after = (np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)) if is_ring else (points[:-2], points[2:])
    at = points if is_ring else points[1:-1]
    tips = []
    for corner, arriving, leaving in zip(at, at - before, after - at, strict=True):
        one, other = arriving / np.hypot(*arriving), leaving / np.hypot(*leaving)
        turn = np.arctan2(one[0] * other[1] - one[1] * other[0], one @ other)
        reach = np.cos(0.5 * turn)  # half the width over the length of the mitre
        if abs(turn) < np.radians(SMOOTH) or reach * limit < 1.0:
            continue
        outward = -np.sign(turn) * half
        sides = [corner + outward * np.array([-way[1], way[0]]) for way in (one, other)]
        tip = corner + (sides[0] + sides[1] - 2.0 * corner) / (2.0 * reach**2)
        tips.append(Polygon([corner, sides[0], tip, sides[1]]))
    return tips
