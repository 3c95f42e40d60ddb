"""From measurements to tables in Markdown."""

import importlib.metadata
import os
import platform
import statistics
from collections.abc import Mapping, Sequence

from cases import Case, Measurement

Round = Mapping[Case, Measurement]


def of_codes(rounds: Sequence[Round], cases: Sequence[Case]) -> list[str]:
    """Rates beside the Numba kernel of the same spline and beside mpm99; ratios are taken round by round."""
    head = ["case", "particles", "M particle-updates/s", "ratio to numba, same spline", "ratio to mpm99", "peak MB"]
    rows = []
    for case in cases:
        if not case.installed:
            rows.append([case.name, "", "not installed", "", "", ""])
            continue
        numba = Case("numba", case.spline, scene=case.scene)
        rows.append(
            [
                case.name,
                f"{rounds[0][case].particles:,}",
                spread([r[case].rate for r in rounds]),
                ratio(rounds, case, numba) if case.code != "mpm99" else "",
                ratio(rounds, case, Case("mpm99")),
                f"{max(r[case].megabytes for r in rounds):.0f}",
            ]
        )
    return in_markdown(head, rows)


def of_sizes(rounds: Sequence[Round], cases: Sequence[Case]) -> list[str]:
    """Cost of a particle-update against the number of particles and the width of the domain."""
    head = ["case", "particles", "domain", "ns a particle-update", "peak MB"]
    rows = [
        [
            case.name,
            f"{rounds[0][case].particles:,}",
            "as it is" if case.width == 1 else f"{case.width:g} times as wide",
            spread([1e3 / r[case].rate for r in rounds], digits=1),
            f"{max(r[case].megabytes for r in rounds):.0f}",
        ]
        for case in cases
    ]
    return in_markdown(head, rows)


def of_pairs(rounds: Sequence[Mapping[Case, tuple[float, float]]], cases: Sequence[Case]) -> list[str]:
    """Throughput of two processes beside that of one; ``rounds`` hold (throughput of one, of two)."""
    head = ["case", "one process, M/s", "two at once, M/s", "ratio"]
    rows = [
        [
            case.name,
            spread([r[case][0] for r in rounds]),
            spread([r[case][1] for r in rounds]),
            spread([r[case][1] / r[case][0] for r in rounds]),
        ]
        for case in cases
    ]
    return in_markdown(head, rows)


def machine() -> str:
    """Processor, system and versions, in one line."""
    versions = []
    for package in ("taichi", "numpy", "numba", "llvmlite", "warp-lang"):
        try:
            versions.append(f"{package} {importlib.metadata.version(package)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    return f"{_processor()}, {os.cpu_count()} cores; Python {platform.python_version()}, {', '.join(versions)}"


def spread(values: Sequence[float], digits: int = 2) -> str:
    """Median and range."""
    return f"{statistics.median(values):.{digits}f} ({min(values):.{digits}f} to {max(values):.{digits}f})"


def ratio(rounds: Sequence[Round], case: Case, other: Case) -> str:
    """Of the rates, round by round; empty where the other was not measured."""
    if other not in rounds[0]:
        return ""
    return spread([r[case].rate / r[other].rate for r in rounds])


def _processor() -> str:
    """Name, family and model where the system tells them."""
    known = {}
    try:
        with open("/proc/cpuinfo") as lines:
            for line in lines:
                key, _, value = line.partition(":")
                known.setdefault(key.strip(), value.strip())
    except OSError:
        return platform.processor()
    name = known.get("model name", platform.machine())
    if "cpu family" not in known:
        return name
    return f"{name} (family {known['cpu family']}, model {known['model']})"


def in_markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """A table as lines of Markdown."""
    return ["| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *rows)]
