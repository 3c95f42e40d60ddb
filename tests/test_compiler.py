"""The second compiler: which one compiles, that it gives the same bits, and that a result says by which it was made."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from snowrepro import compiler
from snowrepro.checks.cases import CASES
from snowrepro.checks.finding import OK
from snowrepro.checks.fingerprints import find_platform
from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.run import simulate
from snowrepro.store.bits import digests

BASELINE = Path(__file__).parents[1] / "reports" / "baseline"
SHORT = ("fidelity=preview", "loading.press_frames=4", "loading.frames=8", "output.every=4")
OFTEN = ("sintered", "hit")  # of the short runs those that are soon done; the others nightly
TAKE_FINGERPRINTS = """
import sys
from pathlib import Path
from snowrepro.checks.check import CheckRequest, run_checks
for finding in run_checks(CheckRequest(Path(sys.argv[1]), "runs", (1,), cases=sys.argv[2:], experiments=())):
    print(finding.state, finding.name, finding.measured, finding.allowed, sep="; ")
"""
TOLD = """
import importlib
import inspect
import snowrepro.laws.hencky as law
from snowrepro.compiler import IMPORTING
print(inspect.modulesbyfile[law.__file__], IMPORTING in inspect.modulesbyfile)
print(importlib._bootstrap._find_and_load.__code__.co_filename == IMPORTING)
"""
with_quadrants = pytest.mark.skipif(
    importlib.util.find_spec("quadrants") is None, reason="Quadrants is not installed: pip install quadrants"
)
BY_QUADRANTS = {**os.environ, compiler.VARIABLE: "quadrants"}


@pytest.fixture
def installed(monkeypatch):
    """Pretends that only some compilers are installed, and that the environment asks for one; returns the choice."""

    def choose(*names, asked=""):
        monkeypatch.setattr(compiler, "find_spec", lambda name: name in names or None)
        monkeypatch.setenv(compiler.VARIABLE, asked)
        return compiler.name_compiler.__wrapped__()

    return choose


def test_taichi_compiles_where_it_is_and_another_only_where_it_is_asked_for(installed):
    assert installed("taichi", "quadrants") == installed("taichi") == installed() == "taichi"
    assert installed("quadrants") == "quadrants"
    assert installed("taichi", "quadrants", asked="quadrants") == "quadrants"


def test_what_is_asked_for_has_to_be_there(installed):
    """Another one in its place would be a silent choice."""
    with pytest.raises(ConfigError, match="SNOWREPRO_COMPILER=quadrants: it is not installed"):
        installed("taichi", asked="quadrants")
    with pytest.raises(ConfigError, match=r"SNOWREPRO_COMPILER=gcc: .* there are: taichi, quadrants"):
        installed("taichi", asked="gcc")


@with_quadrants
@pytest.mark.parametrize("cases", [OFTEN, pytest.param([*CASES.keys() - {*OFTEN}], marks=pytest.mark.nightly)])
def test_quadrants_gives_the_bits_of_taichi(tmp_path, cases):
    """Those of the fingerprints that are kept of this system and architecture."""
    platforms = json.loads((BASELINE / "fingerprints.json").read_text())["platforms"]
    if find_platform(platforms) not in platforms:
        pytest.skip(f"no fingerprints are kept of this system and architecture, but of {', '.join(platforms)}")
    command = [sys.executable, "-c", TAKE_FINGERPRINTS, str(BASELINE), *cases]
    done = subprocess.run(command, cwd=tmp_path, env=BY_QUADRANTS, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert {line.split("; ")[1] for line in lines} == {*cases}
    assert all(line.startswith(f"{OK}; ") and "the same bits as on" in line for line in lines), done.stdout


@with_quadrants
def test_a_run_says_by_which_compiler_it_was_made(snowrepro, tmp_path):
    """It is the same run, with the same bits; but made in another environment, as ``rerun=[environment]`` sees."""
    done = snowrepro("run", *SHORT, env=BY_QUADRANTS)
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("SNOWREPRO_COMPILER: compiled by quadrants") == 1
    (path,) = tmp_path.glob("runs/*/manifest.json")
    written = json.loads(path.read_text())
    for versions in (written["environment"], written["packages"]):
        assert "quadrants" in versions and "taichi" not in versions
    assert written["arrays"] == digests(simulate(compose(SHORT)))
    assert "1 run, 1 of them done" in snowrepro("plan", *SHORT).stdout
    assert "to run: 1, environment changed" in snowrepro("plan", *SHORT, "rerun=[environment]").stdout


@pytest.mark.slow
@pytest.mark.parametrize("words", [(), ("-m", "seed=1")], ids=["one run", "a run of a sweep"])
def test_a_command_keeps_the_kernels_that_it_made(snowrepro, tmp_path, words):
    """So that the next one has none to compile; of a sweep each run is in a process of its own."""
    kept = tmp_path / "kernels"
    environment = {**os.environ, "TI_OFFLINE_CACHE_FILE_PATH": str(kept)}
    done = snowrepro("run", *SHORT, *words, env=environment)
    assert done.returncode == 0, done.stderr
    files = {path.name for path in kept.rglob("*.tic")}
    assert files, "kernels are kept"
    done = snowrepro("run", *SHORT, *words, "pressure=500", env=environment)
    assert done.returncode == 0, done.stderr
    assert {path.name for path in kept.rglob("*.tic")} == files, "another pressure needs no other kernels"


def test_kernels_are_kept_by_the_compiler_that_was_loaded(monkeypatch):
    """And where none was, none is loaded for it."""
    ended = []
    monkeypatch.setattr(compiler, "sys", SimpleNamespace(modules={"numpy": None}))
    compiler.keep_kernels()
    monkeypatch.setitem(compiler.sys.modules, "quadrants", SimpleNamespace(reset=lambda: ended.append("quadrants")))
    compiler.keep_kernels()
    assert ended == ["quadrants"]


def test_inspect_is_told_of_what_the_compiler_asks_it():
    """Of the file in which functions are decorated, and of that in which Python imports: else it looks for them."""
    done = subprocess.run([sys.executable, "-c", TOLD], capture_output=True, text=True, check=True)
    assert done.stdout == "snowrepro.laws.hencky True\nTrue\n"
