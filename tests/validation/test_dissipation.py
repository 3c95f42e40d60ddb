"""How much energy a transfer takes in a time: with ``solver.pic_rate`` it does not hang on the time step."""

import numpy as np
import pytest

from snowrepro.composition.compose import compose
from snowrepro.mpm.ledger import TOTALS
from tests.validation.motion import ELASTIC, Motion, in_space, rings

RADIUS = 5.0  # cells
FRAMES = 20  # of 0.02 s


def energy_left(cfl: float, *transfer: str) -> float:
    """Part of the energy that a disc has left, which spins and breathes in free space."""
    case = compose([*ELASTIC, f"solver.cfl={cfl}", *transfer]).case
    places, volumes = rings(0.0, RADIUS, 0.5)
    motion = Motion(case, in_space(case, places + 2 * RADIUS, volumes))
    gradient = np.array([[0.3, -0.3], [0.3, 0.3]])
    kept = gradient if case.solver.transfer == "apic" else np.zeros((2, 2))
    motion.set_velocity(places @ gradient.T, np.tile(kept, (len(places), 1, 1)))
    before = motion.kinetic_energy()
    motion.advance(FRAMES)
    elastic = motion.ledger.totals.to_numpy()[0][TOTALS.index("elastic_energy")]
    return float((motion.kinetic_energy() + elastic) / before)


@pytest.mark.slow
def test_what_is_lost_in_a_time(compare):
    """With a rate the same part is left at a half and a quarter of the time step; with a part a step it is not."""
    rate = ("solver.transfer=pic_flip", "solver.pic_rate=5")
    whole, quarter = (energy_left(cfl, *rate) for cfl in (0.4, 0.1))
    compare("spinning and breathing disc, by rate: energy left, a quarter of the step", quarter, whole, rel=0.05)
    whole, quarter = (energy_left(cfl, "solver.transfer=pic_flip") for cfl in (0.4, 0.1))
    assert quarter < 0.8 * whole
