"""A disc on a slope rolls and slips as a rigid one does, where contact is by springs."""

import pytest

from tests.validation.disc import Incline, accelerate, start_disc


@pytest.mark.slow
def test_a_disc_rolls_down(compare):
    """a = 2/3 g sin(12 degrees) within 5 % for a radius of 9 cells, over half a turn; contact on nodes stops it."""
    incline = Incline(radius=9, degrees=12, friction=0.5)
    acceleration, spin = accelerate(incline, start_disc(incline, "penalty"), frames=320)
    compare("disc, R = 9, 12 degrees: acceleration", acceleration, incline.theory[0], rel=0.05)
    compare("disc, R = 9, 12 degrees: of the spin", spin, incline.theory[1], rel=0.05)


@pytest.mark.slow
def test_a_disc_slips_and_is_spun_up(compare):
    """a = g (sin - mu cos) within 1 %; of the spin 2 mu g cos / R it gets nine tenths or more."""
    incline = Incline(radius=9, degrees=33, friction=0.1)
    acceleration, spin = accelerate(incline, start_disc(incline, "penalty"), frames=150)
    compare("disc, R = 9, 33 degrees: acceleration", acceleration, incline.theory[0], rel=0.01)
    compare("disc, R = 9, 33 degrees: of the spin", spin, incline.theory[1], rel=0.1)
