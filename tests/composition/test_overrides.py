"""Words of a command line before Hydra reads them: folders keep their names, and what is too long is refused."""

import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from omegaconf import OmegaConf

from snowrepro.composition.compose import compose
from snowrepro.composition.hydra_private import OverridesParser
from snowrepro.composition.overrides import override_folder, prepare_overrides, read_folder
from snowrepro.errors import ConfigError

PARSER = OverridesParser.create()
NAMES = st.text(st.characters(exclude_categories=("Cs", "Cc"), exclude_characters="\0"), min_size=1, max_size=40)


@settings(deadline=None, max_examples=60, derandomize=True)
@given(NAMES)
def test_a_folder_is_read_back_whatever_letters_it_has(folder):
    """Quotes, backslashes, brackets, commas, and what looks like an interpolation."""
    word = override_folder("store", folder)
    assert read_folder(word) == folder
    assert OmegaConf.create({"store": PARSER.parse_override(word).value()}).store == folder


@pytest.mark.parametrize(
    "name", ["my runs", "\u00dcbung", "a=b", "a(b)", "[a", "{a}", "it's", "a\\", "~a", "5", "null"]
)
def test_a_plain_name_means_itself(name):
    """In quotes or not, and for Hydra as for verbs that it has no part in."""
    assert read_folder(f"store={name}") == read_folder(override_folder("store", name)) == name
    assert compose([f"store={name}"]).execution.store == name


def test_quotes_of_both_kinds_are_understood(monkeypatch):
    monkeypatch.setenv("PLACE", "from outside")
    for word in ("store='my runs'", 'store="my runs"'):
        assert read_folder(word) == "my runs" == compose([word]).execution.store
    assert read_folder("store=${oc.env:PLACE}") == "from outside" == compose(["store=${oc.env:PLACE}"]).execution.store


@pytest.mark.parametrize("key", ["store", "reports"])
def test_several_folders_are_refused(key):
    with pytest.raises(
        ConfigError, match=f"{key}: there is one for all runs .got a,b.; a name with a comma is written"
    ):
        prepare_overrides([f"{key}=a,b"])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["shape.name=" + "a" * 5_000], "has 5,011 letters, at most 5,000 are read"),
        (["pressure=1"] * 6_000, "the overrides have 60,000 letters, at most 50,000 are read"),
        (["x=" + "[" * 300 + "]" * 300], "has 300 brackets inside each other, at most 20 are read"),
    ],
)
def test_what_would_take_too_long_to_read_is_refused(words, message):
    began = time.monotonic()
    with pytest.raises(ConfigError, match=message):
        compose(words)
    assert time.monotonic() - began < 5
