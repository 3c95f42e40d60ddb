"""Which experiments a check uses: read from their files when they are needed, the user's own among them."""

import subprocess
import sys

import pytest

from snowrepro.checks import uses
from snowrepro.errors import ConfigError

OWN = "experiment: {name: mine, title: Mine, picture: strip, checks: [mutants, fine]}\n"


@pytest.fixture
def own_experiment(tmp_path, monkeypatch):
    """A working directory with an experiment that wants to be used too."""
    folder = tmp_path / "conf/experiment"
    folder.mkdir(parents=True)
    (folder / "mine.yaml").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_built_in_experiments_are_enough():
    """Figure 5: coarsely, as fine as the paper, and to try mutants on."""
    assert uses.find_experiments("coarse") == ["fig5"]
    assert [uses.find_one_experiment(use) for use in ("fine", "mutants")] == ["fig5", "fig5"]


def test_of_two_experiments_none_is_the_one(own_experiment):
    """One message that names both."""
    with pytest.raises(ConfigError, match=r"'mutants' may be among experiment\.checks of one experiment.* mine"):
        uses.find_one_experiment("mutants")


def test_without_an_experiment_there_is_one_message(monkeypatch):
    monkeypatch.setattr(uses, "checked", lambda use: [])
    with pytest.raises(ConfigError, match="none has 'coarse' among"):
        uses.find_experiments("coarse")


def test_modules_can_be_imported_beside_an_experiment_of_ones_own(own_experiment):
    """In a process of its own, as modules are loaded once."""
    modules = ", ".join(f"snowrepro.checks.{name}" for name in ("check", "bless", "ensemble", "mutants"))
    subprocess.run([sys.executable, "-c", f"import {modules}"], cwd=own_experiment, check=True)
