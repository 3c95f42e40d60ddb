"""What came of a run in a sentence, and the units of its numbers."""

import pytest

from snowrepro.summary.outcome import describe_outcome, list_units

FALL = {"lumps": 3, "lump_fraction": 0.7197, "crushed_fraction": 0.2, "loose_fraction": 0.0803} | {
    "vanished": 0.0,
    "settled": True,
    "end_frame": 346,
}
END = " The run ended in frame 346."
TEST = {"indenter": "disc", "hardness": 4912.4, "hardness_depth": 8.0}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, "72 % of the mass is in 3 lumps, 20 % is crushed, 8 % is loose."),
        ({"lumps": 1}, "72 % of the mass is in 1 lump, 20 % is crushed, 8 % is loose."),
        (
            {"lumps": 0, "lump_fraction": 0.0, "crushed_fraction": 1.0, "loose_fraction": 0.0},
            "No lump is left: 100 % of the mass is crushed, 0 % is loose.",
        ),
        (
            {"lump_fraction": 0.998, "crushed_fraction": 0.0, "loose_fraction": 0.002},
            "more than 99 % of the mass is in 3 lumps, 0 % is crushed, less than 1 % is loose.",
        ),
        (
            {"crushed_fraction": 0.1, "vanished": 0.1},
            "72 % of the mass is in 3 lumps, 10 % is crushed, 8 % is loose, 10 % is no longer there.",
        ),
    ],
)
def test_a_fall_is_lumps_crushed_and_loose_snow(changes, said):
    assert describe_outcome(FALL | changes, "cell") == said + END


def test_snow_that_still_changes_is_told():
    assert describe_outcome(FALL | {"settled": False}, "cell").endswith(f"the snow has not settled.{END}")


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
