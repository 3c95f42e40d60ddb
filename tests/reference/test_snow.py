"""Measured laws of snow: values worked by hand from the printed formulas, ranges, sources."""

import re

import numpy as np
import pytest

from snowrepro.reference.snow import LAWS, MODULI, POISSON, RATIOS, VISCOSITIES, VISCOSITY, YOUNG

by_name = {law.name: law for law in LAWS}
every_law = pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)


@pytest.mark.parametrize(
    ("name", "rho", "value"),
    [
        ("Scapozza 2004", 300, 1.6362e7),  # exp(4.47) = 87.357
        ("Sigrist 2006", 300, 3.6241e7),  # 300^2.94 = 1.91751e7
        ("Köchle 2014, light", 200, 1.6786e7),  # exp(7.92) = 2751.77
        ("Köchle 2014, dense", 300, 1.6391e8),  # exp(3.3) = 27.1126
        ("van Herwijnen 2016", 250, 4.8163e6),  # 250^2.8 = 5.1789e6
        ("Bergfeld 2023", 306, 5.1711e7),  # a third of 918: 3^-4.4 = 0.0079555
        ("Köchle 2014, depth hoar", 123, 0.087),
        ("Srivastava 2016, rounded grains", 580, 0.191),
        ("Crocus, 0 °C", 250, 2.39488e9),  # exp(5.75) = 314.191
        ("Crocus, -10 °C", 250, 6.50996e9),  # e times that
    ],
)
def test_values_by_hand(name, rho, value):
    assert by_name[name].at(rho) == pytest.approx(value, rel=1e-4)


@every_law
def test_nothing_outside_the_range(law):
    """Inside, a number that can be; a step outside, none."""
    inside = law.at(np.linspace(law.low, law.high, 7))
    assert (inside > 0).all() and inside.shape == (7,)
    assert np.isnan(law.at([law.low - 1.0, law.high + 1.0])).all()


@every_law
def test_every_law_says_where_it_holds_and_where_it_is_from(law):
    assert 0 < law.low < law.high < 917
    year = re.search(r"\((\d{4})\): ", law.source.text)
    assert year and (year.group(1) in law.name or law.quantity == VISCOSITY)
    assert law.source.text.count(". ") >= 2, "authors, title, and where it appeared"
    assert not law.source.doi or law.source.doi.startswith("10.")
    assert law.formula and law.how and law.checked


def test_laws_are_told_apart():
    """A name a law, and each under its quantity, with one unit."""
    assert len(by_name) == len(LAWS)
    for laws, quantity, unit in ((MODULI, YOUNG, "Pa"), (RATIOS, POISSON, "1"), (VISCOSITIES, VISCOSITY, "Pa s")):
        assert {(law.quantity, law.unit) for law in laws} == {(quantity, unit)}
