"""A forked process, as most tests of the command line take it, does what a new one does."""

import re
from pathlib import Path

import pytest
import xarray as xr

from snowrepro.store.bits import digests
from tests import command_line

SHORT = ("run", "fidelity=preview", "loading.press_frames=4", "loading.frames=8", "output.every=4")


def files_in(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def without_seconds(text: str) -> list[str]:
    """The lines of a text but those that say how long something took."""
    return [line for line in text.splitlines() if not re.match(r"seconds|.* particles, .* substeps", line)]


@pytest.mark.parametrize("words", [SHORT, ("run", "shape=bal"), ("status", "--help")], ids=lambda words: words[1])
def test_it_says_and_leaves_the_same(tmp_path, words):
    """Exit code, both streams but for how long it took, files, and the bits of the result."""
    folders = {tmp_path / "forked": command_line.run, tmp_path / "new": command_line.run_new}
    said, bits = [], []
    for folder, run in folders.items():
        folder.mkdir()
        done = run(*words, cwd=folder)
        said.append((done.returncode, without_seconds(done.stdout), without_seconds(done.stderr)))
        for path in folder.glob("runs/*/run.nc"):
            with xr.open_dataset(path) as result:
                bits.append(digests(result.load()))
    assert said[0] == said[1]
    assert files_in(tmp_path / "forked") == files_in(tmp_path / "new")
    assert len(bits) == (2 if words == SHORT else 0) and bits[1:] == bits[:-1]


def test_another_environment_is_seen(tmp_path, monkeypatch):
    """By a new process, as the forked one would not."""
    monkeypatch.setattr(command_line, "_call", lambda request: pytest.fail("forked"))
    monkeypatch.setenv("PYTHONVERBOSE", "1")
    assert "# cleanup" in command_line.run("--version", cwd=tmp_path).stderr
