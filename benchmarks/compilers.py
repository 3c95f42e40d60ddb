"""The two compilers beside each other: the rate of whole substeps, and the start of a run.

    python benchmarks/compilers.py [--rounds 5] [--quick] [--write]

The rounds take the compilers in turns, each case in a fresh process on one thread.  Seconds are of processor time, and
the least of all rounds counts: what others on the machine do can only add to it.  --quick: one round with a tenth of
the work.  --write: also to benchmarks/compilers.md.
"""

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from cases import BenchmarkCase, Measurement, measure_together
from tables import describe_machine, format_spread, format_table, read_options

from snowrepro.compiler import COMPILERS, VARIABLE

RESULTS = Path(__file__).with_name("compilers.md")
SPLINES = ("cubic", "quadratic")
NAMES = [name for name in COMPILERS if find_spec(name)]
RATES = [BenchmarkCase("snowrepro", spline, in_full=True, compiler=name) for spline in SPLINES for name in NAMES]
# A run of two frames: what it takes beside is imports and kernels.
START = "import snowrepro; snowrepro.simulate(snowrepro.compose(['loading.press_frames=1', 'loading.frames=2']))"


def main() -> None:
    """Run all rounds and print the table."""
    options = read_options(__doc__, RESULTS)
    rates, starts = [], []
    for number in range(options.rounds):
        print(f"round {number + 1}", file=sys.stderr)
        tasks = {case: case.shorten() if options.quick else case for case in RATES}
        rates.append({case: measure_together([task])[0] for case, task in tasks.items()})
        starts.append({name: measure_start(name) for name in NAMES})
        text = "\n".join(report(rates, starts)) + "\n"
        if options.write:  # after each round: a stop loses no more than one
            RESULTS.write_text(text, encoding="utf-8")
    print(text, end="")


def measure_start(name: str) -> tuple[float, float]:
    """Measure the start of a run with kernels that are not compiled yet, and again with those [s of all cores]."""
    with tempfile.TemporaryDirectory() as folder:
        cache = {f"{COMPILERS[name]}OFFLINE_CACHE_FILE_PATH": folder}
        environment = {**os.environ, **cache, VARIABLE: name}

        def start() -> float:
            """Run in a process of its own."""
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run([sys.executable, "-c", START], env=environment, check=True, capture_output=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

        return start(), start()


def report(
    rates: Sequence[dict[BenchmarkCase, Measurement]], starts: Sequence[dict[str, tuple[float, float]]]
) -> list[str]:
    """Write the table of all rounds as lines of Markdown."""
    rows = [
        ["start of a run, kernels not compiled", name, *_least([s[name][0] for s in starts], "s")] for name in NAMES
    ]
    rows += [["start of a run, kernels kept", name, *_least([s[name][1] for s in starts], "s")] for name in NAMES]
    for case in RATES:
        nanoseconds = [1e3 / each[case].rate for each in rates]
        rows.append([f"a particle-update, {case.spline}", case.compiler, *_least(nanoseconds, "ns")])
    return [
        "# Two compilers",
        "",
        f"{describe_machine()}; {len(rates)} rounds, in processor time. `README.md` says what is timed.",
        "",
        *format_table(["what", "compiler", "least", "median, and range of the rounds"], rows),
    ]


def _least(values: Sequence[float], unit: str) -> tuple[str, str]:
    """Write the least of some values, and their spread."""
    return f"{min(values):.1f} {unit}", format_spread(values, digits=1)


if __name__ == "__main__":
    main()
