"""What is measured does not hang on how often particles are stored: strain is followed in every frame."""

import pytest

from snowrepro.composition.compose import compose
from snowrepro.run import simulate
from snowrepro.summary.row import summarise
from tests.conftest import SMALL

BY_STORED_FRAMES = {"broken_bonds", "lumps_by_bonds", "lumps_by_damage"}  # as their descriptions say
OTHERWISE = {"run_id", "seconds", "seconds_per_frame"}


@pytest.fixture(scope="module")
def rows():
    """The row of the small run by frames between stored states; it falls hard enough to come apart."""
    made = {}
    for every in (1, 2, 4):
        row = summarise(simulate(compose([*SMALL, "pressure=500", "sintering=none", f"output.every={every}"])))
        made[every] = {name: value for name, value in row.items() if name not in BY_STORED_FRAMES | OTHERWISE}
    return made


def test_the_same_bits_whatever_is_stored(rows):
    assert rows[1] == rows[2] == rows[4]
    assert rows[1]["lump_fraction"] < 1
    assert rows[1]["flattening_most"] > 0.01
