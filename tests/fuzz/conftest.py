"""A store that is made once, and copied for each use."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.fuzz import stores


@pytest.fixture(scope="session")
def made(small_run, tmp_path_factory) -> tuple[Path, list[str]]:
    """The store, and the ids of its runs."""
    store = tmp_path_factory.mktemp("made") / "runs"
    return store, stores.build(small_run, store)


@pytest.fixture
def surrounded(made, tmp_path) -> Callable[[], tuple[Path, Path]]:
    """Copies the store into a folder with surroundings; returns a function that gives that folder and the store."""
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / ".bashrc").write_text("alias ls=ls\n")
    (tmp_path / "outside" / "copy").mkdir(parents=True)
    (tmp_path / "outside" / "precious.txt").write_text("precious\n")

    def copy() -> tuple[Path, Path]:
        cwd = tmp_path / "cwd"
        shutil.rmtree(cwd, ignore_errors=True)
        (cwd / "out").mkdir(parents=True)
        shutil.copytree(made[0], cwd / "runs", symlinks=True)
        for path in made[0].rglob("*"):
            if path.is_file():
                shutil.copystat(path, cwd / "runs" / path.relative_to(made[0]))
        return cwd, cwd / "runs"

    return copy
