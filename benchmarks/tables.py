"""From measurements to tables in Markdown."""

import argparse
import importlib.metadata
import os
import platform
import statistics
from collections.abc import Mapping, Sequence
from pathlib import Path

from cases import BenchmarkCase, Measurement

QUICK = "one round with a tenth of the work"
Round = Mapping[BenchmarkCase, Measurement]


def read_options(about: str, results: Path, rounds: int = 5, quick: str = QUICK) -> argparse.Namespace:
    """Read the options that benchmarks in rounds share: ``rounds`` (1 with ``quick``), ``quick`` and ``write``."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=rounds)
    parser.add_argument("--quick", action="store_true", help=quick)
    parser.add_argument("--write", action="store_true", help=f"write {results.name} too")
    options = parser.parse_args()
    options.rounds = 1 if options.quick else options.rounds
    return options


def tabulate_codes(rounds: Sequence[Round], cases: Sequence[BenchmarkCase]) -> list[str]:
    """Tabulate rates beside the Numba kernel of the same spline and beside mpm99; ratios are taken round by round."""
    head = ["case", "particles", "M particle-updates/s", "ratio to numba, same spline", "ratio to mpm99", "peak MB"]
    rows = []
    for case in cases:
        if not case.is_installed:
            rows.append([case.name, "", "not installed", "", "", ""])
            continue
        numba = BenchmarkCase("numba", case.spline, scene=case.scene)
        rows.append(
            [
                case.name,
                f"{rounds[0][case].particles:,}",
                format_spread([r[case].rate for r in rounds]),
                format_ratio(rounds, case, numba) if case.code != "mpm99" else "",
                format_ratio(rounds, case, BenchmarkCase("mpm99")),
                f"{max(r[case].megabytes for r in rounds):.0f}",
            ]
        )
    return format_table(head, rows)


def tabulate_sizes(rounds: Sequence[Round], cases: Sequence[BenchmarkCase]) -> list[str]:
    """Tabulate the cost of a particle-update against the number of particles and the width of the domain."""
    head = ["case", "particles", "domain", "ns a particle-update", "peak MB"]
    rows = [
        [
            case.name,
            f"{rounds[0][case].particles:,}",
            "as it is" if case.width == 1 else f"{case.width:g} times as wide",
            format_spread([1e3 / r[case].rate for r in rounds], digits=1),
            f"{max(r[case].megabytes for r in rounds):.0f}",
        ]
        for case in cases
    ]
    return format_table(head, rows)


def tabulate_pairs(
    rounds: Sequence[Mapping[BenchmarkCase, tuple[float, float]]], cases: Sequence[BenchmarkCase]
) -> list[str]:
    """Tabulate the throughput of two processes beside that of one; ``rounds`` hold (throughput of one, of two)."""
    head = ["case", "one process, M/s", "two at once, M/s", "ratio"]
    rows = [
        [
            case.name,
            format_spread([r[case][0] for r in rounds]),
            format_spread([r[case][1] for r in rounds]),
            format_spread([r[case][1] / r[case][0] for r in rounds]),
        ]
        for case in cases
    ]
    return format_table(head, rows)


def describe_machine() -> str:
    """Describe processor, system and versions, in one line."""
    versions = []
    for package in ("taichi", "quadrants", "numpy", "numba", "llvmlite", "warp-lang"):
        try:
            versions.append(f"{package} {importlib.metadata.version(package)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    return f"{_describe_processor()}, {os.cpu_count()} cores; Python {platform.python_version()}, {', '.join(versions)}"


def format_spread(values: Sequence[float], digits: int = 2) -> str:
    """Write the median of values and their range, such as 1.20 (1.10 to 1.30)."""
    return f"{statistics.median(values):.{digits}f} ({min(values):.{digits}f} to {max(values):.{digits}f})"


def format_ratio(rounds: Sequence[Round], case: BenchmarkCase, other: BenchmarkCase) -> str:
    """Write the ratio of two cases' rates, taken round by round; empty where the other was not measured."""
    if other not in rounds[0]:
        return ""
    return format_spread([r[case].rate / r[other].rate for r in rounds])


def _describe_processor() -> str:
    """Name the processor, with family and model where the system tells them."""
    facts = {}
    try:
        with Path("/proc/cpuinfo").open() as lines:
            for line in lines:
                key, _, value = line.partition(":")
                facts.setdefault(key.strip(), value.strip())
    except OSError:
        return platform.processor()
    name = facts.get("model name", platform.machine())
    if "cpu family" not in facts:
        return name
    return f"{name} (family {facts['cpu family']}, model {facts['model']})"


def format_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Write a table as lines of Markdown."""
    return ["| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *rows)]
