"""How sweeps scale: planning a large one, what a run costs beyond its frames, and two workers beside one.

    python benchmarks/sweeps.py [--quick] [--write]

--quick: a thousandth of the large store, and 4 runs in place of 24.  --write: also to benchmarks/sweeps.md.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from tables import describe_machine, format_table

from snowrepro.settings.case import MODEL_VERSION
from snowrepro.store import manifest
from snowrepro.store.cost import kind_of
from snowrepro.store.files import read_json
from snowrepro.store.run import RESULT
from snowrepro.summary.row import make_key
from snowrepro.sweep.plan import make_plan

RESULTS = Path(__file__).with_name("sweeps.md")
ROOT = Path(__file__).resolve().parents[1]
LARGE = ["experiment=grid", "seed=range(0,596)"]
SMALL_LARGE = ["experiment=grid"]
# Of the grid's runs those on one floor of seven, 24, without its report; and four of them.
GRID = ["-m", "fidelity=preview", "shape=rectangle,ball,triangle,star", "sintering=paper,none", "pressure=300,740,2900"]
FEW = ["-m", "fidelity=preview", "sintering=paper,none", "pressure=300,740"]
# Calls the command line and says on the last line how much memory it took at most [MB].
MEASURED = """
import atexit, runpy, sys
from snowrepro.store.provenance import peak_memory_mb
atexit.register(lambda: print(peak_memory_mb(), file=sys.stderr))
sys.argv = ["snowrepro", *{words!r}]
runpy.run_module("snowrepro", run_name="__main__")
"""


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a thousandth of the large store, and four runs")
    parser.add_argument("--write", action="store_true", help=f"write {RESULTS.name} too")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows = [
            *measure_planning(Path(folder), options.quick),
            *measure_running(Path(folder), FEW if options.quick else GRID),
        ]
    text = "\n".join(["# Sweeps", "", describe_machine(), "", *format_table(["what", "measured"], rows), ""])
    if options.write:
        RESULTS.write_text(text, encoding="utf-8")
    print(text, end="")


def measure_planning(folder: Path, quick: bool) -> list[list[str]]:
    """Measure plan and status of a large sweep over a store with many finished runs: rows of the table."""
    sweep = [*(SMALL_LARGE if quick else LARGE), f"store={folder}/large"]
    finished, planned = fill_store(sweep, 20 if quick else 20_000)
    rows = []
    for words in (["plan"], ["status"]):
        seconds, megabytes = measure_command(folder, [*words, *sweep])
        what = f"`snowrepro {words[0]}` of {planned:,} runs, {finished:,} of them finished"
        rows.append([what, f"{seconds:.1f} s, {megabytes:.0f} MB"])
    return rows


def measure_running(folder: Path, sweep: Sequence[str]) -> list[list[str]]:
    """Measure a sweep by one worker and by two: seconds a run beyond the solver's, and how much faster two are."""
    measure_command(folder, ["run", *FEW, "store=warm"])  # kernels are compiled once a machine
    walls = {}
    for workers in (1, 2):
        store = folder / f"by {workers}"
        walls[workers], _ = measure_command(
            folder, ["run", *sweep, f"store='{store}'", f"hydra.launcher.workers={workers}"]
        )
        manifests = [read_json(path) for path in store.glob(f"*/{manifest.MANIFEST}")]
        if workers == 1:
            solver = sum(content["wall_seconds"] for content in manifests)
    count = len(manifests)
    return [
        [
            f"local launcher, {count} preview runs, one worker: a run beyond the solver",
            f"{(walls[1] - solver) / count:.2f} s",
        ],
        ["the same by one worker, by two; ratio", f"{walls[1]:.0f} s, {walls[2]:.0f} s; {walls[1] / walls[2]:.2f}"],
    ]


def fill_store(sweep: Sequence[str], count: int) -> tuple[int, int]:
    """Give some runs of a sweep a folder as finished ones leave it, but for the particles.

    Returns how many runs got one, and how many the sweep has.
    """
    runs = make_plan(sweep, True).runs
    finished = runs[:: len(runs) // count][:count]
    for run in finished:
        run.folder.mkdir(parents=True)
        run.result.write_bytes(b"no particles")
        content = {"run_id": run.id, "model_version": MODEL_VERSION, "created": "2026-01-01T00:00:00+00:00"}
        content["git_state"] = "none"
        content |= {"wall_seconds": 20.0, "seconds_per_frame": 0.03, "kind": vars(kind_of(run.case))}
        manifest.write(run.folder, [RESULT], {**content, "config": run.config.record()})
        row = {"run_id": run.id, "pressure": run.case.pressure, "lump_fraction": 0.5, "seconds": 20.0}
        run.save_row(make_key(run.config.question.analysis), row)
    return len(finished), len(runs)


def measure_command(folder: Path, words: Sequence[str]) -> tuple[float, float]:
    """Run a command of snowrepro in a fresh process; returns its seconds and peak memory [MB]."""
    start = time.perf_counter()
    process = subprocess.run(
        [sys.executable, "-c", MEASURED.format(words=list(words))],
        cwd=folder, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    seconds = time.perf_counter() - start
    if process.returncode:
        raise RuntimeError(f"snowrepro {' '.join(words)}: {process.stderr[-2000:]}")
    return seconds, int(process.stderr.split()[-1])


if __name__ == "__main__":
    main()
