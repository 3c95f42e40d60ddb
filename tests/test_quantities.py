"""Units as people read them."""

import pytest

from snowrepro.quantities import DENSITY, PRESSURE, add_unit, format_powers, format_unit
from snowrepro.summary.row import ALL_COLUMNS


@pytest.mark.parametrize(
    ("unit", "shown"),
    [
        ("1", ""), ("s", "s"), ("kg cell-1 s-2", "kg cell⁻¹ s⁻²"), ("kg cell2 s-2", "kg cell² s⁻²"), ("cell", "cells"),
        ("kg m-1 s-2", "Pa"), ("kg m-3", "kg/m³"), ("kg length-12", "kg length⁻¹²"), ("unknown", "unknown"),
    ],
)  # fmt: skip
def test_a_unit_has_superscripts_or_a_name(unit, shown):
    assert format_unit(unit) == shown


def test_readings_that_differ_in_length_have_several_units():
    """Each once, in their order."""
    assert format_powers(PRESSURE, ["cell", "m", "cell"]) == "kg cell⁻¹ s⁻² or Pa"
    assert format_powers(DENSITY, ["m", "m"]) == "kg/m³"
    assert add_unit("pressure", "Pa") == "pressure [Pa]" and add_unit("mass in lumps", "") == "mass in lumps"


def test_no_column_shows_a_raw_unit():
    """In neither reading."""
    for column in ALL_COLUMNS.values():
        for length in ("cell", "m"):
            assert not set(column.format_unit([length])) & set("-^0123456789")
