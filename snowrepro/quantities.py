"""Units as people read them: one name for each, superscripts, and nothing for numbers without a unit.

Files keep the texts of ``units.text``.  A page, a picture or a screen shows what this module makes of them.
"""

import re
from collections.abc import Iterable

from . import units

PRESSURE, DENSITY = "M/L/T2", "M/L3"  # powers of length, mass and time
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# Units with a shorter name.
NAMES = {
    "1": "",
    "cell": "cells",
    "cell s-1": "cells/s",
    "cell s-2": "cells/s²",
    "kg m-1 s-2": "Pa",
    "kg m-3": "kg/m³",
    "kg m2 s-2": "J",
    "m s-1": "m/s",
    "m s-2": "m/s²",
}


def format_unit(unit: str) -> str:
    """Format the unit of a file, such as "kg cell-1 s-2", for people: "kg cell⁻¹ s⁻²"; empty for "1"."""
    return NAMES.get(unit, re.sub(r"(?<=[^\W\d_])-?\d+", lambda power: power[0].translate(SUPERSCRIPTS), unit))


def format_powers(powers: str, length_units: Iterable[str]) -> str:
    """Format the unit of ``powers``, such as PRESSURE, for people; with an "or" where lengths have several units."""
    return " or ".join(dict.fromkeys(format_unit(units.text(powers, unit)) for unit in length_units))


def add_unit(name: str, unit: str) -> str:
    """Return the name of a quantity with its unit for people behind it, as at an axis or above a column."""
    return f"{name} [{unit}]" if unit else name
