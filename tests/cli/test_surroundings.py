"""The command line where a process lacks something, or where its surroundings were made for other programs."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from snowrepro.composition.compose import compose
from snowrepro.run import simulate
from snowrepro.store.bits import digests

SHORT = ("fidelity=preview", "loading.press_frames=4", "loading.frames=8", "output.every=4")
PROGRAM = [sys.executable, "-m", "snowrepro"]


def test_streams_that_are_closed_or_full(snowrepro, tmp_path):
    """A closed stream is like one that nobody reads; a full one is said in a line."""
    for redirection in (">&-", ">&- 2>&-", "<&- >&- 2>&-"):
        done = subprocess.run(
            ["sh", "-c", f'"$0" -m snowrepro plan {redirection}', sys.executable], cwd=tmp_path, capture_output=True
        )
        assert (done.returncode, done.stderr) == (0, b"")
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([*PROGRAM, "config"], cwd=tmp_path, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2
    assert done.stderr == "error: standard output: No space left on device\n"


def test_a_stream_of_few_letters(snowrepro):
    """What it lacks is written as an escape."""
    done = snowrepro("plan", "store=\u00fc", env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert done.returncode == 0
    assert r"store '\xfc'" in done.stdout


@pytest.mark.parametrize("columns", ["0", "00", "-1", "many", ""])
def test_a_screen_of_no_width(snowrepro, columns):
    done = snowrepro("plan", "shape=nope", env={**os.environ, "COLUMNS": columns})
    assert done.stderr == "error: there is no shape 'nope'; there are: ball, rectangle, star, triangle\n"


@pytest.mark.nightly
def test_settings_for_other_figures_change_none_of_ours(snowrepro, tmp_path):
    """A backend for notebooks, and a user's style."""
    assert snowrepro("run", "experiment=fig2", "fidelity=preview", "reports=plain").returncode == 0
    (tmp_path / "matplotlibrc").write_text("font.size: 30\naxes.facecolor: red\nsavefig.dpi: 10\n")
    backend = {**os.environ, "MPLBACKEND": "module://matplotlib_inline.backend_inline"}
    done = snowrepro("run", "experiment=fig2", "fidelity=preview", "reports=styled", env=backend)
    assert done.returncode == 0, done.stderr
    plain, styled = (sorted((tmp_path / name).glob("*/*.png")) for name in ("plain", "styled"))
    assert [path.read_bytes() for path in plain] == [path.read_bytes() for path in styled] != []


@pytest.mark.parametrize(
    "home", ["/proc/nowhere", *(pytest.param(home, marks=pytest.mark.nightly) for home in (None, "relative", ""))]
)
def test_a_process_without_a_home(snowrepro, tmp_path, home):
    """Taichi would end the process, or crash at its end behind a good result."""
    environment = {name: value for name, value in os.environ.items() if name != "HOME"}
    done = snowrepro("run", *SHORT, env=environment if home is None else {**environment, "HOME": home})
    assert done.returncode == 0, done.stderr
    assert len(list(tmp_path.glob("runs/*/run.nc"))) == 1


def test_taichis_own_settings_move_no_run(snowrepro, tmp_path):
    """TI_ARCH would take it to another device, others change its bits: they are not used, and that is said.

    What the run was computed on stands in its manifest.
    """
    settings = {"TI_ARCH": "vulkan", "TI_ADVANCED_OPTIMIZATION": "0"}
    done = snowrepro("run", "-m", "seed=0", *SHORT, env={**os.environ, **settings})
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("not used: TI_ADVANCED_OPTIMIZATION=0, TI_ARCH=vulkan;") == 1
    (path,) = tmp_path.glob("runs/*/manifest.json")
    written = json.loads(path.read_text())
    assert written["device"] in ("x64", "arm64")
    assert written["arrays"] == digests(simulate(compose(SHORT)))
    assert f"computed on {written['device']}\n" in snowrepro("explain", written["run_id"]).stdout


@pytest.mark.nightly
def test_a_sweep_with_a_long_path_for_temporary_files(snowrepro, tmp_path):
    """Longer than a socket's path can be; and a range that Hydra itself does not know, which it has to launch."""
    long = tmp_path / ("long" * 30)
    long.mkdir()
    done = snowrepro("run", "-m", "seed=linspace(1,2,2)", *SHORT, env={**os.environ, "TMPDIR": str(long)})
    assert done.returncode == 0, done.stderr
    assert len(list(tmp_path.glob("runs/*/run.nc"))) == 2
    assert list(long.iterdir()) == []


@pytest.mark.nightly
def test_what_a_killed_sweep_left_goes_at_the_next_start(snowrepro, tmp_path):
    """Its folder for short-lived files; that of a sweep that goes on stays."""
    scratch = Path(tempfile.mkdtemp(prefix="s", dir="/tmp"))  # a long path would be passed over
    environment = {**os.environ, "TMPDIR": str(scratch)}
    words = [*PROGRAM, "run", "-m", "seed=1,2,3", "fidelity=preview"]
    sweeps = [subprocess.Popen([*words, f"store={n}"], cwd=tmp_path, env=environment) for n in range(2)]
    for _ in range(600):
        if len(list(scratch.glob("*/pymp-*"))) == 2:
            break
        time.sleep(0.1)
    before = set(scratch.iterdir())
    assert len(before) == 2
    sweeps[0].send_signal(signal.SIGKILL)
    sweeps[0].wait()
    sweeps[1].send_signal(signal.SIGSTOP)
    done = snowrepro("run", "-m", "seed=1,2", *SHORT, "store=2", env=environment)
    assert done.returncode == 0, done.stderr
    left = set(scratch.iterdir())
    sweeps[1].send_signal(signal.SIGCONT)
    sweeps[1].send_signal(signal.SIGTERM)
    sweeps[1].wait()
    assert len(left) == 1 and left < before
    scratch.rmdir()


@pytest.mark.nightly
def test_the_store_has_one_name_in_every_verb(snowrepro, tmp_path):
    """Whether or not its name has letters that mean something to Hydra, in quotes or not."""
    name = "my (first) runs = [1]"
    assert snowrepro("run", "-m", "seed=1", *SHORT, f"store={name}").returncode == 0
    for word in (f"store={name}", f"store='{name}'"):
        listed = snowrepro("status", word).stdout
        assert listed.count("1 done") == 1, listed
        done = snowrepro("plan", listed.partition(":")[0], word)
        assert done.stdout.startswith("1 run, 1 of them done"), done
    assert {path.name for path in tmp_path.iterdir() if path.is_dir()} == {name}
