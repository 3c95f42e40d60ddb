"""Where a result comes from: versions, git state, machine, command."""

import functools
import platform
import re
import resource
import shlex
import subprocess
import sys
from collections.abc import Sequence
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from ..compiler import COMPILERS, name_compiler

PACKAGES = ("numpy", "scipy", "xarray", "netCDF4", "hydra-core")
NUMERICAL = ("numpy", "scipy", "shapely")  # those that compute, beside the compiler
CLONE = Path(__file__).resolve().parents[2]  # if this code is in one
# What of a clone a result depends on: reports and documents may change.
SOURCES = ("snowrepro", "hydra_plugins", "conf", "experiments", "pyproject.toml", "requirements.lock")


def provenance() -> dict[str, str]:
    """Attributes for a result; "unknown" where something cannot be told."""
    return {
        "versions": versions(),
        "git_state": _git_state(),
        "machine": f"{platform.system()} {platform.machine()}, {_cpu()}",
        "created": now(),
    }


def now() -> str:
    """The time, as the store writes it down."""
    return datetime.now(timezone.utc).isoformat(timespec="seconds")


def command(overrides: Sequence[str] = ()) -> str:
    """The command line that asks for a run: with these ``overrides``, or the one that started this process.

    Where results were kept is left out: it is of no use elsewhere.
    """
    program = Path(sys.argv[0])
    name = program.parent.name if program.name == "__main__.py" else program.name
    words = ["snowrepro", "run", *overrides] if overrides else [name, *sys.argv[1:]]
    of_option = [index + 1 for index, word in enumerate(words) if word == "--store"]
    return shlex.join(w for i, w in enumerate(words) if i not in of_option and not w.startswith(("store=", "--store")))


@functools.cache
def packages() -> dict[str, str]:
    """Versions of all packages that snowrepro itself asks for, but of the compilers only that which compiles."""
    try:
        requirements = [text for text in requires("snowrepro") or [] if "extra ==" not in text]
    except PackageNotFoundError:
        requirements = []
    names = {re.split(r"[^\w.-]", text, maxsplit=1)[0] for text in requirements}
    return {name: _version(name) for name in sorted(names - {*COMPILERS} | {name_compiler()})}


@functools.cache
def environment() -> dict[str, str]:
    """What beside the configuration and the code could change a result's bits."""
    packages = {name: _version(name) for name in (name_compiler(), *NUMERICAL)}
    machine = {"system": platform.system(), "architecture": platform.machine(), "processor": _cpu()}
    return {"python": platform.python_version(), **packages, **machine}


@functools.cache
def versions() -> str:
    """Of Python and of the packages that a result depends on."""
    packages = ", ".join(f"{name} {_version(name)}" for name in ("snowrepro", name_compiler(), *PACKAGES))
    return f"python {platform.python_version()}, {packages}"


def peak_memory_mb() -> int:
    """Most memory that this process has used [MB]."""
    try:  # getrusage counts what the parent used before it started this process
        peak = re.search(r"VmHWM:\s*(\d+)", Path("/proc/self/status").read_text(encoding="utf-8"))
    except OSError:
        peak = None
    if peak:
        return round(int(peak[1]) * 1024 / 1e6)
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6)  # macOS: in bytes


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"


def git_changes(with_new: bool = False) -> list[str] | None:
    """The files of code and options that differ from the clone's last commit; None where this is no clone.

    ``with_new``: also those that git does not know.
    """
    if not (CLONE / ".git").exists():
        return None
    new = "--untracked-files=all" if with_new else "--untracked-files=no"
    status = _output(["git", "-C", str(CLONE), "status", "--porcelain", new, "--", *SOURCES])
    return [line.split(maxsplit=1)[1] for line in status.splitlines()]


def _git_state() -> str:
    """Commit of the clone that this code runs from, with "modified" where code or options differ from it."""
    changed = git_changes()
    if changed is None:
        return "unknown"
    commit = _output(["git", "-C", str(CLONE), "rev-parse", "HEAD"])
    return (commit or "unknown") + (" modified" if changed else "")


def _cpu() -> str:
    """Model name of the processor."""
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or "unknown"


def _output(command: list[str]) -> str:
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=10, check=True).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""
