"""What is timed, and how: each case in a fresh process on one thread.

    python benchmarks/cases.py '{"code": "numba", "spline": "cubic"}'

warms up, says "ready", waits for a line, works, and prints its measurement.
"""

import importlib.util
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

WARM_UP = 25  # frames; compiled by then, and the snow is on the floor
ONE_THREAD = dict.fromkeys(("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
MPM99_ON_ONE_CORE = {"TI_ARCH": "x64", "TI_CPU_MAX_NUM_THREADS": "1"}  # snowrepro sets them itself
NEEDS = {"numba": "numba", "warp": "warp"}  # code: package


@dataclass(frozen=True)
class BenchmarkCase:
    """What is timed: a code, and what it computes; see ``snow.start_snow`` for scene, dx and width."""

    code: str  # snowrepro, numba, warp or mpm99
    spline: str = "quadratic"
    precision: str = "f64"
    scene: str = "ball_on_L"
    dx: float = 1.0
    width: float = 1.0
    in_full: bool = False  # snowrepro: with sintering and diagnostics once a frame
    warm_up: int = WARM_UP  # frames
    updates: float = 20.0  # work that is timed [M particle-updates]
    compiler: str = "taichi"  # of snowrepro's kernels

    @property
    def name(self) -> str:
        """The case in words, for the tables."""
        if self.code == "mpm99":
            return "Taichi's mpm99, quadratic, f32"
        return f"{self.code}, {self.spline}, {self.precision}{', whole run' if self.in_full else ''}"

    @property
    def is_installed(self) -> bool:
        """Whether the package of its code is installed."""
        return importlib.util.find_spec(NEEDS.get(self.code, "taichi")) is not None

    def shorten(self) -> "BenchmarkCase":
        """Return the same case with a tenth of the work."""
        return replace(self, updates=self.updates / 10)


@dataclass(frozen=True)
class Measurement:
    """Rates [M particle-updates/s], peak memory [MB] of the process, and what was timed.

    ``rate`` is by the processor's time, which others on the machine disturb less, ``throughput`` by the clock's.
    """

    rate: float
    throughput: float
    megabytes: float
    particles: int
    substeps: int


def measure_together(cases: list[BenchmarkCase]) -> list[Measurement]:
    """Measure cases in processes of their own that start their timed work together."""
    processes = []
    for case in cases:
        command = [sys.executable, __file__, json.dumps(asdict(case))]
        environment = {
            **os.environ,
            **ONE_THREAD,
            "SNOWREPRO_COMPILER": case.compiler,
            **(MPM99_ON_ONE_CORE if case.code == "mpm99" else {}),
        }
        processes.append(
            subprocess.Popen(command, env=environment, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        )
    for process in processes:
        while (line := process.stdout.readline()) != "ready\n":  # a library may announce itself
            if not line:
                raise RuntimeError(f"a case ended with {process.wait()} before it was ready")
    for process in processes:
        process.stdin.write("go\n")
        process.stdin.flush()
    answers = [process.communicate()[0] for process in processes]
    return [Measurement(**json.loads(answer.splitlines()[-1])) for answer in answers]


def measure(case: BenchmarkCase, wait: Callable[[], None] = lambda: None) -> Measurement:
    """Warm up, call ``wait``, and time the case's work."""
    particles, advance = STARTS[case.code](case)
    for _ in range(case.warm_up):
        advance()
    wait()
    substeps, start, start_of_work = 0, time.perf_counter(), time.process_time()
    while substeps * particles < case.updates * 1e6:
        substeps += advance()
    seconds, processor_seconds = time.perf_counter() - start, time.process_time() - start_of_work
    updates = substeps * particles / 1e6
    megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return Measurement(updates / processor_seconds, updates / seconds, megabytes, particles, substeps)


Start = tuple[int, Callable[[], int]]  # particles, and a call that advances a frame and returns its substeps


def start_snowrepro(case: BenchmarkCase) -> Start:
    """Start snowrepro's solver."""
    from snow import start_snow

    start = start_snow(case.scene, case.spline, case.dx, case.width)
    return len(start.particles["mass"]), lambda: start.advance(case.in_full)


def start_numba(case: BenchmarkCase) -> Start:
    """Start the plain loops of Numba: the same substep and the same numbers."""
    from peers.numba_kernel import NumbaSolver
    from snow import GRAVITY, start_snow

    solver = NumbaSolver(start_snow(case.scene, case.spline, case.dx, case.width), case.spline)
    return len(solver.particles.mass), lambda: solver.advance_frame(GRAVITY)


def start_warp(case: BenchmarkCase) -> Start:
    """Start Warp on the CPU, with a time step that is short enough all along."""
    import warp
    from peers.warp_mpm import SUBSTEPS, WarpSolver
    from snow import GRAVITY, start_snow

    real = warp.float64 if case.precision == "f64" else warp.float32
    solver = WarpSolver(start_snow(case.scene, case.spline, case.dx, case.width), case.spline, real)

    def advance() -> int:
        """Simulate one frame and return its substeps."""
        solver.advance_frame(GRAVITY, SUBSTEPS)
        return SUBSTEPS

    return solver.count, advance


def start_mpm99() -> Start:
    """Start Taichi's example as shipped, with its own kernels and sizes."""
    import taichi as ti
    from taichi.examples.simulation import mpm99

    mpm99.initialize()

    def advance() -> int:
        """Simulate one frame and return its substeps."""
        for _ in range(20):
            mpm99.substep()
        ti.sync()
        return 20

    return mpm99.n_particles, advance


STARTS: dict[str, Callable[[BenchmarkCase], Start]] = {
    "snowrepro": start_snowrepro,
    "numba": start_numba,
    "warp": start_warp,
    "mpm99": lambda case: start_mpm99(),
}


def _say_ready_and_wait() -> None:
    """Say "ready" to the process that started this one, and wait for its line."""
    print("ready", flush=True)
    sys.stdin.readline()


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))
    print(json.dumps(asdict(measure(BenchmarkCase(**json.loads(sys.argv[1])), _say_ready_and_wait))))
