"""Outlines of several curves: holes, several bodies, islands in holes, of snow and of floors."""

import re

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.scene import outline as geometry
from snowrepro.scene.build import build_scene, sample
from snowrepro.settings.case import Outline
from snowrepro.store.identity import run_id

SQUARE = [(0, 0), (60, 0), (60, 60), (0, 60)]
HOLE = [(10, 10), (50, 10), (50, 50), (10, 50)]
ISLAND = [(20, 20), (40, 20), (30, 40)]
FAR = [[0, 880], [9, 880], [0, 889]]
BESIDE = [(70, 0), (80, 0), (80, 30), (70, 30)]


def outlined(*rings) -> Outline:
    first, *others = [tuple(tuple(map(float, corner)) for corner in ring) for ring in rings]
    return Outline(kind="polygon", points=first, rings=tuple(others) or None)


def area_of(*rings) -> shapely.Geometry:
    """The same by the even-odd rule, with shapely."""
    area = shapely.Polygon()
    for ring in rings:
        area = area.symmetric_difference(shapely.Polygon(ring))
    return area


CASES = [
    (SQUARE, HOLE),
    (SQUARE, HOLE, ISLAND),
    (SQUARE, HOLE, ISLAND, BESIDE),
    (SQUARE, BESIDE),
    (SQUARE, [(60, 60), (90, 60), (90, 90)]),  # two bodies that touch in a point
    (SQUARE, [(0, 60), (40, 20), (50, 40)]),  # a hole that touches the outer corner
]


@pytest.mark.parametrize("rings", CASES)
@settings(deadline=None, max_examples=10)
@given(seed=st.integers(0, 2**31))
def test_against_shapely(rings, seed):
    """Area, centre, size, distance and its sign."""
    outline, area = outlined(*rings), area_of(*rings)
    assert geometry.flaw(outline) is None
    assert geometry.area(outline) == pytest.approx(area.area)
    np.testing.assert_allclose(geometry.centroid(outline), area.centroid.coords[0])
    np.testing.assert_allclose(np.ravel(geometry.extent(outline)), area.bounds)
    points = np.random.default_rng(seed).uniform(-20, 110, (300, 2))
    distance, normal = geometry.signed_distance(outline, points)
    spots = shapely.points(points)
    expected = shapely.distance(area.boundary, spots) * np.where(shapely.contains(area, spots), -1, 1)
    np.testing.assert_allclose(distance, expected, atol=1e-9)
    step = 1e-6  # outward: the distance grows along the normal
    beyond, _ = geometry.signed_distance(outline, points + step * normal)
    clear = np.abs(distance) > 1e-3
    growth = ((beyond - distance) / step)[clear]
    assert np.mean(np.abs(growth - 1) < 1e-3) > 0.97  # but where two places are as near


@pytest.mark.parametrize("rings", CASES)
def test_no_bit_depends_on_the_order_of_curves(rings):
    points = np.stack(np.meshgrid(np.linspace(-10, 100, 45), np.linspace(-10, 100, 45)), axis=-1).reshape(-1, 2)
    one, other = outlined(*rings), outlined(*[np.roll(ring[::-1], 1, axis=0) for ring in rings[::-1]])
    assert geometry.area(one) == geometry.area(other)
    assert (geometry.centroid(one) == geometry.centroid(other)).all()
    for a, b in zip(geometry.signed_distance(one, points), geometry.signed_distance(other, points), strict=True):
        assert (a == b).all()


def test_a_curve_of_many_edges_has_the_distance_of_all_of_them(monkeypatch):
    """The search for the near edges changes no bit."""
    angle = np.linspace(0, 2 * np.pi, 150, endpoint=False)
    radius = 30 + 4 * np.sin(7 * angle)
    bulge = np.where(np.arange(150) % 5 == 0, 0.3, 0.0)
    wavy = outlined(np.column_stack([radius * np.cos(angle), radius * np.sin(angle), bulge]))
    points = np.random.default_rng(4).uniform(-50, 50, (4000, 2))
    searched = geometry.signed_distance(wavy, points)
    monkeypatch.setattr(geometry, "FEW_EDGES", 1000)
    for a, b in zip(searched, geometry.signed_distance(wavy, points), strict=True):
        assert (a == b).all()


@pytest.mark.parametrize("rings", CASES)
def test_snow_fills_bodies_and_leaves_holes(rings):
    outline, area = outlined(*rings), area_of(*rings)
    places, depth = sample(outline, 1.0, 4, seed=3)
    assert len(places) == round(area.area * 4)
    assert depth.min() > -0.15
    assert shapely.distance(area, shapely.points(places)).max() < 0.15
    for body in shapely.get_parts(area):  # each gets its share
        inside = shapely.contains(body.buffer(0.2), shapely.points(places)).sum()
        assert inside == pytest.approx(4 * body.area, rel=0.05)


def test_scene_of_a_ring_over_a_floor_with_a_cave():
    """Mass is density times area; a node in the cave is outside of the floor, one in its roof inside."""
    case = compose(
        [
            *("+shape.outline.rings=[[[-10,0,1],[10,0,1]]]", "floor.width=200", "floor.drop_x=100"),
            "floor.outline.points=[[0,0],[200,0],[200,40],[0,40]]",
            "+floor.outline.rings=[[[80,10],[120,10],[120,30],[80,30]]]",
        ]
    ).case
    scene = build_scene(case)
    radius = case.shape.outline.radius
    assert scene.mass * len(scene.positions) == pytest.approx(100 * np.pi * (radius**2 - 100))
    centre = scene.positions.mean(axis=0)
    assert np.hypot(*(scene.positions - centre).T).min() > 9.5
    assert centre[0] == pytest.approx(100, abs=0.2)
    assert scene.node_distance[100, 20] == pytest.approx(10)
    assert scene.node_distance[100, 35] == pytest.approx(-5)
    np.testing.assert_allclose(scene.node_normal[100, 12], [0, 1])  # from the cave's bottom
    np.testing.assert_allclose(scene.node_normal[100, 28], [0, -1])


@pytest.mark.parametrize(
    ("rings", "reason"),
    [
        ((SQUARE, [(30, 30), (90, 30), (90, 50)]), r"two of its curves cross or run along each other near \(60, 40\)"),
        ((SQUARE, [(60, 0), (90, 0), (90, 60), (60, 60)]), r"run along each other near \(60,"),
        ((SQUARE, SQUARE), "run along each other"),
        ((SQUARE, [(10, 10), (50, 50), (50, 10), (10, 50)]), "curve 2 of 2: it crosses or touches itself near"),
        ((SQUARE, [(10, 10), (50, 10), (50, 12)]), r"curve 2 of 2: its corner at \(10, 10\) is sharper"),
    ],
)
def test_curves_that_cannot_be_used(rings, reason):
    assert re.search(reason, geometry.flaw(outlined(*rings)))


@pytest.mark.parametrize(
    ("overrides", "reason"),
    [
        (["shape.outline.radius=4000"], "201,061,930 particles of shape 'ball', at most 2,000,000 are allowed"),
        (
            ["shape=star", "shape.outline.points=[[0,0],[900,0],[900,9],[0,9]]", f"+shape.outline.rings=[{FAR}]"],
            "3,200,400 places for particles around shape 'star'",
        ),
        (["floor.width=10000", "fidelity.dx=0.1"], "1[0-9,]* grid nodes around floor 'L', at most 4,000,000"),
    ],
)
def test_counts_are_bounded_before_they_are_made(overrides, reason):
    with pytest.raises(ConfigError, match=reason):
        build_scene(compose(overrides).case)


@pytest.mark.parametrize(
    ("overrides", "reason"),
    [
        (["shape.outline.radius=1e20"], r"outline.radius: should be less than or equal to 100000 \(got 1e\+20\)"),
        (["floor.outline.points=[[0,0],[1e20,0],[0,9]]"], r"reaches 1e\+20 cells from \(0, 0\); at most 100000"),
        (["+shape.outline.rings=[[[0,0],[1,1]]]"], "needs at least three points"),
    ],
)
def test_sizes_are_bounded_with_the_config(overrides, reason):
    with pytest.raises(ConfigError, match=reason):
        compose(overrides)


def test_ids_know_rings_only_where_there_are_any():
    """As before there were rings; with them another run, and a configuration that is read back the same."""
    plain, empty, ring = (
        compose(over) for over in ([], ["+shape.outline.rings=[]"], ["+shape.outline.rings=[[[0,0],[9,0],[0,9]]]"])
    )
    assert run_id(plain.case) == run_id(empty.case) != run_id(ring.case)
    assert "rings" not in plain.settings()["shape"]["outline"]
    assert type(ring).model_validate(ring.settings()) == ring
