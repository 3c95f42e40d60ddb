"""What came of a run in a sentence, and the units of its numbers."""

import pytest

from snowrepro.summary.outcome import describe_outcome, list_units

FALL = {"lumps": 3, "lump_fraction": 0.7197, "powder_fraction": 0.2803, "vanished": 0.0, "settled": True}
TEST = {"indenter": "disc", "hardness": 4912.4, "hardness_depth": 8.0}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, "72 % of the mass is in 3 lumps, 28 % is powder."),
        ({"lumps": 1}, "72 % of the mass is in 1 lump, 28 % is powder."),
        (
            {"lumps": 0, "lump_fraction": 0.0, "powder_fraction": 1.0},
            "100 % of the mass is powder, and no lump is left.",
        ),
        (
            {"lump_fraction": 0.998, "powder_fraction": 0.002},
            "more than 99 % of the mass is in 3 lumps, less than 1 % is powder.",
        ),
        (
            {"powder_fraction": 0.18, "vanished": 0.1},
            "72 % of the mass is in 3 lumps, 18 % is powder, 10 % is no longer there.",
        ),
    ],
)
def test_a_fall_is_lumps_and_powder(changes, said):
    assert describe_outcome(FALL | changes, "cell") == said


def test_snow_that_still_breaks_is_told():
    assert describe_outcome(FALL | {"settled": False}, "cell").endswith("the snow has not settled.")


def test_a_hardness_test_has_its_unit():
    """Which the reading decides; without a measured force there is no number."""
    text = "The snow has a hardness of 4,912 {}, measured by a disc 8 cells deep."
    assert describe_outcome(TEST, "cell") == text.format("kg cell⁻¹ s⁻²")
    assert describe_outcome(TEST, "m") == text.format("Pa")
    assert "a hardness of 0.0123 Pa" in describe_outcome(TEST | {"hardness": 0.012345}, "m")
    for nothing in (0.0, float("nan")):
        assert "no resistance" in describe_outcome(TEST | {"hardness": nothing}, "cell")


def test_units_are_listed_where_there_are_any():
    assert list_units({"pressure": 1.0, "lumps": 2, "run_id": "x", "other": 3}, "cell") == {"pressure": "kg cell⁻¹ s⁻²"}
