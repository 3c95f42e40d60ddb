"""Folders are written ``--store FOLDER`` or ``store=FOLDER``, in every verb that uses one, and mean the same."""

import argparse

import pytest

from snowrepro.cli.folders import settle_folders
from snowrepro.cli.main import VERBS, read_command_line
from snowrepro.errors import ConfigError

NEEDED = {
    "animate": ["id"], "classify": ["id"], "crate": ["id"], "diff": ["a", "b"], "explain": ["id"], "redo": ["id"],
    "plot": ["grid"], "retry": ["grid"], "sensitivity": ["grid"],
}  # fmt: skip
WITH_STORE = sorted({*VERBS} - {"completion"})
WITH_REPORTS = ["claims", "config", "crate", "plot", "report", "run", "sample", "sensitivity"]


def read(verb: str, *words: str) -> argparse.Namespace:
    """What a verb is called with."""
    options, named = read_command_line([verb, *NEEDED.get(verb, []), *words])
    settle_folders(options, named)
    return options


def folder_of(options: argparse.Namespace, key: str) -> str | None:
    """The folder that a verb is to use: among its overrides, or in its options."""
    if not getattr(options, "has_overrides", False):
        return getattr(options, key)
    named = [word.partition("=")[2].strip("'") for word in options.overrides if word.startswith(f"{key}=")]
    return named[-1] if named else None


@pytest.mark.parametrize(("verb", "key"), [(v, "store") for v in WITH_STORE] + [(v, "reports") for v in WITH_REPORTS])
def test_both_ways_mean_the_same(verb, key):
    """Wherever they stand, also together; what else is asked for stays."""
    plain = read(verb)
    for words in (
        [f"--{key}", "a b"],
        [f"--{key}=a b"],
        [f"{key}=a b"],
        [f"{key}='a b'"],
        [f"--{key}=a b", f"{key}=a b"],
    ):
        options = read(verb, *words)
        assert folder_of(options, key) == "a b", words
        left = [word for word in getattr(options, "overrides", ()) if not word.startswith(f"{key}=")]
        assert left == getattr(plain, "overrides", [])


@pytest.mark.parametrize("verb", WITH_STORE)
def test_two_that_differ_are_refused(verb):
    """Nobody knows which one is meant."""
    with pytest.raises(ConfigError, match=r"two folders are given: --store a and store=b; leave out one of them"):
        read(verb, "store=b", "--store", "a")


@pytest.mark.parametrize("verb", WITH_STORE)
def test_without_any_it_is_the_usual_one(verb):
    """The program's own, or that of check."""
    expected = "check-runs" if verb in ("bless", "check") else "runs"
    assert folder_of(read(verb), "store") in (None, expected)
    assert read(verb).default_store == expected


@pytest.mark.parametrize("words", [["completion", "bash", "store=x"], ["explain", "id", "reports=x"]])
def test_a_folder_that_a_verb_does_not_use_is_an_error(words, capsys):
    """As any word that it does not know."""
    with pytest.raises(SystemExit) as ended:
        read_command_line(words)
    assert ended.value.code == 2
    assert f"unrecognized arguments: {words[-1]}" in capsys.readouterr().err


def test_a_store_is_found_by_either(snowrepro, tmp_path):
    """On the command line itself; the message names it."""
    for words in (["--store", "else where"], ["store=else where"]):
        for verb in (["explain", "nothing"], ["status", "nothing"]):
            done = snowrepro(*verb, *words)
            assert done.returncode == 2
            assert "store 'else where'" in done.stderr
