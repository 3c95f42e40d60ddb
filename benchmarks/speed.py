"""How fast a substep is, beside peers that do the same work.

    python benchmarks/speed.py [--rounds 5] [--quick] [--write]

The rounds interleave all cases, each in a fresh process on one thread, so that ratios hold on a machine
whose speed drifts.  --quick: one round with a tenth of the work.  --write: also to benchmarks/results.md.
"""

import sys
from pathlib import Path

import tables
from cases import BenchmarkCase, Measurement, measure_together

SPLINES = ("cubic", "quadratic")  # the default first
SCENES = {"ball_on_L": "A ball on a floor", "star_on_square": "A star on a square floor"}
CODES = {
    scene: [
        *(BenchmarkCase("snowrepro", spline, scene=scene, in_full=True) for spline in SPLINES),
        *(BenchmarkCase("snowrepro", spline, scene=scene) for spline in SPLINES),
        *(BenchmarkCase("numba", spline, scene=scene) for spline in SPLINES),
        *(BenchmarkCase("warp", spline, precision, scene) for precision in ("f64", "f32") for spline in SPLINES),
        BenchmarkCase("mpm99"),
    ]
    for scene in SCENES
}
# 8, 22, 100 thousand and a million particles: the larger, the shorter the warm-up.
SIZES = [
    *(
        BenchmarkCase("snowrepro", spline, dx=dx, warm_up=warm_up)
        for dx, warm_up in ((1.0, 25), (0.6077, 10), (0.2855, 5), (0.0903, 1))
        for spline in SPLINES
    ),
    *(BenchmarkCase("snowrepro", spline, width=4.0) for spline in SPLINES),
]
PAIRS = [BenchmarkCase("snowrepro", spline) for spline in SPLINES]
RESULTS = Path(__file__).with_name("results.md")


def main() -> None:
    """Run all rounds and print the tables."""
    options = tables.read_options(__doc__, RESULTS)
    rounds = options.rounds
    singles, pairs = [], []
    for number in range(1, rounds + 1):
        print(f"round {number} of {rounds}", file=sys.stderr)
        singles.append(measure_singles(options.quick))
        pairs.append(measure_pairs(options.quick))
        text = "\n".join(report_rates(singles, pairs)) + "\n"
        if options.write:  # after each round: a stop loses no more than one
            RESULTS.write_text(text, encoding="utf-8")
    print(text, end="")


def measure_singles(quick: bool) -> dict[BenchmarkCase, Measurement]:
    """Measure all cases that run alone, one round; a case of two tables is measured once."""
    cases = dict.fromkeys(case for group in (*CODES.values(), SIZES) for case in group if case.is_installed)
    return {case: print_rate(case, *measure_together([case.shorten() if quick else case])) for case in cases}


def measure_pairs(quick: bool) -> dict[BenchmarkCase, tuple[float, float]]:
    """Measure PAIRS, one round: the throughput of one process, and of two at once."""
    result = {}
    for case in PAIRS:
        task = case.shorten() if quick else case
        (alone,) = measure_together([task])
        together = sum(one.throughput for one in measure_together([task, task]))
        print(f"  two at once: {case.name}: {together:.2f} M/s", file=sys.stderr)
        result[case] = (alone.throughput, together)
    return result


def print_rate(case: BenchmarkCase, measurement: Measurement) -> Measurement:
    """Print the rate of a case, as progress, and return its measurement."""
    print(f"  {case.name}, {measurement.particles:,} particles: {measurement.rate:.2f} M/s", file=sys.stderr)
    return measurement


def report_rates(
    singles: list[dict[BenchmarkCase, Measurement]], pairs: list[dict[BenchmarkCase, tuple[float, float]]]
) -> list[str]:
    """Write the tables of all rounds, with what they show, as lines of Markdown."""
    lines = [
        "# How fast a substep is",
        "",
        f"{tables.describe_machine()}; {len(singles)} rounds. `README.md` says what is timed.",
    ]
    lines += [
        "",
        "Median, and least to greatest of the rounds; one process on one thread, in seconds of processor time.",
    ]
    for scene, title in SCENES.items():
        lines += ["", f"## {title}", "", *tables.tabulate_codes(singles, CODES[scene])]
    lines += [
        "",
        "## More particles, and a wider domain around the same snow",
        "",
        *tables.tabulate_sizes(singles, SIZES),
    ]
    lines += ["", "## Two processes at once, by the clock", "", *tables.tabulate_pairs(pairs, PAIRS)]
    return lines


if __name__ == "__main__":
    main()
