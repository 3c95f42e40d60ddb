"""How fast lumps and powder are told apart, beside tools that find clusters by distance.

    python benchmarks/classify.py [--rounds 3] [--quick] [--write]

The body is the star of the paper, pulled apart and crushed over time by a made-up motion; nothing is simulated.
--quick: one round of a small body.  --write: also to benchmarks/classify.md.
"""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.spatial import cKDTree
from tables import describe_machine, format_spread, format_table, read_options

import snowrepro
from snowrepro.analysis.lumps import make_bond_variables
from snowrepro.composition.compose import compose
from snowrepro.evidence.sensitivity import scan_bonds
from snowrepro.scene.build import sample
from snowrepro.settings.case import Outline

RESULTS = Path(__file__).with_name("classify.md")
FRAMES = 400
PEER = "the 8 nearest by SciPy's cKDTree"
WHAT_IS_TIMED = "seconds of processor time: median, and least to greatest"
WHAT_IS_DONE = (
    "`classify.py` says what the motion is; a ratio is to SciPy's search in the same round. By strain, as runs are "
    "classified: clusters through all frames, maps of neighbourhoods, the clusters that carry each particle, "
    "fragments, measures. By bonds: that, a triangulation at release (most of the time), extremes, cores."
)


def main() -> None:
    """Time all cases in turns and print the table."""
    options = read_options(__doc__, RESULTS, 3, "one round of a small body")
    with tempfile.TemporaryDirectory() as folder:
        cases = prepare_cases(Path(folder), options.quick)
        rounds = [{name: time_case(case) for name, case in cases.items()} for _ in range(options.rounds)]
    text = report_times(rounds)
    if options.write:
        RESULTS.write_text(text, encoding="utf-8")
    print(text, end="")


def prepare_cases(folder: Path, quick: bool) -> dict[str, Callable[[], object]]:
    """Make the data of all cases, and return the cases by name."""
    star = compose(["shape=star"]).case.shape.outline
    x = sample(star, 4.0 if quick else 1.0, 4, 0)[0]
    run = folder / "run.nc"
    write_run(run, x, FRAMES)
    big = sample(Outline(kind="circle", radius=20.0 if quick else 282.1), 1.0, 4, 0)[0]
    broken = pull_apart(big, 1.0)
    both = np.stack([x, pull_apart(x, 1.0)])
    state = snowrepro.classify(both, release=0, grid_spacing=1.0, definition="bonds").state
    bonds = xr.Dataset({**make_bond_variables(state.bonds, state.history, ""), "mass": ("particle", np.ones(len(x)))})
    count, many = f"{len(x):,} particles", f"{len(big):,} particles"
    cases = {
        f"a run from its file: {count}, {FRAMES} frames": lambda: classify_file(run),
        f"one frame by strain: {many}": lambda: classify(big, broken, "strain"),
        f"one frame by bonds: {many}": lambda: classify(big, broken, "bonds"),
        f"one frame by proximity: {many}": lambda: classify(big, broken, "proximity"),
        f"864 definitions from stored bonds: {count}": lambda: scan_bonds(bonds, 1.0),
    }
    return cases | {f"{PEER}: {many}": lambda: cKDTree(broken).query(broken, k=8)} | prepare_peers(broken, many)


def prepare_peers(places: np.ndarray, many: str) -> dict[str, Callable[[], object]]:
    """Make the cases of other libraries that find clusters by distance, where they are installed."""
    cases = {}
    try:
        import freud

        flat = np.column_stack([places, np.zeros(len(places))]).astype(np.float32)
        box = freud.box.Box.square(4 * float(np.abs(places).max()))
        cases[f"friends of friends by freud: {many}"] = lambda: freud.cluster.Cluster().compute(
            (box, flat), neighbors={"r_max": 1.0}
        )
    except ImportError:
        pass
    try:
        from sklearn.cluster import DBSCAN

        cases[f"friends of friends by scikit-learn: {many}"] = lambda: DBSCAN(eps=1.0, min_samples=1).fit(places)
    except ImportError:
        pass
    return cases


def pull_apart(x: np.ndarray, part: float) -> np.ndarray:
    """Cut a body ``x`` (n, 2) into four strips that move apart, the lower half of each crushed; ``part`` of the way."""
    strip = np.digitize(x[:, 0], np.quantile(x[:, 0], [0.25, 0.5, 0.75]))
    moved = x + part * strip[:, None] * [20.0, 0.0]
    low = x[:, 1] < np.median(x[:, 1])
    moved[low, 1] *= 1 - 0.7 * part
    return moved


def write_run(path: Path, x: np.ndarray, frames: int) -> None:
    """Write a file as that of a run: single precision, packed."""
    states = np.stack([pull_apart(x, t) for t in np.linspace(0, 1, frames)]).astype(np.float32)
    data = xr.Dataset(
        {"position": (("snapshot", "particle", "axis"), states), "mass": ("particle", np.ones(len(x)))},
        attrs={"release_frame": 0, "grid_spacing": 1.0, "cell": 1.0, "cell_mass": 4.0},
    )
    packed = {"zlib": True, "complevel": 1, "shuffle": True}
    data.to_netcdf(path, engine="netcdf4", encoding={"position": packed})


def classify_file(path: Path) -> object:
    """Read and classify: clusters through all frames, fragments and their table at the last."""
    with xr.open_dataset(path) as data:
        classified = snowrepro.classify(data)
        return classified.measures(), classified.table()


def classify(first: np.ndarray, last: np.ndarray, definition: str) -> object:
    """Classify one frame after the release."""
    return snowrepro.classify(np.stack([first, last]), release=0, grid_spacing=1.0, definition=definition).measures()


def time_case(case: Callable[[], object]) -> float:
    """Run a case and return its seconds of processor time, in all threads."""
    start = time.process_time()
    case()
    return time.process_time() - start


def report_times(rounds: list[dict[str, float]]) -> str:
    """Write the table of all rounds as Markdown."""
    peer = next(name for name in rounds[0] if name.startswith(PEER))
    ratios = {name: format_spread([r[name] / r[peer] for r in rounds]) for name in rounds[0]}
    rows = [[name, format_spread([r[name] for r in rounds]), ratios[name]] for name in rounds[0]]
    lines = [
        "# How fast lumps and powder are told apart",
        "",
        f"{describe_machine()}; {len(rounds)} rounds in one process; {WHAT_IS_TIMED}.",
        "",
        *format_table(["case", "seconds", "ratio"], rows),
        "",
        WHAT_IS_DONE,
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
