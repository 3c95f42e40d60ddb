"""Sampling, the pressing force, the place of the snow, and scenes that do not fit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import trapezoid

from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.scene import outline as geometry
from snowrepro.scene.build import build_scene, floor_and_walls, sample
from snowrepro.scene.press import external_force


@pytest.mark.parametrize(("shape", "count"), [("ball", 8151), ("star", 22076), ("rectangle", 8151), ("triangle", 8151)])
def test_particles_are_as_many_as_the_paper_counts(shape, count):
    """Table 2 for ball and star; the others have the ball's area."""
    assert len(build_scene(compose([f"shape={shape}"]).case).positions) == count


@pytest.mark.parametrize("shape", ["ball", "star", "rectangle", "triangle"])
@pytest.mark.parametrize("sampling", ["particles_per_cell=4", "particles_per_cell=9", "particles_per_cell=16", "dx=2"])
def test_mass_is_density_times_area(shape, sampling):
    """Whatever the sampling; the area by the shoelace rule or pi r^2."""
    config = compose([f"shape={shape}", f"fidelity.{sampling}"])
    corners = np.array(config.case.shape.outline.points or [])
    if shape == "ball":
        area = np.pi * config.case.shape.outline.radius**2
    else:
        x, y = corners.T
        area = 0.5 * abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    scene = build_scene(config.case)
    assert scene.mass * len(scene.positions) == pytest.approx(100 * area, rel=1e-13)
    assert scene.volume * len(scene.positions) == pytest.approx(area, rel=1e-13)


@pytest.mark.parametrize("shape", ["ball", "star", "rectangle", "triangle"])
def test_particles_fill_the_outline_evenly(shape):
    """All are inside but for a few at the edge, none far out; a cell in the middle has four."""
    outline = compose([f"shape={shape}"]).case.shape.outline
    places, depth = sample(outline, 1.0, 4, seed=1)
    np.testing.assert_allclose(depth, -geometry.signed_distance(outline, places)[0])
    assert depth.min() > -0.1
    assert (depth < 0).mean() < 0.02
    centre = geometry.centroid(outline)
    middle = (np.abs(places - centre) < 5).all(axis=1)
    assert middle.sum() == pytest.approx(400, rel=0.05)


def test_the_seed_decides_the_places():
    ball = compose([]).case.shape.outline
    places, _ = sample(ball, 1.0, 4, seed=1)
    again, _ = sample(ball, 1.0, 4, seed=1)
    other, _ = sample(ball, 1.0, 4, seed=2)
    assert (places == again).all()
    assert not (places == other).all()


@pytest.mark.parametrize("floor", ["L", "square", "zigzag", "triangle", "stair1", "stair2", "stair3"])
@pytest.mark.parametrize("shape", ["ball", "star"])
def test_snow_falls_the_same_height_to_every_floor(shape, floor):
    """Lowered by drop_height the snow just touches: the gap between particles and floor closes."""
    config = compose([f"shape={shape}", f"floor={floor}"])
    positions = build_scene(config.case).positions
    assert positions[:, 0].mean() == pytest.approx(100, abs=0.1)
    sunk = positions - [0, config.case.reading.drop_height]
    gap = geometry.signed_distance(config.case.floor.outline, sunk)[0].min()
    assert -0.2 < gap < 1.0


@given(st.permutations(range(4)))
def test_order_of_walls_changes_no_bit(order):
    """Distance and normal near several walls, corners and bisectors included."""
    axis = np.linspace(0, 4, 17)
    points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    slope = np.array([0.6, 0.8])
    walls = [
        (points[:, 0] - 0.5, [1.0, 0.0]),
        (points[:, 1] - 0.5, [0.0, 1.0]),
        (3.1 - points[:, 0], [-1.0, 0.0]),
        (points @ slope - 1.0, slope),
    ]

    def nearest(sequence):
        (distance, normal), *others = [walls[i] for i in sequence]
        normal = np.broadcast_to(normal, points.shape)
        for other, other_normal in others:
            distance, normal = geometry.nearer(distance, normal, other, np.broadcast_to(other_normal, points.shape))
        return distance, geometry.unit(normal)

    for one, other in zip(nearest(range(4)), nearest(order), strict=True):
        np.testing.assert_array_equal(one, other)


def test_floor_and_walls_are_one_distance():
    """Exact beside walls and floor, in their corners, and without a preferred side on a bisector."""
    config = compose(["floor=L"])
    points = np.array([[100.0, 60.0], [195.0, 60.0], [33.3, 80.0], [40.3, 22.3], [100.0, 98.0], [50.0, 14.0]])
    distance, normal = floor_and_walls(config.case.floor.outline, points, 200.0, 100.0, 3.0)
    corner = np.hypot(3.0, 7.7)
    np.testing.assert_allclose(distance, [37.0, 2.0, corner, 10.0, -1.0, 1.7])
    diagonal = np.sqrt(0.5)
    expected = [[0, -1], [-1, 0], [3 / corner, 7.7 / corner], [diagonal, diagonal], [0, -1], [0, 1]]
    np.testing.assert_allclose(normal, expected, atol=1e-12)


def test_force_builds_up_the_nominal_pressure_at_the_centre():
    """The integral of rho |b| from the surface to the centre of a disc is the nominal pressure."""
    radius, rho, pressure = 25.0, 100.0, 2000.0
    r = np.linspace(radius, -radius, 20001)
    line = np.stack([r, 0 * r], axis=1)  # symmetric about the centre, which the force takes as the mean
    depth = radius - np.abs(r)
    for kind in ("radial_linear", "radial_constant", "shell"):
        b = external_force(kind, line, depth, pressure, rho, radius, 2.0)
        assert (b[:, 0] * r <= 0).all()
        half = slice(0, 10001)
        total = trapezoid(rho * np.abs(b[half, 0]), -r[half])
        assert total == pytest.approx(pressure, rel=2e-3)
    squeezed = external_force("two_sides", line[:, ::-1], depth, pressure, rho, radius, 2.0)
    assert (squeezed[:, 0] == 0).all()
    with pytest.raises(ValueError, match="no such press"):
        external_force("sideways", line, depth, pressure, rho, radius, 2.0)


@pytest.mark.parametrize(
    ("overrides", "reason"),
    [
        (["shape=star", "shape.outline.points=[[0,0],[40,40],[40,0],[0,40]]"], r"crosses .* near \(20, 20\)"),
        (["floor.outline.points=[[0,0],[200,0],[200,9],[50,9],[60,0],[70,9],[0,9]]"], "crosses or touches itself near"),
        (["shape=star", "shape.outline.points=[[0,0],[20,0],[40,0]]"], "it has no area"),
        (["shape=star", "shape.outline.points=[[0,0],[40,0],[40,40],[0,0]]"], "corner 4 is repeated by the next"),
        (["shape=star", "shape.outline.points=[[0,0],[40,0],[20,0],[20,30]]"], "crosses or touches itself"),
        (["shape=star", "shape.outline.points=[[0,0],[40,0,1],[40,5],[38,0]]"], "crosses or touches itself"),
        (
            ["shape=star", "shape.outline.points=[[0,0],[60,0],[60,40],[59,9]]"],
            r"corner at \(60, 40\) is sharper than 5",
        ),
        (["floor.outline.points=[[0,0],[200,0],[240,10],[0,10]]"], "lies outside its domain, which is 200 cells wide"),
        (["floor.outline.points=[[-5,0],[200,0],[200,10],[-5,10]]"], "lies outside its domain"),
        (["floor.drop_x=10"], "does not fit the domain"),
        (["shape.outline.radius=120"], "does not fit the domain"),
        (["reading.drop_height=0.5"], "touches floor 'L' at the start: the gap is"),
        (["floor.drop_x=56", "reading.drop_height=20"], "touches floor 'L' at the start"),
        (["shape.outline.radius=2"], "is too small"),
    ],
)
def test_bad_scenes_are_refused(overrides, reason):
    """The message says what is wrong, with numbers."""
    with pytest.raises(ConfigError, match=reason):
        build_scene(compose(overrides).case)


@pytest.mark.parametrize(
    ("overrides", "reason"),
    [
        (["shape=star", "shape.outline.points=[[0,0],[40,0]]"], "needs at least three points"),
        (["shape=star", "shape.outline.points=[[0,0],[40,0,11],[3,3]]"], "bulge of an arc must lie between -10 and 10"),
        (["shape=star", "shape.outline.points=[[0,0],[40],[3,3]]"], "points.1"),
        (["shape=star", "shape.outline.points=[[0,0],[40,inf],[3,3]]"], "finite"),
        (["shape=star", "shape.outline.kind=square"], "should be 'circle', 'polygon', 'svg' or 'image'"),
        (["shape.outline.kind=polygon"], "a polygon needs points"),
        (["floor.width=abc"], "floor.width: should be a valid number"),
    ],
)
def test_bad_outlines_are_refused_with_the_config(overrides, reason):
    with pytest.raises(ConfigError, match=reason):
        compose(overrides)
