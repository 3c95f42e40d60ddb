"""The command line as a user meets it: processes, exit codes, and the disk afterwards."""

import functools
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from tests.command_line import run_new
from tests.conftest import SMALL

ROOT = Path(__file__).parents[2]


def results(folder: Path) -> list[Path]:
    return sorted((folder / "runs").glob("*/run.nc")) if (folder / "runs").exists() else []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["shape=bal"], "there is no shape 'bal'; there are: ball"),
        (["pressure=-1"], "pressure: should be greater than or equal to 0"),
        (["floor.drop_x=10"], "does not fit the domain"),
        (["store=/proc/nowhere"], "cannot write into the folder '/proc/nowhere'"),
    ],
)
def test_bad_input_is_one_line_and_exit_2(snowrepro, tmp_path, arguments, message):
    """No traceback, no folder, no result."""
    done = snowrepro("run", *arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert "Traceback" not in done.stderr + done.stdout
    assert list(tmp_path.iterdir()) == []


def test_a_diverging_run_fails_with_exit_3(snowrepro, tmp_path):
    """pressure=1e9: the reason on the screen and in the folder, and nothing that counts as done."""
    done = snowrepro("run", "pressure=1e9", "fidelity=preview")
    assert done.returncode == 3
    assert "error: diverged in frame" in done.stderr
    assert "Traceback" not in done.stderr
    assert results(tmp_path) == []
    (failed,) = (tmp_path / "runs" / ".work").glob("*/outcome.json")
    assert json.loads(failed.read_text())["state"] == "failed"
    assert "diverged in frame" in json.loads(failed.read_text())["message"]
    asked = snowrepro("classify", failed.parent.name)
    assert asked.returncode == 2
    assert f"the run '{failed.parent.name}' has no result: it is not at its end, or it failed" in asked.stderr


@pytest.mark.parametrize(
    ("word", "hint"), [("repot", "did you mean 'report'?"), ("xyz", "'snowrepro --help' lists what there is")]
)
def test_an_unknown_command_is_one_short_line(snowrepro, tmp_path, word, hint):
    done = snowrepro(word, "fig5")
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == f"snowrepro: error: '{word}' is no command; {hint}"
    assert list(tmp_path.iterdir()) == []


def test_a_run_explains_itself_and_is_found_done(tmp_path):
    """One file with units everywhere; the second call simulates nothing and says the same.

    In processes as a user has them.
    """
    snowrepro = functools.partial(run_new, cwd=tmp_path)
    first = snowrepro("run", *SMALL)
    assert first.returncode == 0, first.stderr
    (path,) = results(tmp_path)
    assert first.stdout.splitlines()[-1] == str(path.relative_to(tmp_path))
    assert re.match(r".*\d+ % of the mass is ", first.stdout.splitlines()[0])
    assert re.search(r"^pressure +2900 kg cell⁻¹ s⁻²$", first.stdout, re.MULTILINE)
    assert f"snowrepro explain {path.parent.name} " in first.stderr
    with xr.open_dataset(path) as run:
        assert {"x", "y", "snapshot_time"} <= set(run.coords) and run.attrs["Conventions"].startswith("CF-")
        assert {"velocity_x", "velocity_y", "density", "young", "poisson", "hardening", "J_P", "von_mises"} <= set(run)
        assert {"substeps", "total_mass", "momentum_x", "kinetic_energy", "poisson_capped"} <= set(run)
        assert all(run[name].attrs.get("units") for name in run.variables)
        assert {"config", "versions", "seed", "git_state", "machine", "run_id"} <= set(run.attrs)
    written = path.stat().st_mtime_ns
    second = snowrepro("run", *SMALL)
    assert second.returncode == 0
    assert second.stdout == first.stdout
    assert path.stat().st_mtime_ns == written
    shown = snowrepro("classify", path.parent.name)
    assert shown.returncode == 0
    assert shown.stdout.splitlines() == first.stdout.splitlines()[:-1]
    later = snowrepro("classify", path.parent.name, "--release", "40", "volume_change=[5,6]")
    assert later.returncode == 0, later.stderr
    assert re.search(r"^lump_fraction +1$", later.stdout, re.MULTILINE)


def test_two_processes_give_the_same_bits(tmp_path):
    """Two runs at once in two processes agree in every bit of every array."""
    command = [sys.executable, "-m", "snowrepro", "run", *SMALL, "pressure=3000"]
    folders = [tmp_path / name for name in "ab"]
    for folder in folders:
        folder.mkdir()
    running = [subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL) for folder in folders]
    assert [process.wait(timeout=300) for process in running] == [0, 0]
    one, other = (xr.open_dataset(results(folder)[0]).load() for folder in folders)
    assert float(one.mean_hardening[-1]) > 10
    for name in one.variables:
        np.testing.assert_array_equal(one[name].values, other[name].values, err_msg=name)


def test_a_sweep_skips_what_is_done(snowrepro, tmp_path):
    """-m runs what is not done of the product; the second call has nothing to do; each run has its own file.

    At the end it says how the sweep is called, where its table is, and what can be done next.
    """
    snowrepro("run", "pressure=500", *SMALL)
    (early,) = results(tmp_path)
    stamp = early.stat().st_mtime_ns
    sweep = ["run", "-m", "pressure=500,3000", "sintering=paper,none", *SMALL]
    first = snowrepro(*sweep)
    assert first.returncode == 0, first.stderr
    assert len(results(tmp_path)) == 4
    assert early.stat().st_mtime_ns == stamp
    assert "4 runs, 1 of them done" in first.stderr
    assert first.stderr.count(": done in") == 3
    assert re.search(r"wall time \d+:\d\d for 3 runs; 0\.\d{3} core-hours in all", first.stderr)
    assert len(re.findall(r": lump [\d.]+, crushed [\d.]+, loose [\d.]+\n", first.stdout)) == 4
    (name,) = re.findall(r"^sweep: (\S+)$", first.stdout, re.MULTILINE)
    assert f"\ntable: runs/sweeps/{name}/results.csv\n" in first.stdout
    assert (tmp_path / "runs" / "sweeps" / name / "results.csv").is_file()
    assert f"\nnext:  snowrepro report {name}\n" in first.stdout
    assert first.stdout.endswith(f"snowrepro plot {name} x=pressure y=lump_fraction colour=sintering\n")
    stamps = [path.stat().st_mtime_ns for path in results(tmp_path)]
    second = snowrepro(*sweep)
    assert "4 runs, 4 of them done" in second.stderr
    assert second.stdout == first.stdout
    assert [path.stat().st_mtime_ns for path in results(tmp_path)] == stamps


def test_one_diverged_run_does_not_stop_the_others(snowrepro, tmp_path):
    """The sweep keeps going, names the failed run and exits with 3; the report shows it as missing."""
    done = snowrepro(
        "run", "experiment=fig5", "pressure=500,1e9", "sintering=none", "experiment.frames=[0,20,60]", *SMALL
    )
    assert done.returncode == 3
    assert len(results(tmp_path)) == 1
    assert "1 of 2 runs have no result" in done.stderr
    assert "Traceback" not in done.stderr
    (page,) = (tmp_path / "my_reports").glob("fig5,*/index.md")
    assert "**missing** (failed): ball on L, 1e\\+09, none, seed 0: diverged in frame" in page.read_text()
    assert "REPRODUCED" not in page.read_text().split("**C4.**")[1].splitlines()[0]


@pytest.mark.nightly
def test_claims_runs_judges_and_writes(snowrepro, tmp_path):
    """Runs of every seed, a table on the screen, four files; called again it runs nothing and says the same."""
    tiny = ["claims", "experiment=fig5", "pressure=500,3000", "sintering=paper", "seeds=2"]
    tiny += ["experiment.frames=[0,20,60]", *SMALL]
    first = snowrepro(*tiny)
    assert first.returncode == 0, first.stderr
    assert "4 runs, 0 of them done" in first.stderr
    assert {path.parent.name.split("-")[-2] for path in results(tmp_path)} == {"0", "1"}
    (folder,) = (tmp_path / "my_reports").iterdir()
    assert {"index.html", "response.png", "claims.json", "claims.csv"} <= {path.name for path in folder.iterdir()}
    assert first.stdout.splitlines()[-1] == f"report: my_reports/{folder.name}/index.html"
    words = {v["claim"]: v["shown"] for v in json.loads((folder / "claims.json").read_text())["scenes"][0]["verdicts"]}
    for claim, word in words.items():
        (line,) = [line for line in first.stdout.splitlines() if line.startswith(f"{claim} ")]
        assert line.endswith(f" {word}")
    assert "INCONCLUSIVE" in words["C1"]  # two seeds: the interval is six times their sd
    assert words["C4"] == words["C5"] == "NOT RUN"
    stamps = [path.stat().st_mtime_ns for path in results(tmp_path)]
    second = snowrepro(*tiny)
    assert "4 runs, 4 of them done" in second.stderr
    assert second.stdout == first.stdout
    assert [path.stat().st_mtime_ns for path in results(tmp_path)] == stamps


@pytest.mark.nightly
def test_claims_with_a_failed_run_are_not_run(snowrepro, tmp_path):
    """Exit code 3 with the reason, after the verdicts on what is there."""
    done = snowrepro("claims", "experiment=fig6", "pressure=500,1e9", "sintering=none", "seeds=1",
                     "experiment.frames=[0,20,60]", *SMALL)  # fmt: skip
    assert done.returncode == 3
    assert "1 of 2 runs have no result" in done.stderr and "diverged in frame" in done.stderr
    assert "Traceback" not in done.stderr
    (line,) = [line for line in done.stdout.splitlines() if line.startswith("C4 ")]
    assert line.endswith("NOT RUN")
    assert "no result at 1e+09" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "the runs of one experiment, for example experiment=fig5"),
        (["experiment=fig5", "seeds=0"], "seeds: should be 1 to 100 (got 0)"),
        (["experiment=fig5", "seeds=two"], "seeds: should be one whole number of at least 1 (got two)"),
        (["experiment=fig5", "seeds=2", "seeds=3"], "seeds: should be one whole number of at least 1 (got 2, 3)"),
        (["experiment=fig5", "seed=1"], "leave out the override of seed"),
        (["experiment=convergence"], "claims are not judged by 'convergence', but by a strip or grid"),
        (["experiment=fig5", "solver.cfl=0.1,0.2"], "two of the runs are ball on L, sintered, pressure 300, seed 0"),
        pytest.param(["experiment=table1"], "claims are not judged by 'table1'", marks=pytest.mark.nightly),
        pytest.param(["experiment=fig2"], "claims are not judged by 'fig2', but by", marks=pytest.mark.nightly),
        (["experiment=fig5", "store=/proc/nowhere"], "cannot write into the folder '/proc/nowhere'"),
    ],
)
def test_claims_that_cannot_be_judged_are_refused(snowrepro, tmp_path, arguments, message):
    """One line, exit code 2, nothing on disk."""
    done = snowrepro("claims", *arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("sweep", "with_signal"),
    [(False, "SIGINT"), (True, "SIGINT"), pytest.param(True, "SIGTERM", marks=pytest.mark.nightly)],
)
def test_an_interrupt_stores_nothing(tmp_path, sweep, with_signal):
    """Ctrl-C, or a batch system's end, in mid-run: one line, exit code 130, no result, no scraps."""
    command = [sys.executable, "-m", "snowrepro", "run", "fidelity=preview"]
    command += ["-m", "pressure=2000,3000"] if sweep else []
    process = subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # ignored where tests run in the background
    )  # fmt: skip
    deadline = time.monotonic() + 120
    while not list(tmp_path.glob("runs/.work/*/progress.json")) and time.monotonic() < deadline:
        time.sleep(0.05)
    if with_signal == "SIGINT":
        os.killpg(process.pid, signal.SIGINT)  # the terminal's Ctrl-C reaches every process
    else:
        process.terminate()
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "interrupted" in errors
    assert "Traceback" not in errors
    assert results(tmp_path) == []
    assert not list(tmp_path.glob("runs/**/*.part"))
    assert not list(tmp_path.glob("runs/.work/*/progress.json"))


def test_kill_9_stores_nothing_and_the_next_call_mends_it(snowrepro, tmp_path):
    """A run that was killed is simply not done; running it again completes it."""
    command = [sys.executable, "-m", "snowrepro", "run", *SMALL]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    while not list(tmp_path.glob("runs/.work/*/progress.json")) and time.monotonic() < deadline:
        time.sleep(0.02)
    process.kill()
    process.wait()
    assert results(tmp_path) == []
    assert snowrepro("run", *SMALL).returncode == 0
    assert len(results(tmp_path)) == 1
    assert not list(tmp_path.glob("runs/.work/*/progress.json"))


@pytest.mark.nightly
def test_own_options_as_the_documentation_shows(snowrepro, tmp_path):
    """Its floor of points and snow of an SVG path, in one run, in a sweep, and in the list of names."""
    page = (ROOT / "docs" / "scenes.md").read_text()
    blocks = re.findall(r"```yaml\n# (conf/(?!hydra)\S+)\n(.*?)```", page, re.DOTALL)
    assert [name for name, _ in blocks] == ["conf/floor/gutter.yaml", "conf/floor/cave.yaml", "conf/shape/drop.yaml"]
    for name, text in blocks:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    assert snowrepro("run", "shape=drop", "floor=gutter", *SMALL).returncode == 0
    assert snowrepro("run", "shape=drop", "floor=cave", *SMALL).returncode == 0
    assert snowrepro("run", "-m", "shape=drop,ball", "floor=gutter", "pressure=500", *SMALL).returncode == 0
    assert sorted(path.parent.name.split("-")[0] for path in results(tmp_path)) == ["ball", "drop", "drop", "drop"]
    assert "there are: ball, drop, rectangle, star, triangle" in snowrepro("run", "shape=horse").stderr


@pytest.mark.parametrize("command", ["run", "claims"])
def test_help_names_the_exit_codes(snowrepro, command):
    done = snowrepro(command, "--help")
    assert done.returncode == 0
    assert "exit codes" in done.stdout
    assert "130 interrupted" in done.stdout


def test_config_prints_what_would_run(snowrepro):
    done = snowrepro("config", "pressure=7", "reading=si")
    assert done.returncode == 0
    assert "pressure: 7" in done.stdout
    assert "length_unit: m" in done.stdout
