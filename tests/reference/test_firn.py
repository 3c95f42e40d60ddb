"""Laws of firn against numbers of the public Community Firn Model, whose own functions were called at these points."""

import math

import pytest

from snowrepro.reference.firn import arthern, barnola

POINTS = [  # density, stress, Arthern2010T with r^2 = 1e-7 m^2, Barnola1991; all at 263.15 K
    (300, 1e4, 6.97891044e-07, None),
    (450, 1e4, 5.28225474e-07, None),
    (600, 5e4, 7.21017198e-07, 6.97605046e-08),
    (700, 1e5, 9.87133956e-07, 3.31704520e-08),
    (830, 2e5, 7.91526767e-07, 2.29237168e-08),
    (860, 2e5, 5.18586502e-07, 1.13712492e-08),
]


@pytest.mark.parametrize(("rho", "sigma", "of_arthern", "of_barnola"), POINTS)
def test_the_public_model_has_the_same_numbers(rho, sigma, of_arthern, of_barnola):
    assert arthern(rho, 263.15, sigma, 1e-7) == pytest.approx(of_arthern, rel=1e-7, abs=0)
    if of_barnola is None:
        assert math.isnan(barnola(rho, 263.15, sigma))
    else:
        assert barnola(rho, 263.15, sigma) == pytest.approx(of_barnola, rel=1e-7, abs=0)
