"""What ``snowrepro explain`` says of a name that is no run's."""

import pytest

from snowrepro.cli.meanings import describe_name
from snowrepro.cli.verbs import explain
from snowrepro.composition.comments import find_comment, read_comments
from snowrepro.composition.messages import find_setting
from snowrepro.errors import ConfigError
from snowrepro.summary.row import ALL_COLUMNS


@pytest.mark.parametrize("name", ALL_COLUMNS)
def test_each_column_is_explained(name):
    """By its meaning, and by its unit where it has one."""
    said = "\n".join(describe_name(name))
    assert said.startswith(f"{name}, a column of numbers of runs: {ALL_COLUMNS[name].long_name}")


def test_units_of_both_readings_are_said():
    """A pressure in cells is no pressure in Pa."""
    said = "\n".join(describe_name("pressure"))
    assert "unit: kg cell⁻¹ s⁻² with reading=grid_units; Pa with reading=si" in said
    assert "pressure, a setting: nominal pressure at the snow's centre" in said and "by default: 2900" in said


def test_a_setting_is_explained_by_its_description_and_its_comment():
    """Also by a comment that goes on in a second line."""
    (said, default) = describe_name("reading.contact")
    assert said.startswith("reading.contact, a setting: nodes inside the floor rest")
    assert "penalty: springs on the particles" in said and default == "  by default: legacy"
    assert "solver.cfl, a setting: time step in units of" in describe_name("solver.cfl")[0]


def test_comments_are_found_by_their_keys():
    """Of the option that is chosen by default, or of the file above all."""
    assert find_comment("reading.gravity") == read_comments("reading/grid_units")["gravity"] != ""
    assert find_comment("seed") and not find_comment("reading.nothing") and not find_comment("nothing.at.all")


@pytest.mark.parametrize("key", ["reading.nothing", "nothing", "nothing.at.all", "reading.gravity.more", ""])
def test_what_is_no_setting_has_no_meaning(key):
    assert find_setting(key) is None and describe_name(key) == []


def test_a_wrong_name_is_refused(tmp_path):
    """It is none of the three."""
    options = type("Options", (), {"run": "nosuch", "store": str(tmp_path)})
    with pytest.raises(ConfigError, match=r"should name one run of the store .*; nor is it a column of numbers or a s"):
        explain.execute(options)
