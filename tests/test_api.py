"""What ``import snowrepro`` offers, and what it costs."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import snowrepro
from snowrepro.errors import ConfigError, SnowreproError
from tests.conftest import SMALL

HEAVY = ("taichi", "numpy", "xarray", "matplotlib", "hydra", "pandas", "rich")
LOOK = f"""
import sys, snowrepro
assert "simulate" in dir(snowrepro) and snowrepro.__version__
print([name for name in {HEAVY} if name in sys.modules])
"""
SWEEP = """
import sys, warnings, snowrepro
with warnings.catch_warnings(record=True) as warned:
    warnings.simplefilter("always")
    sweep = snowrepro.run_sweep(sys.argv[1:])
print(sweep.state.values.ravel().tolist(), [str(each.message) for each in warned])
print(sweep.attrs["sweep"] if snowrepro.sweep_table(sweep.attrs["sweep"]).shape[0] == sweep.state.size else "")
"""


def test_all_names_are_listed_and_there():
    """Also in the page on Python."""
    page = (Path(__file__).parents[1] / "docs" / "python.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"^\| `(\w+)\(", page, re.MULTILINE))
    assert listed | {"__version__"} == set(dir(snowrepro)) == set(snowrepro.__all__)
    for name in listed:
        assert callable(getattr(snowrepro, name)) and getattr(snowrepro, name).__doc__


def test_looking_costs_nothing():
    """To import the package, to list its names and to ask for its version loads none of what is heavy."""
    done = subprocess.run([sys.executable, "-c", LOOK], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_name_that_is_not_there():
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = snowrepro.simulat


@pytest.mark.slow  # two runs, in processes of their own
def test_a_sweep_from_a_plain_script(tmp_path):
    """Without a guard around it.  One run diverges: a warning names it, and the other has its result."""
    script = tmp_path / "script.py"
    script.write_text(SWEEP)
    words = [*SMALL, "pressure=500,1e9", "sintering=none"]
    done = subprocess.run([sys.executable, str(script), *words], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    states, name = done.stdout.strip().splitlines()
    assert "'done'" in states and "'failed'" in states and "1 of 2 runs" in states
    assert (tmp_path / "runs" / "sweeps" / name / "results.csv").is_file()


def test_a_wrong_sweep_is_refused_before_anything_is_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match="pressur"):
        snowrepro.run_sweep(["pressur=1,2"])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: snowrepro.simulate(["pressure=1"]), "simulate takes a configuration, not list"),
        (lambda: snowrepro.open_run(3), "a run is named by its id or its path, not by int"),
        (
            lambda: snowrepro.classify(np.eye(9)[None, :, :2], release=0, grid_spacing=1.0, frames="some"),
            "frames is 'some'",
        ),
    ],
)
def test_what_is_no_argument_is_said(call, told):
    with pytest.raises(SnowreproError, match=told):
        call()
