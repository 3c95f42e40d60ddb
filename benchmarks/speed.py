"""Particle-updates a second on one core, beside Taichi's mpm99 example, in turns.

    python benchmarks/speed.py [--rounds 5]

Each case runs in a process of its own; the rounds interleave them, and the ratios are taken round by round.
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import time

CASES = ("mpm99", "quadratic", "cubic")
SECONDS = 4.0  # of timed work a case and round


def main() -> None:
    """Run all rounds and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--case", choices=CASES, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.case:
        print(measure_mpm99() if options.case == "mpm99" else measure_snowrepro(options.case), peak_megabytes())
        return
    rounds = []
    for number in range(options.rounds):
        rounds.append({case: in_process(case) for case in CASES})
        shown = ", ".join(f"{case} {rate:.2f}" for case, (rate, _) in rounds[-1].items())
        print(f"round {number + 1}: {shown}", file=sys.stderr)
    print("| case | M particle-updates/s (median, min to max) | ratio to mpm99 (median, min to max) | peak MB |")
    print("|---|---|---|---|")
    for case in CASES:
        rates = [r[case][0] for r in rounds]
        ratios = [r[case][0] / r["mpm99"][0] for r in rounds]
        memory = max(r[case][1] for r in rounds)
        print(f"| {case} | {spread(rates)} | {spread(ratios)} | {memory:.0f} |")


def in_process(case: str) -> tuple[float, float]:
    """Rate and peak memory of one case in a fresh process on one thread."""
    environment = {**os.environ, "TI_CPU_MAX_NUM_THREADS": "1", "TI_ARCH": "x64"}
    command = [sys.executable, __file__, "--case", case]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    rate, memory = done.stdout.split()[-2:]
    return float(rate), float(memory)


def measure_snowrepro(spline: str) -> float:
    """Everything on: a ball that lands on the floor and flows plastically, with sintering once a frame."""
    from snowrepro.composition import compose
    from snowrepro.mpm import diagnostics, solver
    from snowrepro.mpm.laws import laws_of
    from snowrepro.scene.build import build_scene

    config = compose(["reading.drop_height=1.5", f"solver.spline={spline}"])
    scene = build_scene(config)
    solver.start_taichi(config)
    laws = laws_of(config)
    particles, nodes, ledger = solver.allocate(config, scene, laws)
    particles.velocity.fill([0.0, -30.0])
    updates, frame, started, row = 0, 0, 0.0, None
    while not started or time.perf_counter() - started < SECONDS:
        solver.advance_frame(particles, nodes, ledger, laws, 10.0, 0.0, True)
        frame += 1
        row = diagnostics.measure(solver.frame_of(frame, particles, ledger), config, row)
        if frame == 25:  # compiled, and the snow is on the floor
            started = time.perf_counter()
        if frame > 25:
            updates += ledger.substeps[None] * particles.count
    yielded = (abs(particles.read("J_P") - 1.0) > 1e-3).mean()
    assert ledger.status[None] == 0 and yielded > 0.5, "the benchmark's snow must flow"
    return updates / (time.perf_counter() - started) / 1e6


def measure_mpm99() -> float:
    """Taichi's example as shipped, its own kernels and sizes."""
    import taichi as ti
    from taichi.examples.simulation import mpm99

    mpm99.initialize()
    for _ in range(500):
        mpm99.substep()
    ti.sync()
    updates, started = 0, time.perf_counter()
    while time.perf_counter() - started < SECONDS:
        for _ in range(100):
            mpm99.substep()
        ti.sync()
        updates += 100 * mpm99.n_particles
    return updates / (time.perf_counter() - started) / 1e6


def spread(values: list[float]) -> str:
    """Median and range."""
    return f"{statistics.median(values):.2f} ({min(values):.2f} to {max(values):.2f})"


def peak_megabytes() -> float:
    """Largest resident size of this process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    main()
