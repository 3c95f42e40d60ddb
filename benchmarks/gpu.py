"""Many cases in one launch on a GPU: the same bits as on the CPU, how fast, and a sweep of 168 runs from end to end.

    python benchmarks/gpu.py [--device cpu] [--quick] [--parts NAMES] [--limit SECONDS] [--out FOLDER]

Takes some eight minutes on an NVIDIA H200 with 16 cores; --limit ends a part that takes longer, and the sweep then says
how far it came.  --parts 'sweep,rate 168': these alone, in this order; there are bits, sweep, a rate for each number of
cases, and a profile for the largest.  Each part runs in a process of its own, and what is there is written at once:
gpu.json and gpu.md in --out (else here).  --device cpu: the same on this machine's cores, as a trial; --quick: coarse,
few and short.

A rate is that of the process that serves a sweep: what lies between frames beside it, in the processes of the runs, is
taken apart, as milliseconds of one core for a frame of a case.
"""

import argparse
import concurrent.futures
import contextlib
import functools
import io
import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import xarray as xr
from tables import format_table

from snowrepro.compiler import ti
from snowrepro.composition.compose import compose
from snowrepro.errors import Diverged
from snowrepro.mpm.batch import Batch, Follower
from snowrepro.run import simulate
from snowrepro.scene.build import build_scene
from snowrepro.simulation import simulate_cases
from snowrepro.store.run import read_progress

HERE = Path(__file__).resolve().parent
SHAPES = ("ball", "rectangle", "triangle", "star")
FLOORS = ("L", "square", "zigzag", "triangle", "stair1", "stair2", "stair3")
PRESSURES = (300, 740, 5900)
ARMS = ("paper", "none")
SWEEP = tuple(  # 168 runs
    (f"pressure={pressure}", f"sintering={arm}", f"shape={shape}", f"floor={floor}")
    for pressure in PRESSURES for arm in ARMS for shape in SHAPES for floor in FLOORS
)  # fmt: skip
SIX = (
    ("pressure=3000",),
    ("pressure=500", "shape=star", "floor=stair3"),
    ("sintering=none", "shape=triangle", "floor=zigzag"),
    ("pressure=5900", "shape=rectangle", "floor=square", "seed=1"),
    ("pressure=900", "floor=triangle"),
    ("pressure=1e9",),  # diverges
)
SHORT = (
    "fidelity=preview", "loading.press_frames=8", "loading.frames=60", "reading.drop_height=3", "reading.gravity=40",
)  # fmt: skip
STATES = ("position", "velocity", "J_P", "hardening", "von_mises", "kinetic_energy", "elastic_energy", "substeps")
COUNTS = (1, 8, 64, 168)
SECONDS = 5.0  # that a rate is taken over
EVERY = 10.0  # seconds between two looks at how far a sweep is
ENDING = 20.0  # seconds before its limit at which a sweep is stopped, so that it ends in order and is described


def main() -> None:
    """Run all parts, and write what came of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--device", choices=("cuda", "cpu"), default="cuda")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--out", type=Path, default=HERE)
    parser.add_argument("--limit", type=float, default=300.0, help="seconds that a part may take")
    parser.add_argument("--parts", help="which ones, with commas between; else all")
    parser.add_argument("--part", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.part:
        print(json.dumps(measure_part(arguments.part, arguments)))
        return
    *fewer, most = COUNTS[1:2] if arguments.quick else COUNTS
    parts = ("bits", f"rate {most}", "sweep", f"profile {most}", *(f"rate {count}" for count in fewer))
    chosen = arguments.parts.split(",") if arguments.parts else parts
    if unknown := [part for part in chosen if part not in parts]:
        parser.error(f"--parts: there is no {', '.join(unknown)}; there are: {', '.join(parts)}")
    found: dict = {"machine": describe_machine(), "device": arguments.device, "quick": arguments.quick}
    for part in chosen:
        found[part] = run_part(part, arguments)
        (arguments.out / "gpu.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        page = "\n".join(describe(found)) + "\n"
        (arguments.out / "gpu.md").write_text(page, encoding="utf-8")
    print(page)


def run_part(part: str, arguments: argparse.Namespace) -> dict:
    """Run one part in a process of its own; what it says, or why it failed."""
    command = [sys.executable, __file__, "--part", part, "--device", arguments.device, "--limit", str(arguments.limit)]
    started = time.perf_counter()
    try:
        done = subprocess.run(
            [*command, *(["--quick"] if arguments.quick else [])],
            capture_output=True,
            text=True,
            timeout=arguments.limit,
        )
        found = json.loads(done.stdout.splitlines()[-1]) if done.returncode == 0 else {"failed": done.stderr[-2000:]}
    except subprocess.TimeoutExpired:
        found = {"failed": f"took more than {arguments.limit:g} s"}
    print(f"{part}: {found}", file=sys.stderr, flush=True)
    return {**found, "part_seconds": time.perf_counter() - started}


def measure_part(part: str, arguments: argparse.Namespace) -> dict:
    """Measure one part in this process."""
    name, _, count = part.partition(" ")
    device, quick = arguments.device, arguments.quick
    if name == "bits":
        return compare_bits(device)
    if name == "sweep":
        return measure_sweep(device, quick, arguments.limit - ENDING)
    return (profile if name == "profile" else measure_rate)(int(count), device, quick)


def describe_machine() -> str:
    """Processor, cores and graphics card."""
    query = ["nvidia-smi", "--query-gpu=name,driver_version", "--format=csv,noheader"]
    card = ""
    if shutil.which(query[0]):
        card = subprocess.run(query, capture_output=True, text=True).stdout.strip().splitlines()[0]
    return ", ".join(filter(None, [card, f"{os.cpu_count()} cores", platform.machine()]))


def select(device: str) -> tuple[str, ...]:
    """The settings of a device on which any company gives the same bits."""
    return f"solver.device={device}", "solver.summation=fixed_point"


def compare_bits(device: str) -> dict:
    """Six cases alone on the CPU, and together on the device: in which of them which quantities differ, by how much."""
    with concurrent.futures.ProcessPoolExecutor(min(6, os.cpu_count() or 1)) as pool:
        alone = pool.map(simulate_alone, SIX)
        cases = [compose([*SHORT, *kind, *select(device)]).case for kind in SIX]
        together = dict(simulate_cases(cases))
        answers = list(alone)
    differing = {}
    for i, expected in enumerate(answers):
        given = together[i]
        label = " ".join(SIX[i])
        if isinstance(expected, str) or isinstance(given, Diverged):
            differing[label] = {} if expected == str(given) else {"message": str(given)}
            continue
        differing[label] = {
            name: float(np.abs(given[name].values - values).max())
            for name, values in expected.items()
            if not np.array_equal(given[name].values, values)
        }
    return {"cases": len(SIX), "same": sum(not names for names in differing.values()), "differing": differing}


def simulate_alone(kind: tuple[str, ...]) -> dict[str, np.ndarray] | str:
    """Some quantities of a case that runs alone on the CPU, or why it diverged."""
    try:
        dataset = simulate(compose([*SHORT, *kind, *select("cpu")]))
    except Diverged as error:
        return str(error)
    return {name: dataset[name].values for name in STATES}


def measure_rate(count: int, device: str, quick: bool) -> dict:
    """Particle-updates a second of some cases of the sweep side by side, from their start on; memory.

    Over the seconds that the device and its process take, without what lies between frames: ``follower_ms`` a frame.
    """
    fidelity = "preview" if quick else "paper"
    cases = [compose([*kind, *select(device), f"fidelity={fidelity}"]).case for kind in spread(SWEEP, count)]
    started = time.perf_counter()
    with concurrent.futures.ProcessPoolExecutor() as pool:
        scenes = list(pool.map(build_scene, cases))
    built = time.perf_counter()
    batch = Batch(cases, scenes, [None] * count, os.cpu_count() or 1)
    followers = [
        Follower(case, scene, batch.table, batch.place_block(batch.force, i), functools.partial(batch.read_case, i))
        for i, (case, scene) in enumerate(zip(cases, scenes, strict=True))
    ]
    reports = batch.start()
    while any(member.number < 2 for member in batch.members):  # compiles all that it takes
        reports, _ = advance(batch, followers, reports)
    compiled = time.perf_counter()
    updates, frames, spent = 0, 0, dict.fromkeys(("followers", "begin", "launch", "collect"), 0.0)
    while time.perf_counter() - compiled < SECONDS:
        frames += len(reports)
        reports, part = advance(batch, followers, reports)
        updates += sum(report.outcome.substeps * batch.places.counts[i] for i, report in reports.items())
        spent = {name: spent[name] + part[name] for name in spent}
    served = sum(spent.values()) - spent["followers"]
    return {
        "cases": count, "particles": sum(batch.places.counts), "updates_per_second": updates / served,
        "frames": frames, "served_ms": 1e3 * served / frames, "follower_ms": 1e3 * spent["followers"] / frames,
        "seconds": spent, "scenes_seconds": built - started, "compile_seconds": compiled - built,
        "memory_mib": read_memory(),
    }  # fmt: skip


def profile(count: int, device: str, quick: bool) -> dict:
    """The rate again with the profiler of Taichi, which slows it: what each loop took, as it prints that."""
    os.environ["TI_KERNEL_PROFILER"] = "1"
    rate = measure_rate(count, device, quick)
    table = io.StringIO()
    with contextlib.redirect_stdout(table):
        ti.profiler.print_kernel_profiler_info()
    return {**rate, "table": table.getvalue().splitlines()}


def advance(batch: Batch, followers: list[Follower], reports: dict) -> tuple[dict, dict[str, float]]:
    """Have cases go on that wait, and compute a few substeps; what the device tells, and the seconds it all took."""
    moments = [time.perf_counter()]
    for i, report in reports.items():
        followers[i].take(report)
        followers[i].press()
    moments.append(time.perf_counter())
    batch.begin([*reports])
    moments.append(time.perf_counter())
    batch.launch()
    moments.append(time.perf_counter())
    reports = batch.collect()
    moments.append(time.perf_counter())
    return reports, dict(zip(("followers", "begin", "launch", "collect"), np.diff(moments).tolist(), strict=True))


def spread(kinds: tuple, count: int) -> list:
    """So many of the kinds, evenly taken."""
    return [kinds[i * len(kinds) // count] for i in range(count)]


def read_memory() -> int:
    """Memory that is taken on the graphics card, in MiB; 0 where there is none."""
    query = ["nvidia-smi", "--query-gpu=memory.used", "--format=csv,noheader,nounits"]
    if not shutil.which(query[0]):
        return 0
    return max(map(int, subprocess.run(query, capture_output=True, text=True).stdout.split()))


def measure_sweep(device: str, quick: bool, limit: float) -> dict:
    """The sweep by the command line into a store: seconds of the whole, and how many runs and frames are done.

    It is stopped after ``limit`` seconds.  ``first_frame_seconds``: until a run said that it had one.
    """
    values = {"pressure": PRESSURES, "sintering": ARMS, "shape": SHAPES, "floor": FLOORS}
    if quick:
        values |= {"shape": SHAPES[:1], "floor": FLOORS[:2], "pressure": PRESSURES[1:2]}
    varied = [f"{name}={','.join(map(str, each))}" for name, each in values.items()]
    with tempfile.TemporaryDirectory() as folder, Path(folder, "screen").open("w+") as screen:
        store = Path(folder, "store")
        command = [
            sys.executable, "-m", "snowrepro", "run", "-m", *varied, *select(device), f"store={store}",
            f"fidelity={'preview' if quick else 'paper'}", "hydra/launcher=batch",
        ]  # fmt: skip
        started = time.perf_counter()
        sweep = subprocess.Popen(command, stdout=screen, stderr=screen, start_new_session=True)
        first, course = watch_sweep(sweep, store, limit)
        seconds, is_stopped = time.perf_counter() - started, sweep.poll() is None
        done, frames = len(list(store.glob("*/run.nc"))), count_frames(store)
        end_sweep(sweep)
        screen.seek(0)
        return {
            "runs": int(np.prod([len(each) for each in values.values()])), "done": done, "frames": frames,
            "seconds": seconds, "is_stopped": is_stopped, "first_frame_seconds": first, "exit": sweep.returncode,
            "course": course, "screen": screen.read()[-3000:],
        }  # fmt: skip


def watch_sweep(sweep: subprocess.Popen, store: Path, limit: float) -> tuple[float | None, list[dict]]:
    """Wait until a sweep or its time is over: seconds until a run said how far it is (else None), and its course.

    The course: every ten seconds how many runs are done and under way, and the frames that the latter have.
    """
    started, first, course = time.perf_counter(), None, []
    while sweep.poll() is None and (seconds := time.perf_counter() - started) < limit:
        if first is None and any(store.glob(".work/*/progress.json")):
            first = seconds
        if seconds >= EVERY * (len(course) + 1):
            under_way = [progress.frame for work in store.glob(".work/*") if (progress := read_progress(work))]
            done = len(list(store.glob("*/run.nc")))
            course.append(
                {"seconds": round(seconds, 1), "done": done, "under_way": len(under_way), "frames": sum(under_way)}
            )
        time.sleep(0.1)
    return first, course


def count_frames(store: Path) -> int:
    """Frames that the runs of a store have: those that are done, and those that are under way as they last said."""
    frames = 0
    for result in store.glob("*/run.nc"):
        with xr.open_dataset(result) as dataset:
            frames += dataset.sizes["frame"] - 1
    return frames + sum(progress.frame for work in store.glob(".work/*") if (progress := read_progress(work)))


def end_sweep(sweep: subprocess.Popen) -> None:
    """Have a sweep end in order if it is not over, or else at once."""
    if sweep.poll() is None:
        sweep.send_signal(signal.SIGINT)
    try:
        sweep.wait(0.7 * ENDING)
    except subprocess.TimeoutExpired:
        os.killpg(sweep.pid, signal.SIGKILL)
        sweep.wait()


def describe(found: dict) -> list[str]:
    """The page of what was found."""
    lines = ["# Many cases in one launch", "", f"`python benchmarks/gpu.py`, on {found['machine']}.", ""]
    if "same" in (bits := found.get("bits", {})):
        lines += [
            f"Of {bits['cases']} different cases {bits['same']} had the bits of the CPU, where each ran alone.",
            "",
        ]
    rates = [found[f"rate {count}"] for count in COUNTS if "updates_per_second" in found.get(f"rate {count}", {})]
    head = ["cases", "particles", "G updates/s", "frame [ms]", "frame beside it [ms]", "compile [s]", "memory [MiB]"]
    rows = [
        [
            str(rate["cases"]), f"{rate['particles']:,}", f"{rate['updates_per_second'] / 1e9:.3f}",
            f"{rate['served_ms']:.3f}", f"{rate['follower_ms']:.3f}",
            f"{rate['compile_seconds']:.0f}", f"{rate['memory_mib']:,}",
        ]
        for rate in rates
    ]  # fmt: skip
    lines += format_table(head, rows) if rows else []
    if "seconds" in (sweep := found.get("sweep", {})):
        lines += ["", f"A sweep from the command to the table: {sweep['done']} of {sweep['runs']} runs done in "]
        lines[-1] += f"{sweep['seconds']:.0f} s, {sweep['frames']:,} frames."
        if sweep["is_stopped"]:
            lines[-1] += " It was stopped there."
        if sweep["first_frame_seconds"] is not None:
            lines[-1] += f" The first run had a frame after {sweep['first_frame_seconds']:.0f} s."
    return lines


if __name__ == "__main__":
    main()
