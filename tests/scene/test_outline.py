"""Outlines: area, centroid, distance and normal against brute force, and what makes them unusable."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from snowrepro.scene import outline as geometry
from snowrepro.settings.case import Outline

HALF = 1.0  # bulge of a half circle
QUARTER = np.tan(np.pi / 8)


def polygon(corners) -> Outline:
    return Outline(kind="polygon", points=tuple(tuple(map(float, corner)) for corner in corners))


def star_shaped(radii, bulges=0.0) -> np.ndarray:
    """Corners at equal angles and given radii, with the bulges of the edges: (k, 3)."""
    angles = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
    bulge = np.broadcast_to(bulges, angles.shape)
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles), bulge])


def turned(corners: np.ndarray, first: int, reverse: bool) -> np.ndarray:
    """The same outline from another corner on, or the other way round."""
    if reverse:
        corners = np.column_stack([corners[:, :2], -np.roll(corners[:, 2], 1)])[::-1]
    return np.roll(corners, first, axis=0)


def edge(a: np.ndarray, b: np.ndarray, bulge: float, count: int) -> np.ndarray:
    """Points on an edge; an arc as the circle through both ends and the tip of its sagitta."""
    t = np.linspace(0, 1, count)[:, None]
    if bulge == 0:
        return a + t * (b - a)
    chord = b - a
    tip = (a + b) / 2 + bulge / 2 * np.array([chord[1], -chord[0]])
    matrix = 2 * np.array([b - a, tip - a])
    centre = np.linalg.solve(matrix, [b @ b - a @ a, tip @ tip - a @ a])
    start, end = (np.arctan2(*(p - centre)[::-1]) for p in (a, b))
    sweep = (end - start) % (2 * np.pi) if bulge > 0 else -((start - end) % (2 * np.pi))
    angle = start + t * sweep
    return centre + np.linalg.norm(a - centre) * np.concatenate([np.cos(angle), np.sin(angle)], axis=1)


def brute_force(corners: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signed distance and normal from 3,000 points on each edge; the sign by winding number."""
    following = np.roll(corners, -1, axis=0)
    border = np.concatenate([edge(a[:2], b[:2], a[2], 3000) for a, b in zip(corners, following, strict=True)])
    nearest = np.array([border[((border - p) ** 2).sum(axis=1).argmin()] for p in points])
    distance = np.linalg.norm(points - nearest, axis=1)
    coarse = border[::30]
    angles = np.arctan2(*np.moveaxis(coarse[None] - points[:, None], -1, 0)[::-1])
    steps = np.diff(np.concatenate([angles, angles[:, :1]], axis=1), axis=1)
    winding = ((steps + np.pi) % (2 * np.pi) - np.pi).sum(axis=1)
    sign = np.where(np.abs(winding) > np.pi, -1.0, 1.0)
    return sign * distance, sign[:, None] * (points - nearest) / distance[:, None]


outlines = st.lists(st.tuples(st.floats(5, 30), st.sampled_from([0, 0, 0.3, -0.2, 0.05])), min_size=3, max_size=9)


@settings(deadline=None, max_examples=40)
@given(outlines, st.integers(0, 2**31))
def test_distance_and_normal_against_brute_force(spokes, seed):
    """Random polygons, some with arcs, at random points inside and out."""
    radii, bulges = np.array(spokes).T
    corners = star_shaped(radii, bulges)
    assume(geometry.flaw(polygon(corners)) is None)
    points = np.random.default_rng(seed).uniform(-40, 40, (60, 2))
    expected, expected_normal = brute_force(corners, points)
    clear = np.abs(expected) > 0.5  # nearer, the winding of a coarse border cannot tell the side
    distance, normal = geometry.signed_distance(polygon(corners), points[clear])
    np.testing.assert_allclose(distance, expected[clear], atol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-9)
    along = (normal * expected_normal[clear]).sum(axis=1)
    agree = along > 1 - 2e-3
    # Where they differ, a second place of the outline has to be as near: follow the normal back to it.
    foot = points[clear][~agree] - distance[~agree, None] * normal[~agree]
    back, _ = geometry.signed_distance(polygon(corners), foot)
    np.testing.assert_allclose(back, 0, atol=1e-2)


@settings(deadline=None, max_examples=40)
@given(outlines, st.integers(0, 8), st.booleans())
def test_order_of_the_corners_changes_no_bit(spokes, first, reverse):
    """Area, centroid, extent, distance and normal, on a lattice that holds bisectors and corners too."""
    radii, bulges = np.array(spokes).T
    corners = star_shaped(np.round(radii, 1), bulges)
    assume(geometry.flaw(polygon(corners)) is None)
    axis = np.linspace(-40, 40, 33)
    points = np.concatenate([np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2), corners[:, :2]])
    one, other = polygon(corners), polygon(turned(corners, first, reverse))
    assert geometry.area(one) == geometry.area(other)
    assert (geometry.centroid(one) == geometry.centroid(other)).all()
    for a, b in zip(geometry.extent(one), geometry.extent(other), strict=True):
        assert (a == b).all()
    for a, b in zip(geometry.signed_distance(one, points), geometry.signed_distance(other, points), strict=True):
        assert (a == b).all()


def test_area_centroid_and_extent():
    """A rectangle, a disc in three spellings, and a rectangle with a round lid."""
    rectangle = [(1, 1), (4, 1), (4, 3), (1, 3)]
    for corners in (rectangle, rectangle[::-1]):
        assert geometry.area(polygon(corners)) == pytest.approx(6)
        np.testing.assert_allclose(geometry.centroid(polygon(corners)), [2.5, 2])
    discs = (
        Outline(kind="circle", radius=2, centre=(5, 1)),
        polygon([(3, 1, HALF), (7, 1, HALF)]),
        polygon([(5, 3, QUARTER), (3, 1, QUARTER), (5, -1, QUARTER), (7, 1, QUARTER)]),
    )
    for disc in discs:
        assert geometry.area(disc) == pytest.approx(4 * np.pi)
        np.testing.assert_allclose(geometry.centroid(disc), [5, 1])
        np.testing.assert_allclose(geometry.extent(disc), [[3, -1], [7, 3]])
    lid = polygon([(0, 0), (4, 0), (4, 1, HALF), (0, 1)])
    assert geometry.area(lid) == pytest.approx(4 + 2 * np.pi)
    height = (4 * 0.5 + 2 * np.pi * (1 + 4 * 2 / (3 * np.pi))) / (4 + 2 * np.pi)
    np.testing.assert_allclose(geometry.centroid(lid), [2, height])
    np.testing.assert_allclose(geometry.extent(lid), [[0, 0], [4, 3]])


def test_normals_at_edges_corners_and_bisectors():
    """On the outline its own normal, at a corner the mean of both edges, on a bisector the mean of both sides."""
    valley = polygon([(0, 0), (4, 0), (4, 4), (2, 2), (0, 4)])
    points = np.array([[2.0, 0.0], [2.0, 2.0], [4.0, 0.0], [2.0, 3.0], [2.0, 5.0], [6.0, 2.0]])
    distance, normal = geometry.signed_distance(valley, points)
    d = np.sqrt(0.5)
    np.testing.assert_allclose(distance, [0, 0, 0, d, 3 * d, 2], atol=1e-12)
    np.testing.assert_allclose(normal, [[0, -1], [0, 1], [d, -d], [0, 1], [0, 1], [1, 0]], atol=1e-12)


def test_distance_inside_a_disc():
    """The centre is one radius deep, and has some normal."""
    distance, normal = geometry.signed_distance(Outline(kind="circle", radius=2), np.array([[0.0, 0], [1, 0], [0, 3]]))
    np.testing.assert_allclose(distance, [-2, -1, 1])
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1)
    np.testing.assert_allclose(normal[1:], [[1, 0], [0, 1]], atol=1e-12)


@settings(deadline=None, max_examples=50)
@given(st.lists(st.floats(0.5, 3.0), min_size=3, max_size=12), st.permutations(range(6)))
def test_only_crossing_outlines_are_flawed(radii, order):
    """Star-shaped outlines are sound; six corners of a hexagon in any order but around it cross."""
    flaw = geometry.flaw(polygon(star_shaped(np.array(radii))))
    assert flaw is None or "sharper than 5 degrees" in flaw
    hexagon = star_shaped(np.ones(6))[list(order)]
    steps = {(b - a) % 6 for a, b in zip(order, [*order[1:], order[0]], strict=True)}
    assert (geometry.flaw(polygon(hexagon)) is None) == (steps in ({1}, {5}))


def test_gap_above():
    """A disc over a wedge touches it at the slope, not at its lowest point."""
    disc = Outline(kind="circle", radius=1)
    ground = polygon([(0, 0), (10, 0), (10, 1), (0, 1)])
    assert geometry.gap_above(disc, ground, aside=5) == pytest.approx(-2)
    wedge = polygon([(0, 0), (10, 0), (0, 10)])
    assert geometry.gap_above(disc, wedge, aside=5) == pytest.approx(-5 - np.sqrt(2), abs=2e-3)
    assert geometry.gap_above(disc, ground, aside=20) == np.inf
