"""Energy that the time step makes: what the ledger leaves unclosed is the sum of five terms of each substep."""

import numpy as np
import pytest

from snowrepro.composition.compose import compose
from snowrepro.mpm.ledger import WORKS
from tests.validation.motion import Motion, over_floor, rings
from tests.validation.step_energy import follow

RADIUS = 5.0  # cells
BOTTOM = 12.8  # of the disc at the start; the floor is at 12.3
SPEED = 20.0  # cells/s


def throw_disc(dt: float, time: float, *overrides: str) -> tuple[dict[str, float], float, float]:
    """Throw a disc of snow that yields and hardens at the floor: what the steps made of energy by
    part, what is unclosed, and what was turned over."""
    case = compose(["sintering=none", "reading.initial_volume=sampled", *overrides]).case
    places, volumes = rings(0.0, RADIUS, 0.5)
    motion = Motion(case, over_floor(case, np.array([60.0, BOTTOM + RADIUS]) + places, volumes, 60.0), frame_time=dt)
    motion.set_velocity(np.tile([3.0, -SPEED], (len(places), 1)), np.zeros((len(places), 2, 2)))
    made, rows = follow(motion, case, round(time / dt))
    turned_over = sum(abs(row[name]) for row in rows for name in WORKS)
    return made, sum(row["unclosed_energy"] for row in rows), turned_over


@pytest.mark.parametrize(
    ("transfer", "contact"),
    [
        ("apic", "legacy"),
        *(pytest.param(*each, marks=pytest.mark.slow) for each in (("pic_flip", "coulomb"), ("mls", "penalty"))),
    ],
)
def test_what_is_unclosed_is_what_the_steps_make(compare, transfer, contact):
    """An impact with plastic flow, hardening and friction: the discrete energy identity holds to round-off."""
    made, unclosed, turned_over = throw_disc(1e-3, 0.06, f"solver.transfer={transfer}", f"reading.contact={contact}")
    assert min(abs(made[part]) for part in ("strain", "flow", "free", "held")) > 1e-5 * turned_over
    compare(
        f"impact, {transfer}, contact {contact}: energy unclosed over that which the steps make",
        unclosed / sum(made.values()),
        1,
        abs=1e-9,
    )
