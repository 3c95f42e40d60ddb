"""What a result is made by: the files whose change makes it stale, and no others."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from snowrepro import sources
from snowrepro.sources import NOT_DIGESTED, digests_of

LOADED = """
import sys
from pathlib import Path
import snowrepro.simulation
from snowrepro.sources import PACKAGE
files = [Path(module.__file__) for module in list(sys.modules.values()) if getattr(module, "__file__", None)]
print(*sorted(path.relative_to(PACKAGE).as_posix() for path in files if path.is_relative_to(PACKAGE)))
"""


def of(module: str) -> dict[str, str]:
    """The digests of a module as its files are now, and not as they were when first asked for."""
    return digests_of.__wrapped__(module)


@pytest.fixture
def copy(tmp_path, monkeypatch) -> Path:
    """The package's files in a folder of their own, which digests are then taken of."""
    shutil.copytree(sources.PACKAGE, tmp_path / "snowrepro", ignore=shutil.ignore_patterns("__pycache__", "conf"))
    monkeypatch.setattr(sources, "PACKAGE", tmp_path / "snowrepro")
    return tmp_path / "snowrepro"


def test_the_simulation_is_all_that_computes():
    """The solver, the laws, the scene and the settings of a case; of what measures, what is measured in each frame."""
    found = set(digests_of("simulation"))
    laws = {path.relative_to(sources.PACKAGE).as_posix() for path in sources.PACKAGE.glob("physics/[a-z]*.py")}
    assert len(laws) > 3 and laws <= found
    assert {"simulation.py", "mpm/steps.py", "scene/build.py", "settings/case.py", "units.py"} <= found
    assert not found & {"settings/question.py", "settings/config.py", "settings/execution.py", "settings/analysis.py"}
    measured = {"analysis/clusters.py", "analysis/hardness.py", "analysis/near.py", "analysis/rest.py"}
    assert {name for name in found if name.startswith("analysis")} == measured
    rooms = {name.split("/")[0] for name in found}
    assert rooms == {
        "analysis", "laws", "mpm", "own_law.py", "physics", "scene", "settings", "simulation.py", "units.py"
    }  # fmt: skip


def test_they_are_the_files_that_python_loads():
    """The imports that are read are those that happen, beside errors and packages, which compute nothing."""
    done = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=True, timeout=120)
    loaded = {name for name in done.stdout.split() if not name.endswith("__init__.py")}
    assert loaded - {*NOT_DIGESTED, "sources.py"} == set(digests_of("simulation"))


@pytest.mark.parametrize("name", ["mpm/steps.py", "physics/maxima.py", "settings/case.py", "simulation.py"])
def test_a_change_in_a_file_changes_its_digest_and_no_other(copy, name):
    """By a letter in a comment: nobody can say from outside whether it computes."""
    before = of("simulation")
    assert before == digests_of("simulation"), "a copy is the same"
    with open(copy / name, "a") as file:
        file.write("# changed\n")
    after = of("simulation")
    assert after.keys() == before.keys()
    assert [key for key in before if after[key] != before[key]] == [name]


def test_a_new_import_is_followed_wherever_it_stands(copy):
    """At the top or in a function; not one for type checkers alone, nor from elsewhere."""
    (copy / "physics" / "wind.py").write_text("from .gusts import calm\nimport numpy\n")
    (copy / "physics" / "gusts.py").write_text("def calm():\n    from .. import sun\n")
    (copy / "sun.py").write_text("from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from . import moon\n")
    (copy / "moon.py").write_text("")
    text = (copy / "mpm" / "steps.py").read_text()
    (copy / "mpm" / "steps.py").write_text(f"{text}\n\ndef late():\n    from ..physics import wind\n")
    new = of("simulation").keys() - digests_of("simulation").keys()
    assert new == {"physics/wind.py", "physics/gusts.py", "sun.py"}


def test_modules_that_import_each_other_have_an_end(copy):
    """Each once."""
    (copy / "one.py").write_text("from . import other\n")
    (copy / "other.py").write_text("from .one import x\n")
    assert of("one").keys() == {"one.py", "other.py"}
