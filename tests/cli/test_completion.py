"""What Tab completes: asked as argcomplete's scripts ask, and in real shells where they are installed."""

import json
import os
import pty
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from snowrepro.cli import candidates
from snowrepro.cli.verbs import clean
from snowrepro.composition.compose import CONF_DIR
from snowrepro.store import folders, leftovers
from snowrepro.sweep import record

pytest.importorskip("argcomplete")
PATIENCE = 60
SWEEP = "fig5,fidelity=preview"
RUN, ASKED = "ball-L-530-paper-paper-0-2f63b27e3e", "star-stair3-530-none-paper-0-0b9a8e9d2c"


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """A working folder with a sweep, a finished run, one that is only asked for; a floor, an experiment of the user."""
    monkeypatch.chdir(tmp_path)
    for name in (f"runs/{RUN}", "runs/.work", f"runs/sweeps/{SWEEP}", "conf/floor", "other/sweeps/grid", "data"):
        Path(name).mkdir(parents=True)
    cells = {"pressure=530": RUN, "pressure=530 sintering=none": ASKED}
    written = {"name": SWEEP, "overrides": ["experiment=fig5"], "recorded": "2026-01-01", "cells": cells}
    Path(f"runs/sweeps/{SWEEP}/sweep.json").write_text(json.dumps(written))
    Path("other/sweeps/grid/sweep.json").write_text(json.dumps({**written, "name": "grid", "cells": {}}))
    Path(f"runs/sweeps/{SWEEP}/results.csv").write_text("pressure,run_id,state,reason,lump_fraction,lumps,=1+1\n")
    Path("conf/floor/gutter.yaml").write_text("name: gutter\n")
    Path("experiments").mkdir()
    Path("experiments/stairs.yaml").touch()
    Path("other.nc").touch()
    return tmp_path


@pytest.fixture
def shell_path(tmp_path) -> str:
    """PATH with this program as ``snowrepro``."""
    program = tmp_path / "bin" / "snowrepro"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m snowrepro "$@"\n')
    program.chmod(0o755)
    return f"{program.parent}{os.pathsep}{os.environ['PATH']}"


def complete(line: str) -> list[str]:
    """What argcomplete answers a shell that splits words at blanks alone."""
    asked = {"_ARGCOMPLETE": "1", "_ARGCOMPLETE_IFS": "\n", "_ARGCOMPLETE_SHELL": "fish", "COMP_LINE": line}
    asked |= {
        "COMP_POINT": str(len(line)),
        "_ARGCOMPLETE_SUPPRESS_SPACE": "1",
        "_ARGCOMPLETE_STDOUT_FILENAME": "answer",
    }
    subprocess.run([sys.executable, "-m", "snowrepro"], env=os.environ | asked, check=True, timeout=PATIENCE)
    return Path("answer").read_text().split("\n")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("snowrepro re", ["retry", "report", "redo"]),
        ("snowrepro run --", ["--help", "--multirun", "--part", "--no-report", "--store", "--reports"]),
        ("snowrepro run sha", ["shape="]),
        ("snowrepro run see", ["seed=", "seeds="]),
        ("snowrepro run shape=", ["shape=ball", "shape=rectangle", "shape=star", "shape=triangle"]),
        ("snowrepro run -m shape=ball,st", ["shape=ball,star"]),
        ("snowrepro run shape=ball -m floor=g", ["floor=gutter"]),
        ("snowrepro config +experiment=gr", ["+experiment=grid"]),
        ("snowrepro status fig", [SWEEP]),
        ("snowrepro status store=other gr", ["grid"]),
        ("snowrepro status --store other gr", ["grid"]),
        ("snowrepro run experiment=st", ["experiment=stairs"]),
        ("snowrepro crate --store other gr", ["grid"]),
        ("snowrepro report fig5", [SWEEP, "fig5"]),
        ("snowrepro report fig6 --against fig5", [SWEEP, "fig5"]),
        ("snowrepro plot fig", [SWEEP]),
        (f"snowrepro plot {SWEEP} co", ["colour="]),
        (f"snowrepro plot {SWEEP} --log x y=lump", ["y=lump_fraction", "y=lumps"]),
        ("snowrepro plot ../fig5 y=", [""]),
        ("snowrepro retry ball", [RUN]),
        ("snowrepro explain ", [RUN, ASKED]),
        ("snowrepro diff fig", [SWEEP]),
        (f"snowrepro diff {RUN} st", [ASKED]),
        ("snowrepro redo ba", [RUN]),
        ("snowrepro redo ot", ["other/", "other.nc"]),
        ("snowrepro classify other.nc break", ["break_strain=", "break_by="]),
        ("snowrepro clean un", ["unfinished", "unused"]),
        ("snowrepro animate --by d", ["density", "damage"]),
        ("snowrepro crate --out da", ["data/"]),
        ("snowrepro crate --agent da", [""]),
        ("snowrepro completion ", ["bash", "zsh", "fish"]),
    ],
)
def test_what_can_follow(folder, line, words):
    """Verbs, options, overrides, sweeps, runs, files; of the store and the conf/ that are meant."""
    assert complete(line) == words


def test_a_word_is_completed_without_what_takes_seconds(folder):
    """A Tab loads neither Hydra nor arrays."""
    code = (
        "import argparse, sys; from snowrepro.cli import candidates as c; options = argparse.Namespace(store='runs')"
        "\nfor name in ('list_overrides', 'list_sweeps', 'list_runs', 'list_files', 'list_analysis_settings'):"
        "\n    assert list(getattr(c, name)(prefix='', parsed_args=options)), name"
        "\nprint([name for name in ('hydra', 'numpy', 'pydantic', 'yaml') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, timeout=PATIENCE)
    assert done.stdout == "[]\n", done.stderr


def test_names_are_those_of_the_rest_of_the_program():
    """Folders of the store and of options, which candidates.py says itself to be quick."""
    assert candidates.BUILT_IN == CONF_DIR
    assert (candidates.SWEEPS, candidates.RECORD, candidates.WORK) == (record.SWEEPS, record.RECORD, folders.WORK)
    assert candidates.find_kinds(clean.HELP) == [*leftovers.KINDS]


@pytest.mark.parametrize(
    ("typed", "completed"),
    [
        ("snowrepro expl", "snowrepro explain"),
        ("snowrepro run flo", "snowrepro run floor="),
        ("snowrepro run -m shape=ball,st", "snowrepro run -m shape=ball,star"),
        ("snowrepro explain ball", f"snowrepro explain {RUN}"),
        ("snowrepro status fig5", f"snowrepro status {SWEEP}"),
    ],
)
@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_in_a_shell(folder, shell_path, snowrepro, shell, typed, completed):
    """A shell that has read the script makes this of a word and Tab."""
    if not shutil.which(shell):
        pytest.skip(f"{shell} is not installed")
    (folder / "script").write_text(snowrepro("completion", shell).stdout)
    environment = {**os.environ, "PATH": shell_path, "HOME": str(folder), "TERM": "dumb", "PS1": "$ "}
    if shell == "fish":  # which says itself what Tab would give
        asked = f"source script; complete -C '{typed}'"
        done = subprocess.run(
            [shell, "-c", asked], check=False, env=environment, capture_output=True, text=True, timeout=PATIENCE
        )
        assert completed.split()[-1] in [line.split("\t")[0] for line in done.stdout.splitlines()], done.stderr
        return
    start, setup = {
        "bash": (["bash", "--norc", "--noprofile", "-i"], "source ./script"),
        "zsh": (["zsh", "-f", "-i"], "autoload -Uz compinit && compinit -u -D; source ./script; bindkey -e"),
    }[shell]
    assert completed in press_tab(start, setup, typed, completed, environment)


def press_tab(start: list[str], setup: str, typed: str, completed: str, environment: dict[str, str]) -> str:
    """What an interactive shell shows after a word and Tab, until it shows ``completed`` or patience ends."""
    process, terminal = pty.fork()
    if process == 0:
        os.execvpe(start[0], start, environment)

    def read_until(awaited: str) -> str:
        shown, deadline = "", time.monotonic() + PATIENCE
        while awaited not in shown and time.monotonic() < deadline:
            if select.select([terminal], [], [], 0.1)[0]:
                shown += os.read(terminal, 4096).decode()
        return shown

    try:
        os.write(terminal, f"{setup}; echo rea''dy\n".encode())
        read_until("\nready")
        os.write(terminal, f"{typed}\t".encode())
        return read_until(completed)
    finally:
        os.kill(process, 9)
        os.waitpid(process, 0)
        os.close(terminal)


def test_without_argcomplete(folder):
    """The script is refused with what to install; a shell that asks gets nothing; the rest goes on."""
    code = "import sys; sys.modules['argcomplete'] = None; from snowrepro.cli import main; main({})"
    command = [sys.executable, "-c"]
    refused = subprocess.run(
        [*command, code.format(["completion", "bash"])], check=False, capture_output=True, text=True
    )
    assert refused.returncode == 2
    assert refused.stderr == "error: completion needs argcomplete: pip install argcomplete\n"
    asked = {**os.environ, "_ARGCOMPLETE": "1", "COMP_LINE": "snowrepro ", "COMP_POINT": "10"}
    silent = subprocess.run([*command, code.format([])], check=False, env=asked, capture_output=True, text=True)
    assert (silent.returncode, silent.stdout, silent.stderr) == (1, "", "")
