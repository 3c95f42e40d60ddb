"""Random overrides: each is planned, or refused in one line, within bounded time and memory.

``PYTHONPATH=. python tests/fuzz/test_configurations.py 1000`` prints what became of a thousand.
"""

import random
import resource
import sys
import time
from collections import Counter

import pytest

from snowrepro.errors import SnowreproError
from snowrepro.scene.build import check_size
from snowrepro.sweep.plan import make_plan

KEYS = [
    "shape", "floor", "sintering", "material", "loading", "reading", "fidelity", "solver", "analysis", "claims",
    "experiment", "indenter", "variant", "scene", "pressure", "seed", "output.every", "threads", "store", "reports",
    "rerun", "checkpoint_seconds", "deterministic", "shape.name", "shape.outline", "shape.outline.kind",
    "shape.outline.radius", "shape.outline.points", "floor.width", "floor.drop_x", "floor.outline.points",
    "material.rho", "material.nu", "sintering.enabled", "sintering.C3", "loading.frames", "loading.press_frames",
    "loading.frame_time", "reading.cell", "reading.gravity", "reading.plastic_volume", "reading.hardening_exponent",
    "reading.press_ramp", "fidelity.dx", "fidelity.particles_per_cell", "solver.cfl", "solver.max_substeps",
    "indenter.depth", "indenter.speed", "experiment.frames", "experiment.picture", "hydra.mode", "hydra/launcher",
    "hydra.launcher.workers", "hydra.searchpath", "hydra.sweeper.params", "nothing", "shape.nothing", "",
]  # fmt: skip
VALUES = [
    "0", "1", "-1", "2", "0.5", "1e-9", "1e9", "1e30", "1e308", "1e999", ".inf", ".nan", "null", "true", "off", "''",
    "10**9", "9" * 40, "ball", "star", "paper", "none", "fig5", "grid", "disc", "preview", "L", "1,2", "1,2,3,4",
    "range(0,3)", "range(0,1e12)", "range(1,2,0)", "choice(1,x)", "interval(0,1)", "glob(*)", "sort(3,1,2)",
    "shuffle(range(0,5))", "[1,2]", "[[0,0],[1,0],[0,1]]", "[[0,0],[9e9,0],[0,1]]", "[[0,0,0,0]]", "{a:1}", "{a:{b:1}}",
    "[", "]", "{", "(", "'", '"', "\\", "${pressure}", "${nothing}", "${oc.env:HOME}", "${", "a b", "a=b", "\u00fc",
    "\x1b[31m", "\n", "../../x", "/dev/null", "x" * 3000, "[" * 30, "[" + "1," * 400 + "1]", "0x10", "1_000", "1e",
]  # fmt: skip
SOUND = [
    "shape=star", "floor=zigzag", "sintering=none", "fidelity=preview", "fidelity=fine", "reading=si", "solver=mls",
    "solver=pic_flip", "indenter=disc", "experiment=fig5", "experiment=table2", "pressure=500", "pressure=1,2,3",
    "pressure=range(100,400,100)", "seed=4", "seed=range(3)", "output.every=2", "loading.frames=200", "threads=1",
    "reading.gravity=9.81", "material.rho=300", "shape.outline.radius=20", "floor.width=300", "solver.cfl=0.2",
    "hydra.launcher.workers=2", "store=there", "reports=here", "rerun=[code]", "+shape.outline.centre=[1,2]",
]  # fmt: skip
PREFIXES = ["", "", "", "", "", "+", "++", "~"]
MOST_SECONDS, MOST_MEGABYTES = 10.0, 2000.0


def draw_overrides(chance: random.Random) -> list[str]:
    """Draw one to four overrides; some have no value, as a deletion has none."""
    words = []
    for _ in range(chance.randint(1, 4)):
        if chance.random() < 0.6:
            words.append(chance.choice(SOUND))
            continue
        key = chance.choice(PREFIXES) + chance.choice(KEYS)
        words.append(key if key.startswith("~") else f"{key}={chance.choice(VALUES)}")
    return words


def try_overrides(words: list[str]) -> tuple[str, float]:
    """Plan overrides; returns what became of them, and the processor seconds that it took."""
    began = time.process_time()
    try:
        plan = make_plan(words, multirun=True)
        for run in plan.runs[:20]:
            check_size(run.case)
        became = "planned"
    except SnowreproError as error:
        became = "refused" if "\n" not in str(error) and str(error).strip() else f"several lines, or none: {error!r}"
    except Exception as error:  # noqa: BLE001 (which is what is looked for)
        became = f"{type(error).__name__}: {error}"
    return became, time.process_time() - began


def try_many(count: int, seed: int) -> Counter[str]:
    """Plan many random overrides; returns how often each outcome came about, with its overrides where it is wrong."""
    chance, outcomes = random.Random(seed), Counter[str]()
    for _ in range(count):
        words = draw_overrides(chance)
        became, seconds = try_overrides(words)
        fine = became in ("planned", "refused")
        outcomes[became if fine else f"{words}: {became}"] += 1
        if seconds > MOST_SECONDS:
            outcomes[f"{words}: took {seconds:.0f} s"] += 1
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000.0
    if used > MOST_MEGABYTES:
        outcomes[f"used {used:.0f} MB"] += 1
    return outcomes


@pytest.mark.parametrize(("count", "seed"), [(30, 1), pytest.param(1000, 2, marks=pytest.mark.nightly)])
def test_any_overrides_are_planned_or_refused(count, seed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    outcomes = try_many(count, seed)
    assert outcomes.keys() == {"planned", "refused"}, "\n".join(outcomes)
    assert list(tmp_path.iterdir()) == []


if __name__ == "__main__":
    for outcome, times in try_many(int(sys.argv[1]), 2).most_common():
        print(f"{times:5}  {outcome}")
