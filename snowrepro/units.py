"""Unit texts: a quantity's powers of length, mass and time, written in the reading's units."""

import re

_NAMES = {"M": "kg", "T": "s"}


def text(powers: str, length_unit: str) -> str:
    """The unit in the form "kg cell-1 s-2" of powers such as "M/L/T2"; "1" where there is none.

    L, M and T stand for length, mass and time; each "/" applies to the one symbol behind it.
    """
    if powers == "1":
        return "1"
    terms = []
    for sign, symbol, exponent in re.findall(r"(/?)([LMT])(\d*)", powers):
        power = int(exponent or 1) * (-1 if sign else 1)
        name = _NAMES.get(symbol, length_unit)
        terms.append(name if power == 1 else f"{name}{power}")
    return " ".join(terms)
