"""What an eye sees on built bodies: one body, several, or a cloud."""

import numpy as np
import pytest

from snowrepro.analysis.eye import SIGHT, draw_discs, look_at, measure_perimeter
from tests.analysis.bodies import break_apart, crumble, crush_below, fill_disc, throw_dust, turn

LEAST = 16.0  # cells
DISC = fill_disc()


def look(places: np.ndarray, per_cell: int = 4):
    """What is seen of particles with cells of length 1."""
    return look_at(places, per_cell**-0.5, 1.0, LEAST)


@pytest.mark.parametrize(("per_cell", "bumps"), [(1, 0.4), (4, 0.12), (16, 0.06)])
def test_a_disc_is_one_round_body(per_cell, bumps):
    """But for the bumps of its particles at the rim."""
    seen = look(fill_disc(per_cell, 20), per_cell)
    assert (seen.bodies, seen.largest) == (1, 1.0)
    assert 0.99 < seen.raggedness < 1 + bumps


def test_what_was_pressed_flat_is_one_body():
    """Crushed snow looks whole."""
    for pressed in (crush_below(DISC), DISC * [1, 0.3], DISC * [1.3, 0.3]):
        seen = look(pressed)
        assert (seen.bodies, seen.largest) == (1, 1.0)
    assert seen.raggedness > 1.5  # longer than high


def test_pieces_are_counted_and_the_largest_is_weighed():
    apart = break_apart(DISC, 9)
    seen = look(apart)
    assert seen.bodies == 9 and 0.1 < seen.largest < 0.4
    half = DISC[:, :1] < 0
    seen = look(np.where(half, DISC - [10.0, 0.0], DISC))
    assert seen.bodies == 2 and seen.largest == pytest.approx(0.5, abs=0.01)


def test_dust_is_no_body():
    seen = look(np.random.default_rng(1).normal(0, 150, DISC.shape))
    assert seen.bodies == 0 and seen.largest < 0.02
    dusty, thrown = throw_dust(DISC, 0.05)
    seen = look(dusty)
    assert seen.bodies == 1 and 0.7 < seen.largest < 1 - thrown / 2


def test_raggedness_rises_from_disc_to_square_to_comb():
    square = np.stack(np.meshgrid(np.arange(0, 20, 0.5), np.arange(0, 20, 0.5)), -1).reshape(-1, 2)
    comb = square[(square[:, 1] < 4) | (square[:, 0] % 4 < 2)]
    ragged = [look(places).raggedness for places in (DISC, square, comb)]
    assert 1.1 < ragged[1] < 4 / np.pi
    assert ragged[2] > 3 * ragged[1]


def test_a_perimeter_hardly_knows_a_direction():
    body = fill_disc(4)[:, :] * [1.0, 0.5]
    perimeters = [measure_perimeter(draw_discs(turn(body, angle), 0.5, 1.0)) for angle in np.linspace(0, 1.5, 6)]
    assert max(perimeters) / min(perimeters) < 1.06


def test_no_particle_breaks_the_picture():
    """None at all, those that vanished, or one far away, which is not seen."""
    assert look(np.empty((0, 2))).bodies == look(np.full((3, 2), np.nan)).bodies == 0
    places = DISC.copy()
    places[0], places[1] = np.nan, [1e30, 0.0]
    seen = look(places)
    assert (seen.bodies, seen.largest) == (1, 1.0)
    assert max(draw_discs(places[1:], 0.5, 1.0).shape) < 2 * SIGHT


def test_crumbs_are_many_bodies():
    assert look(crumble(DISC, 6.0)).bodies > 20
