"""Outlines, sampling, the pressing force, and scenes that do not fit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snowrepro.config import Outline, compose
from snowrepro.errors import ConfigError
from snowrepro.scene import outline as geometry
from snowrepro.scene.build import build_scene, sample
from snowrepro.scene.press import external_force


def polygon(points) -> Outline:
    return Outline(kind="polygon", points=tuple(map(tuple, points)))


def star_shaped(radii) -> np.ndarray:
    """A simple polygon from radii at equal angles."""
    angles = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
    return np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)


def brute_force_distance(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distance to 4,000 points on each edge; sign by winding number."""
    t = np.linspace(0, 1, 4000)[:, None]
    border = np.concatenate([a + t * (b - a) for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)])
    distance = np.array([np.sqrt(((border - p) ** 2).sum(axis=1)).min() for p in points])
    angles = np.arctan2(*np.moveaxis(corners[None] - points[:, None], -1, 0)[::-1])
    turns = np.diff(np.concatenate([angles, angles[:, :1]], axis=1), axis=1)
    winding = ((turns + np.pi) % (2 * np.pi) - np.pi).sum(axis=1)
    return np.where(np.abs(winding) > np.pi, -distance, distance)


@settings(deadline=None, max_examples=30)
@given(st.lists(st.floats(0.5, 3.0), min_size=3, max_size=9), st.integers(0, 2**31), st.integers(0, 8), st.booleans())
def test_polygon_distance_against_brute_force(radii, seed, first, reverse):
    """Distance, sign and normal; the first vertex and the direction change nothing beyond round-off."""
    corners = star_shaped(np.array(radii))
    points = np.random.default_rng(seed).uniform(-4, 4, (40, 2))
    distance, normal = geometry.signed_distance(polygon(corners), points)
    expected = brute_force_distance(corners, points)
    np.testing.assert_allclose(distance, expected, atol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-9)
    moved, _ = geometry.signed_distance(polygon(corners), points + 1e-6 * normal)
    assert np.median((moved - distance) / 1e-6) == pytest.approx(1, abs=1e-3)
    turned = np.roll(corners, first, axis=0)[:: -1 if reverse else 1]
    again, _ = geometry.signed_distance(polygon(turned), points)
    np.testing.assert_allclose(again, distance, atol=1e-12)


def test_polygon_area_and_centroid():
    """A 3 x 2 rectangle with its corner at (1, 1), in either direction."""
    corners = [(1, 1), (4, 1), (4, 3), (1, 3)]
    for points in (corners, corners[::-1]):
        assert geometry.area(polygon(points)) == pytest.approx(6)
        np.testing.assert_allclose(geometry.centroid(polygon(points)), [2.5, 2])


@settings(deadline=None, max_examples=50)
@given(st.lists(st.floats(0.5, 3.0), min_size=3, max_size=12), st.permutations(range(6)))
def test_only_crossing_outlines_are_flawed(radii, order):
    """Star-shaped outlines are sound; six corners of a hexagon in any order but around it cross."""
    assert geometry.flaw(polygon(star_shaped(np.array(radii)))) is None
    hexagon = star_shaped(np.ones(6))[list(order)]
    steps = {(b - a) % 6 for a, b in zip(order, [*order[1:], order[0]], strict=True)}
    assert (geometry.flaw(polygon(hexagon)) is None) == (steps in ({1}, {5}))


def test_ball_has_the_papers_count():
    """Table 2: 8,151 particles at fidelity=paper, and mass = density x area at any sampling."""
    area = np.pi * 25.4686**2
    for overrides in ([], ["fidelity.particles_per_cell=9"], ["fidelity=preview"]):
        config = compose(overrides)
        scene = build_scene(config)
        assert scene.mass * len(scene.positions) == pytest.approx(100 * area, rel=1e-12)
    assert len(build_scene(compose([])).positions) == 8151


def test_particles_stay_in_the_outline_but_for_jitter():
    """No particle is farther out than its jitter can carry it; the seed decides the places."""
    ball = compose([]).shape.outline
    places, depth = sample(ball, 1.0, 4, seed=1)
    outside = geometry.signed_distance(ball, places)[0].max()
    assert outside < 0.25 * np.sqrt(2) + 0.05
    assert depth.min() > -0.05
    again, _ = sample(ball, 1.0, 4, seed=1)
    other, _ = sample(ball, 1.0, 4, seed=2)
    assert (places == again).all()
    assert not (places == other).all()


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
        total = (
            np.trapezoid(rho * np.abs(b[half, 0]), -r[half])
            if hasattr(np, "trapezoid")
            else np.trapz(rho * np.abs(b[half, 0]), -r[half])
        )
        assert total == pytest.approx(pressure, rel=2e-3)
    squeezed = external_force("two_sides", line[:, ::-1], depth, pressure, rho, radius, 2.0)
    assert (squeezed[:, 0] == 0).all()
    with pytest.raises(ValueError, match="no such press"):
        external_force("sideways", line, depth, pressure, rho, radius, 2.0)


@pytest.mark.parametrize(
    ("overrides", "reason"),
    [
        (["floor.drop_x=10"], "does not fit the domain"),
        (["shape.outline.radius=80"], "does not fit the domain"),
        (["floor.outline.points=[[0,0],[140,0],[140,130]]"], "touches floor"),
        (["floor.outline.points=[[0,0],[200,0],[200,10]]"], "outside its domain"),
        (["floor.outline.points=[[0,0],[100,10],[100,0],[0,10]]"], "corners 1 and 3 cross"),
        (["floor.outline.points=[[0,0],[100,0],[50,0]]"], "it has no area"),
        (["floor.outline.points=[[0,0],[100,0],[100,0],[0,10]]"], "a corner is repeated"),
        (["floor.outline.points=[[0,0],[100,0],[100,10],[50,0],[0,10]]"], "corners 1 and 3 cross or touch"),
    ],
)
def test_scenes_that_do_not_fit_are_refused(overrides, reason):
    """The message says what does not fit, with numbers."""
    with pytest.raises(ConfigError, match=reason):
        build_scene(compose(overrides))
