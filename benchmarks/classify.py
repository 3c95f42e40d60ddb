"""How fast lumps and powder are told apart, beside tools that find clusters by distance.

    python benchmarks/classify.py [--rounds 3] [--quick] [--write]

The body is the star of the paper, pulled apart and crushed over time by a made-up motion; nothing is simulated.
--quick: one round of a small body.  --write: also to benchmarks/classify.md.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr
from tables import in_markdown, machine, spread

import snowrepro
from snowrepro.analysis.classify import bond_variables
from snowrepro.analysis.sensitivity import scan_bonds
from snowrepro.composition import compose
from snowrepro.config import Outline
from snowrepro.scene.build import sample

RESULTS = Path(__file__).with_name("classify.md")
FRAMES = 400


def main() -> None:
    """Time all cases in turns and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--quick", action="store_true", help="one round of a small body")
    parser.add_argument("--write", action="store_true", help=f"write {RESULTS.name} too")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        cases = prepare(Path(folder), options.quick)
        rounds = [
            {name: timed(case) for name, case in cases.items()} for _ in range(1 if options.quick else options.rounds)
        ]
    text = report(rounds)
    if options.write:
        RESULTS.write_text(text, encoding="utf-8")
    print(text, end="")


def prepare(folder: Path, quick: bool) -> dict[str, Callable[[], object]]:
    """The cases by name, with their data ready."""
    star = compose(["shape=star"]).shape.outline
    x = sample(star, 4.0 if quick else 1.0, 4, 0)[0]
    run = folder / "run.nc"
    write_run(run, x, FRAMES)
    big = sample(Outline(kind="circle", radius=20.0 if quick else 282.1), 1.0, 4, 0)[0]
    broken = pulled_apart(big, 1.0)
    found = snowrepro.classify(np.stack([x, pulled_apart(x, 1.0)]), release=0, grid_spacing=1.0)
    seen = xr.Dataset({**bond_variables(found.bonds, found.history), "mass": ("particle", np.ones(len(x)))})
    count, many = f"{len(x):,} particles", f"{len(big):,} particles"
    cases = {
        f"a run from its file: {count}, {FRAMES} frames": lambda: from_file(run),
        f"one frame by bonds: {many}": lambda: classify(big, broken, "bonds"),
        f"one frame by proximity: {many}": lambda: classify(big, broken, "proximity"),
        f"864 definitions from stored bonds: {count}": lambda: scan_bonds(seen, 1.0),
    }
    return cases | peers(broken, many)


def peers(places: np.ndarray, many: str) -> dict[str, Callable[[], object]]:
    """Clusters by distance in other libraries, where they are installed."""
    cases = {}
    try:
        import freud

        flat = np.column_stack([places, np.zeros(len(places))]).astype(np.float32)
        box = freud.box.Box.square(4 * float(np.abs(places).max()))
        cases[f"the same by freud: {many}"] = lambda: freud.cluster.Cluster().compute(
            (box, flat), neighbors={"r_max": 1.0}
        )
    except ImportError:
        pass
    try:
        from sklearn.cluster import DBSCAN

        cases[f"the same by scikit-learn: {many}"] = lambda: DBSCAN(eps=1.0, min_samples=1).fit(places)
    except ImportError:
        pass
    return cases


def pulled_apart(x: np.ndarray, part: float) -> np.ndarray:
    """Cut into four strips that move apart, the lower half of each crushed; ``part`` of the way."""
    strip = np.digitize(x[:, 0], np.quantile(x[:, 0], [0.25, 0.5, 0.75]))
    moved = x + part * strip[:, None] * [20.0, 0.0]
    low = x[:, 1] < np.median(x[:, 1])
    moved[low, 1] *= 1 - 0.7 * part
    return moved


def write_run(path: Path, x: np.ndarray, frames: int) -> None:
    """A file as a run's is: single precision, packed."""
    states = np.stack([pulled_apart(x, t) for t in np.linspace(0, 1, frames)]).astype(np.float32)
    data = xr.Dataset(
        {"position": (("snapshot", "particle", "axis"), states), "mass": ("particle", np.ones(len(x)))},
        attrs={"release_frame": 0, "grid_spacing": 1.0, "cell_mass": 4.0},
    )
    packed = {"zlib": True, "complevel": 1, "shuffle": True}
    data.to_netcdf(path, engine="netcdf4", encoding={"position": packed})


def from_file(path: Path) -> object:
    """Read and classify: bonds through all frames, fragments and their table at the last."""
    with xr.open_dataset(path) as data:
        found = snowrepro.classify(data)
        return found.measures(), found.table()


def classify(first: np.ndarray, last: np.ndarray, definition: str) -> object:
    """One frame after release."""
    return snowrepro.classify(np.stack([first, last]), release=0, grid_spacing=1.0, definition=definition).measures()


def timed(case: Callable[[], object]) -> float:
    """Seconds of processor time, in all threads."""
    start = time.process_time()
    case()
    return time.process_time() - start


def report(rounds: list[dict[str, float]]) -> str:
    """The table."""
    rows = [[name, spread([r[name] for r in rounds])] for name in rounds[0]]
    lines = [
        "# How fast lumps and powder are told apart",
        "",
        f"{machine()}; {len(rounds)} rounds in one process; seconds of processor time: median, and least to greatest.",
        "",
        *in_markdown(["case", "seconds"], rows),
        "",
        "`classify.py` says what the motion is. By bonds: a triangulation at release (most of the time), extremes "
        "through all frames, cores, fragments, measures. By proximity bonds are laid too, for their broken part.",
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
