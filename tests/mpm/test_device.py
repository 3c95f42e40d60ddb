"""What Taichi computes on is asked of Taichi, and what its environment says is left out."""

import os

import pytest
import taichi as ti

from snowrepro.errors import ConfigError
from snowrepro.mpm import device, home


def test_the_device_is_the_one_that_taichi_started(taichi):
    """Another one than was asked for is an error."""
    assert device.read_device() == ti.cpu.name
    device.require_device("cpu")
    with pytest.raises(ConfigError, match=f"solver.device=cuda asks for cuda, and Taichi computes on {ti.cpu.name}"):
        device.require_device("cuda")


def test_only_settings_that_change_nothing_are_left_to_taichi(monkeypatch):
    """What is taken out is kept, to be said."""
    monkeypatch.setattr(home, "left_out", {})
    harmless = {"TI_LOG_LEVEL": "error", "TI_OFFLINE_CACHE_FILE_PATH": "/x", "TI_PRINT_IR": "0", "TINY": "1"}
    others = {"TI_ARCH": "vulkan", "TI_DEBUG": "1", "TI_OPT_LEVEL": "0", "TI_DEFAULT_FP": "32", "TI_NEW": "?"}
    for name, value in {**harmless, **others}.items():
        monkeypatch.setenv(name, value)
    home.leave_settings_out()
    assert home.left_out == others
    assert {**harmless, **others}.keys() & os.environ.keys() == harmless.keys()
