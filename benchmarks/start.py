"""How long a run takes to its first frame, and in all: `snowrepro run fidelity=preview`, and where the time goes.

    python benchmarks/start.py [--rounds 5] [--quick] [--write]

Each round starts three processes in fresh folders: one without kernels that were compiled before, then two with those
that it left, of which one has no clocks in it.  Seconds are of processor time, of the process and what it starts, but
for the last row.  --quick: one round.  --write: also to benchmarks/start.md.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from phases import END, FIRST_FRAME, PHASES
from tables import describe_machine, format_spread, format_table, read_options

RESULTS = Path(__file__).with_name("start.md")
WORDS = ("run", "fidelity=preview")
CLOCKED = Path(__file__).with_name("phases.py")
WHOLE, WALL = "whole run", "whole run, by the clock"
Measured = Mapping[str, float]  # what was timed: seconds


def main() -> None:
    """Run all rounds and print the tables."""
    options = read_options(__doc__, RESULTS, quick="one round")
    rounds = []
    for number in range(options.rounds):
        print(f"round {number + 1}", file=sys.stderr)
        rounds.append(measure_round())
    text = "\n".join(report(rounds)) + "\n"
    if options.write:
        RESULTS.write_text(text, encoding="utf-8")
    print(text, end="")


def measure_round() -> tuple[Measured, Measured, Measured]:
    """Measure a run without compiled kernels and one with, each with its phases, and one without clocks in it."""
    with tempfile.TemporaryDirectory() as cache:
        return measure_phases(cache), measure_phases(cache), measure_whole(["-m", "snowrepro", *WORDS], cache)


def measure_phases(cache: str) -> Measured:
    """Measure a run, its phases and the moment of its first frame [s]."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "phases.json")
        whole = measure_whole([str(CLOCKED), str(path), *WORDS], cache)
        phases = json.loads(path.read_text(encoding="utf-8"))
    known = sum(phases.get(name, 0.0) for name in PHASES)
    return {**whole, **phases, END: whole[WHOLE] - known}


def measure_whole(words: Sequence[str], cache: str) -> Measured:
    """Measure what Python takes for such words in an empty folder, with kernels kept in the folder ``cache`` [s]."""
    environment = {**os.environ, "TI_OFFLINE_CACHE_FILE_PATH": cache, "QD_OFFLINE_CACHE_FILE_PATH": cache}
    with tempfile.TemporaryDirectory() as folder:
        before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        subprocess.run([sys.executable, *words], cwd=folder, env=environment, check=True, capture_output=True)
        wall, after = time.monotonic() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    return {WHOLE: after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, WALL: wall}


def report(rounds: Sequence[tuple[Measured, Measured, Measured]]) -> list[str]:
    """Write the tables of all rounds as lines of Markdown."""
    cold, warm, plain = zip(*rounds, strict=True)
    rows = [
        ["to its first frame", *_spread(FIRST_FRAME, cold, warm)],
        ["whole run", *_spread(WHOLE, cold, warm)],
        ["whole run, without clocks in it", "", *_spread(WHOLE, plain)],
        ["the same, by the clock", "", *_spread(WALL, plain)],
    ]
    phases = [[name, *_spread(name, cold, warm)] for name in PHASES]
    seconds = ["kernels not compiled [s]", "kernels kept [s]"]
    how = f"{len(rounds)} rounds of `snowrepro {' '.join(WORDS)}`: median, and range of the rounds."
    return [
        "# Start of a run",
        "",
        f"{describe_machine()}; {how} `README.md` says what is timed.",
        "",
        *format_table(["", *seconds], rows),
        "",
        "Where it goes:",
        "",
        *format_table(["phase", *seconds], phases),
    ]


def _spread(name: str, *columns: Sequence[Measured]) -> list[str]:
    """Write the median and range of one figure in each column."""
    return [format_spread([measured.get(name, 0.0) for measured in column]) for column in columns]


if __name__ == "__main__":
    main()
