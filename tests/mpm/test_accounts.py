"""The tables of the ledger: what they name is kept, cleared and added up."""

import numpy as np
import pytest

from snowrepro.composition.compose import compose
from snowrepro.mpm import accounts, ledger, solver
from snowrepro.mpm.frame import read_outcomes
from snowrepro.mpm.ledger import ACCOUNTS, CAUSES, FRAME, NODE, PARTICLE, TOTALS
from tests.validation.motion import in_space
from tests.validation.test_elastic import disc

KEPT = [account for account in ACCOUNTS if account.keeper != FRAME]


def test_each_account_is_used_and_each_name_is_one():
    names = [account.name for account in ACCOUNTS]
    used = {name for cause in CAUSES for name in (*cause.adds, *cause.takes)}
    energies = {account.name for account in ACCOUNTS if account.unit == ledger.ENERGY}
    assert len(set(names)) == len(names)
    assert used == energies
    assert {account.keeper for account in ACCOUNTS} == {PARTICLE, NODE, FRAME}


def test_a_work_is_what_its_accounts_come_to():
    booked = {"floor": 5.0, "lift": 2.0, "drop": 0.5}
    assert ledger.Cause("work", "", "", adds=("floor", "lift"), takes=("drop",)).work(booked) == 6.5


@pytest.mark.parametrize("precision", ["f64", "f32"])
def test_each_account_is_added_up_and_cleared(precision):
    """Accounts that hold numbers come to these numbers' sums; a frame in which nothing happens leaves none of them."""
    case = compose([f"solver.precision={precision}", "sintering=none"]).case
    solver.start_taichi(case.solver, threads=1)
    constants = solver.make_constants(case)
    particles, nodes, report = solver.allocate(case, in_space(case, disc(6.0), 0.25), constants)
    rng = np.random.default_rng(1)
    expected = dict.fromkeys(TOTALS, 0.0)
    for account in KEPT:
        field = getattr({PARTICLE: particles, NODE: nodes}[account.keeper], account.name)
        values = rng.uniform(0.5, 1.5, field.to_numpy().shape).astype(precision.replace("f", "float"))
        field.from_numpy(values)
        counted = values[: particles.count] if account.keeper == PARTICLE else values
        for name, part in zip(account.totals, counted.reshape(-1, len(account.totals)).T, strict=True):
            expected[name] += part.sum(dtype=np.float64)
    accounts.fill_totals(particles, nodes, report, constants)
    assert read_outcomes(report)[0].totals == pytest.approx(expected, rel=1e-12, abs=1e-12)
    solver.advance_frame(particles, nodes, report, constants, 0.0, 0.0, False)
    assert read_outcomes(report)[0].totals == pytest.approx(dict.fromkeys(TOTALS, 0.0), abs=1e-12)
