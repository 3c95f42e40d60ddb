"""The reading half works on a machine without Taichi, and says so where a simulation is asked for."""

import os
import subprocess
import sys

import pytest

from snowrepro.sweep import record
from snowrepro.sweep.plan import make_plan
from tests.conftest import SMALL
from tests.report import small_runs

# Then an import of either fails as if it were not installed.
BLOCK = "import sys; sys.modules['taichi'] = sys.modules['quadrants'] = None\n"
# What computes, and what checks that.
COMPUTING = ("laws", "mpm", "physics", "point", "rules", "simulation", "sintering_map", "checks")
COMPUTING_TOO = ("__main__", "sweep.together", "cli.checking", "verbs.check", "verbs.bless", "verbs.point")
IMPORT_ALL = f"""
import importlib, pkgutil, sys, snowrepro
names = [m.name for m in pkgutil.walk_packages(snowrepro.__path__, "snowrepro.")]
reading = [n for n in names if n.split(".")[1] not in {COMPUTING} and not n.endswith({COMPUTING_TOO})]
for name in reading:
    importlib.import_module(name)
print(len(reading))
"""
READ_SWEEP = """
import snowrepro
sweep = snowrepro.open_sweep("mine", "runs")
print(int((sweep.state == "done").sum()), float(sweep.lump_fraction.max()) > 0)
print(snowrepro.classify(snowrepro.open_run(str(sweep.run_id.values.ravel()[0]))).lump_fraction >= 0)
"""
WITHOUT_PICTURES = """
import sys, snowrepro.evidence.gather, snowrepro.evidence.claims, snowrepro.checks.verdicts
print("matplotlib" in sys.modules)
"""


@pytest.fixture
def store(small_run, tmp_path):
    """A folder with a remembered sweep of four finished runs."""
    runs = small_runs.saved(small_run, tmp_path / "runs", vanish=False)
    varied = ["sintering=paper,none", "pressure=500,3000", "experiment=fig5", "experiment.frames=[0,20,60]"]
    plan = make_plan([*SMALL, *varied, f"store={tmp_path}/runs"], multirun=True)
    assert {run.id for run in plan.runs} == {run.id for run in runs}
    folder = record.write_record(plan)
    folder.rename(folder.with_name("mine"))
    (tmp_path / "blocked").mkdir()
    (tmp_path / "blocked" / "sitecustomize.py").write_text(BLOCK)
    return tmp_path


@pytest.fixture
def python(store):
    """Runs Python there, without Taichi."""

    def call(*arguments):
        paths = [str(store / "blocked"), os.environ.get("PYTHONPATH", "")]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
        return subprocess.run(
            [sys.executable, *arguments], cwd=store, env=environment, capture_output=True, text=True, timeout=120
        )

    return call


def test_all_modules_that_read_can_be_imported(python):
    done = python("-c", IMPORT_ALL)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 60


def test_a_sweep_is_opened_and_classified(python):
    done = python("-c", READ_SWEEP)
    assert done.stdout.split() == ["4", "True", "True"], done.stderr


@pytest.mark.nightly
def test_report_status_and_classify_work(python, store):
    status = python("-m", "snowrepro", "status")
    assert status.returncode == 0 and "mine: 4 done" in status.stdout, status.stderr
    report = python("-m", "snowrepro", "report", "mine")
    assert report.returncode == 0, report.stderr
    assert (store / report.stdout.splitlines()[-1].removeprefix("report: ")).is_file()
    run_id = next(path.name for path in (store / "runs").iterdir() if path.name.startswith("ball"))
    classify = python("-m", "snowrepro", "classify", run_id, "break_strain=0.2")
    assert classify.returncode == 0 and "lump_fraction" in classify.stdout, classify.stderr


@pytest.mark.parametrize("command", [["run", *SMALL], ["check", "--tier", "0"]])
def test_a_simulation_is_refused_in_one_message(python, store, command):
    """Nothing is recorded as failed: elsewhere the run can be made."""
    before = sorted((store / "runs").rglob("*"))
    done = python("-m", "snowrepro", *command)
    assert done.returncode == 2
    assert "needs Taichi, which is not installed here" in done.stderr and "Traceback" not in done.stderr
    assert sorted((store / "runs").rglob("*")) == before


def test_a_claim_is_checked_without_pictures():
    """What judges claims imports no Matplotlib."""
    done = subprocess.run([sys.executable, "-c", WITHOUT_PICTURES], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
