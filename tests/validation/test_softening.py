"""Opening a crack takes the same energy on every grid where ``reading.softening_length`` is set."""

import numpy as np
import pytest

from snowrepro.composition.compose import compose
from snowrepro.mpm.ledger import TOTALS
from tests.validation.motion import Motion, in_space
from tests.validation.test_one_point import LAM, MU, XI, Points

LENGTH = 1.0  # cells
TAKEN = [TOTALS.index(name) for name in ("plastic_work", "hardening_work")]


@pytest.mark.usefixtures("taichi")
@pytest.mark.parametrize("dx", [2.0, 1.0, 0.5])
@pytest.mark.parametrize("length", [None, LENGTH])
def test_work_of_a_point_that_opens(dx, length, compare):
    """Pulled along x by plastic strain e = J_P - 1, a point takes sigma(0) times the integral of exp(-xi e) in e.

    That is one over xi, and times the width dx the work of a crack: in proportion to dx, or to the length instead.
    """
    setting = [f"reading.softening_length={length}"] if length else []
    point = Points(1, f"fidelity.dx={dx}", *setting, "reading.plastic_volume=[0.1,40]")
    stretches = 1.005 * np.geomspace(1, 9, 300)
    before, stresses, J_P = 1.0, [], []
    for stretch in stretches:
        point.deform(np.diag([stretch / before, 1.0]))
        stresses.append(point.read("tau")[0, 0, 0] / 1.005)
        J_P.append(point.read("J_P")[0])
        before = stretch
    work = dx * np.trapezoid(stresses, J_P)
    yielding = (2 * MU + LAM) * 0.005
    what = f"crack of a point, dx = {dx:g}, length {length}: work"
    compare(what, work, yielding / XI * (length or dx), rel=0.01)


def work_of_crack(dx: float, *overrides: str) -> float:
    """Energy that a bar takes, a unit of its height, whose halves part until the crack is four cells wide."""
    bar = np.array([24.0, 6.0])
    case = compose([f"fidelity.dx={dx}", "sintering=none", "reading.initial_volume=sampled", *overrides]).case
    spacing = dx / 2
    axes = [np.arange(spacing / 2, side, spacing) + 10.0 for side in bar]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    motion = Motion(case, in_space(case, places, spacing**2))
    pull = np.where(places[:, :1] < 10.0 + bar[0] / 2, -1.0, 1.0) * [1.0, 0.0]
    motion.particles.write("velocity", pull)
    taken = 0.0
    for _ in range(100):
        motion.advance()
        taken -= motion.ledger.totals.to_numpy()[0][TAKEN].sum()
    return float(taken / bar[1])


@pytest.mark.slow
def test_work_of_a_bar_that_is_pulled_apart(compare):
    """On grids of 2 and 1 cells the work differs by less than half as much with a length as without; at 1 it is equal.

    It does not scale like that of a point: a part of it is flow beside the crack, and three cells are few for a bar.
    """
    plain = {dx: work_of_crack(dx) for dx in (2.0, 1.0)}
    coarse = work_of_crack(2.0, f"reading.softening_length={LENGTH}")
    compare("bar pulled apart, dx = 2, with a length: work beside dx = 1", coarse / plain[1.0], 1.0, abs=0.2)
    assert coarse / plain[1.0] - 1 < 0.5 * (plain[2.0] / plain[1.0] - 1)
