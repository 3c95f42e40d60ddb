"""What Taichi computes on is asked of Taichi, and what its environment says is left out."""

import os

import pytest

from snowrepro.compiler import COMPILERS, VARIABLE, name_compiler, ti
from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError
from snowrepro.mpm import device, home, solver
from snowrepro.mpm.taichi_private import find_program
from snowrepro.run import warn_of_settings_left_out

START = COMPILERS[name_compiler()]  # of the names of its variables


def test_the_device_is_the_one_that_taichi_started(taichi):
    """Another one than was asked for is an error."""
    assert device.read_device() == ti.cpu.name
    device.require_device("cpu")
    with pytest.raises(
        ConfigError, match=f"solver.device=cuda asks for cuda, and {name_compiler()} computes on {ti.cpu.name}"
    ):
        device.require_device("cuda")


def test_only_settings_that_change_nothing_are_left_to_taichi(monkeypatch):
    """What is taken out is kept, to be said."""
    monkeypatch.setattr(home, "left_out", {})
    harmless = {"LOG_LEVEL": "error", "OFFLINE_CACHE_FILE_PATH": "/x", "PRINT_IR": "0"}
    others = {"ARCH": "vulkan", "DEBUG": "1", "OPT_LEVEL": "0", "DEFAULT_FP": "32", "NEW": "?"}
    harmless, others = ({f"{START}{name}": value for name, value in each.items()} for each in (harmless, others))
    harmless |= {"TINY": "1", "QDRANT": "1"}
    for name, value in {**harmless, **others}.items():
        monkeypatch.setenv(name, value)
    home.leave_settings_out()
    assert home.left_out == others
    assert {**harmless, **others}.keys() & os.environ.keys() == harmless.keys()


def configuration():
    """All that Taichi says of how it compiles and what it computes on, but not of what it prints, as text by name."""
    config = find_program().config()
    names = [name for name in dir(config) if not name.startswith(("_", "print_"))]
    return {name: str(getattr(config, name)) for name in names}


def test_a_gpu_is_left_to_the_compiler_that_was_checked_there(monkeypatch):
    """Refused before anything starts."""
    monkeypatch.setattr(solver, "name_compiler", lambda: "quadrants")
    with pytest.raises(ConfigError, match="=cuda needs taichi"):
        solver.start_taichi(compose(["solver=cuda"]).case.solver, threads=1)


@pytest.mark.parametrize("setting", ["ARCH=vulkan", "OPT_LEVEL=0", "DEBUG=1", "REAL_MATRIX_SCALARIZE=0"])
def test_what_is_set_while_the_program_runs_moves_nothing(taichi, monkeypatch, setting):
    """As in a notebook, behind the import: Taichi would read it at its next start."""
    monkeypatch.setattr(home, "left_out", {})
    before = configuration()
    name, value = f"{START}{setting}".split("=")
    monkeypatch.setenv(name, value)
    solver.start_taichi(compose().case.solver, threads=1)
    assert configuration() == before
    assert home.left_out == {name: value}


def test_each_set_of_settings_left_out_is_said_once(monkeypatch, caplog):
    """Again where another comes, and not at each run."""
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(home, "left_out", {})
    for value in ("0", "0", "2"):
        monkeypatch.setenv(f"{START}OPT_LEVEL", value)
        warn_of_settings_left_out()
    assert [record.getMessage().split(";")[0] for record in caplog.records] == [
        f"not used: {START}OPT_LEVEL={value}" for value in ("0", "2")
    ]
