"""Where a result comes from: versions, git state, machine."""

import platform
import subprocess
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("snowrepro", "taichi", "numpy", "scipy", "xarray", "netCDF4", "hydra-core")
# What of a clone a result depends on: reports and documents may change.
SOURCES = ("snowrepro", "hydra_plugins", "conf", "experiments", "pyproject.toml", "requirements.lock")


def provenance() -> dict[str, str]:
    """Attributes for a result; "unknown" where something cannot be told."""
    return {
        "versions": versions(),
        "git_state": _git_state(),
        "machine": f"{platform.system()} {platform.machine()}, {_cpu()}",
        "created": datetime.now(timezone.utc).isoformat(timespec="seconds"),
    }


def versions() -> str:
    """Of Python and of the packages that a result depends on."""
    packages = ", ".join(f"{name} {_version(name)}" for name in PACKAGES)
    return f"python {platform.python_version()}, {packages}"


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"


def _git_state() -> str:
    """Commit of the clone that this code runs from, with "modified" where code or options differ from it."""
    here = Path(__file__).resolve().parents[2]
    if not (here / ".git").exists():
        return "unknown"
    commit = _output(["git", "-C", str(here), "rev-parse", "HEAD"])
    changed = _output(["git", "-C", str(here), "status", "--porcelain", "--untracked-files=no", "--", *SOURCES])
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
