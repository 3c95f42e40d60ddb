"""Defects drawn at random from the code, each tried on a copy of the program.

    python benchmarks/mutation/mutation.py draw --seed 1 --each 8    # writes drawn.yaml anew
    python benchmarks/mutation/mutation.py try [NAME ...]            # those without a trial yet, or those named
    python benchmarks/mutation/mutation.py report                    # writes mutation.md

A trial ends at the first that fails: the fast tests that import the file, the other fast tests of its room, tiers 0
to 2 of ``snowrepro check`` where the room is part of the simulation.  Each is a line in trials.jsonl as soon as it is
known; the last of a mutant counts.  What became of a survivor is its ``remark`` in drawn.yaml, written by hand.

Trials are forks of one process that has loaded whatever is no part of the program, which saves most of the time that
it takes to start.  So nothing here may import the program.
"""

import argparse
import importlib
import itertools
import json
import os
import random
import re
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import NoReturn

import pytest
import yaml
from changes import Change, find_changes, says_something_else

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parents[1]
DRAWN, TRIALS, REPORT = HERE / "drawn.yaml", HERE / "trials.jsonl", HERE / "mutation.md"
# The tests of each room, quick ones first.
ROOMS = {
    "physics": ("laws", "physics", "test_point.py", "mpm", "validation"),
    "laws": ("laws", "test_point.py", "physics", "mpm", "validation"),
    "mpm": ("mpm/test_steps.py", "mpm", "laws", "validation"),
    "scene": ("scene", "composition", "mpm", "validation"),
    "analysis": ("analysis", "summary", "evidence"),
    "store": ("store", "fuzz", "summary", "sweep", "test_foreign.py"),
}
SIMULATED = ("physics", "laws", "mpm", "scene")
LOADED = (
    "taichi", "numpy", "scipy.spatial", "scipy.sparse.csgraph", "pandas", "xarray", "netCDF4", "pydantic", "hydra",
    "omegaconf", "shapely", "hypothesis", "hypothesis.extra.numpy", "xdist.plugin", "_hypothesis_pytestplugin", "rich",
    "psutil",
)  # fmt: skip
HOW_TO_READ = (
    "Drawn with seed 1 before any was tried, eight of each room: lines, each as likely as another, and of each line "
    "one of its changes. `mutation.py` says how one is tried; of most, the tests likeliest to notice were asked first."
)
OUTCOMES = ("test", "new test", "tier", "explained", "survived", "not known")
FAST = "not slow and not nightly"
COPIED = ("snowrepro", "conf", "experiments", "hydra_plugins", "tests", "docs", "benchmarks", "reports/baseline")
COPIED_FILES = ("pyproject.toml", "README.md", "CHANGELOG.md", "Makefile", "CITATION.cff")


@dataclass(frozen=True)
class Drawn:
    """A defect that was drawn; ``remark``: what became of it where nothing noticed it at first."""

    name: str
    file: str
    line: int
    operator: str
    old: str
    new: str
    remark: str = ""

    @property
    def room(self) -> str:
        """The room of its file."""
        return self.file.partition("/")[0]


@dataclass(frozen=True)
class Trial:
    """What noticed a mutant: "import", a test, a tier; "" where nothing did; ``in_time``: whether all was asked."""

    name: str
    caught_by: str
    in_time: bool
    seconds: float
    last: str = ""  # the test that ran when time was up


def main() -> None:
    """Draw, try or report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("verb", choices=["draw", "try", "report"])
    parser.add_argument("names", nargs="*", help="mutants to be tried, again if need be")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--each", type=int, default=8, help="mutants of each room")
    parser.add_argument("--limit", type=float, default=240.0, help="seconds that a trial may take")
    options = parser.parse_args()
    if options.verb == "draw":
        drawn = [asdict(mutant) for room in ROOMS for mutant in draw_mutants(room, options.seed, options.each)]
        DRAWN.write_text(yaml.safe_dump(drawn, sort_keys=False, allow_unicode=True, width=200), encoding="utf-8")
    elif options.verb == "try":
        try_mutants(options.names, options.limit)
    else:
        REPORT.write_text("\n".join(report_trials(read_drawn(), read_trials())) + "\n", encoding="utf-8")


def draw_mutants(room: str, seed: int, count: int) -> list[Drawn]:
    """Draw mutants of a room: lines, each as likely as another, and of each line one of its changes."""
    rng = random.Random(f"{seed} {room}")
    files = {path: path.read_text("utf-8") for path in sorted((REPOSITORY / "snowrepro" / room).glob("*.py"))}
    by_line: dict[tuple[Path, int], list[Change]] = {}
    for path, text in files.items():
        for change in find_changes(text):
            by_line.setdefault((path, change.line), []).append(change)
    drawn = []
    for path, line in rng.sample(sorted(by_line), len(by_line)):
        real = [change for change in by_line[path, line] if says_something_else(files[path], change)]
        if real:
            name = f"{room}/{path.name}"
            drawn.append(Drawn(f"{name}:{line}", name, **asdict(rng.choice(real))))
        if len(drawn) == count:
            break
    return sorted(drawn, key=lambda mutant: (mutant.file, mutant.line))


def read_drawn() -> list[Drawn]:
    """Read the mutants that were drawn."""
    return [Drawn(**entry) for entry in yaml.safe_load(DRAWN.read_text("utf-8"))]


def read_trials() -> dict[str, Trial]:
    """Read the last trial of each mutant."""
    lines = TRIALS.read_text("utf-8").splitlines() if TRIALS.exists() else []
    trials = [Trial(**json.loads(line)) for line in lines]
    return {trial.name: trial for trial in trials}


def try_mutants(names: Sequence[str], limit: float) -> None:
    """Try the mutants of these names, or all that have no trial yet; each is written down at once."""
    for name in LOADED:
        importlib.import_module(name)
    done = read_trials()
    for mutant in read_drawn():
        if mutant.name in names or (not names and mutant.name not in done):
            trial = try_mutant(mutant, limit)
            with TRIALS.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(trial)) + "\n")
            print(f"{trial.name}: {trial.caught_by or 'survived'} ({trial.seconds:.0f} s)", flush=True)


def try_mutant(mutant: Drawn, limit: float) -> Trial:
    """Try one mutant on a copy of the program, for ``limit`` seconds at most."""
    start = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="mutant-") as name:
        folder = Path(name).resolve()
        copy_repository(folder)
        apply_change(folder / "snowrepro" / mutant.file, mutant)
        caught_by, last = "", ""
        for words in list_commands(mutant, folder):
            code, lines = run_command(words, folder, limit - (time.monotonic() - start))
            caught_by, last = read_outcome(words, code, lines)
            if code != 0:
                break
    return Trial(mutant.name, caught_by, not last, round(time.monotonic() - start, 1), last)


def copy_repository(folder: Path) -> None:
    """Copy what tests and checks need."""
    for name in COPIED:
        shutil.copytree(REPOSITORY / name, folder / name, symlinks=True)
    for name in COPIED_FILES:
        shutil.copy(REPOSITORY / name, folder / name)


def apply_change(path: Path, mutant: Drawn) -> None:
    """Change a file of the copy.  Raises SystemExit where its lines are not there once: the code went on since."""
    text = path.read_text("utf-8")
    if text.count(mutant.old) != 1:
        raise SystemExit(f"{mutant.name}: its lines stand {text.count(mutant.old)} times in {mutant.file}: draw anew")
    path.write_text(text.replace(mutant.old, mutant.new), encoding="utf-8")


def list_commands(mutant: Drawn, folder: Path) -> Iterator[list[str]]:
    """The commands of a trial, cheapest first."""
    how = ["pytest", "-x", "-v", "-n", "0", "-p", "no:warnings", "-p", "no:cacheprovider", "-m", FAST]
    yield from ([*how, *files] for files in split_tests(mutant, folder) if files)
    if mutant.room in SIMULATED:
        yield ["check", "--tier", "0,1,2"]


def split_tests(mutant: Drawn, folder: Path) -> tuple[list[str], list[str]]:
    """The files of tests that import the mutant's module, wherever they are; the others of its room, nearest first."""
    stem = Path(mutant.file).stem
    tests = {file: file.read_text("utf-8") for file in sorted((folder / "tests").rglob("test_*.py"))}
    uses = re.compile(rf"snowrepro\.{mutant.room}(\.| import .*\b){stem}\b")
    of_module = [file for file, text in tests.items() if uses.search(text)]
    of_module.sort(key=lambda file: file.parent.name != mutant.room)
    places = [folder / "tests" / name for name in ROOMS[mutant.room]]
    of_room = [file for place in places for file in tests if place in (file, file.parent)]
    others = [file for file in dict.fromkeys(of_room) if file not in of_module]
    names = re.compile(rf"\b({'|'.join([stem, *find_users(mutant, folder)])})\b")
    others.sort(key=lambda file: -len(names.findall(tests[file])))
    return tuple([file.relative_to(folder).as_posix() for file in part] for part in (of_module, others))


def find_users(mutant: Drawn, folder: Path) -> list[str]:
    """Names of the modules that import the mutant's module."""
    imports = re.compile(rf"^from \.\S*( import .*\b|\b){Path(mutant.file).stem}\b", re.MULTILINE)
    package = folder / "snowrepro"
    return [file.stem for file in sorted(package.rglob("*.py")) if imports.search(file.read_text("utf-8"))]


def run_command(words: Sequence[str], folder: Path, seconds: float) -> tuple[int | None, list[str]]:
    """Run a command in a fork; returns its exit code, None where time was up, and the lines that it wrote."""
    output, end = folder / "output.txt", time.monotonic() + max(seconds, 1.0)
    child = os.fork()
    if child == 0:
        become_command(words, folder, output)
    while (ended := os.waitpid(child, os.WNOHANG))[0] == 0 and time.monotonic() < end:
        time.sleep(0.1)
    with suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)  # and what it started
    if ended[0] == 0:
        os.waitpid(child, 0)
    code = os.waitstatus_to_exitcode(ended[1]) if ended[0] else None
    return code, output.read_text("utf-8", errors="replace").splitlines()


def become_command(words: Sequence[str], folder: Path, output: Path) -> NoReturn:
    """Run a command of the copy in this process, a fork in a group of its own, and end it."""
    os.setsid()
    file = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(file, 1)
    os.dup2(file, 2)
    os.chdir(folder)
    os.environ["PYTHONPATH"] = str(folder)  # of processes that the tests start
    sys.path[:] = [str(folder), *(path for path in sys.path if path not in ("", str(HERE), str(REPOSITORY)))]
    code = 1
    try:
        if words[0] == "pytest":
            code = int(pytest.main(list(words[1:])))
        else:
            code = int(importlib.import_module("snowrepro.cli").main(list(words)))
    except BaseException:  # noqa: BLE001 - whatever it is, the fork ends here
        traceback.print_exc()
    sys.stdout.flush()
    os._exit(code)


def read_outcome(words: Sequence[str], code: int | None, lines: Sequence[str]) -> tuple[str, str]:
    """Read what noticed, and what was going on when time was up; "" where neither."""
    if code is None:
        return "", lines[-1].strip() if lines else "nothing yet"
    if code == 0:
        return "", ""
    if words[0] == "pytest":
        failed = [line.partition(" ")[2] for line in lines if line.startswith(("FAILED ", "ERROR "))]
        return failed[0] if failed else f"pytest ended with {code}", ""
    tiers = [line for line in lines if re.search(r"REGRESSED|FAILED|CONTRADICTED", line, re.IGNORECASE)]
    return f"check: {tiers[0].strip() if tiers else code}", ""


def report_trials(drawn: Sequence[Drawn], trials: Mapping[str, Trial]) -> list[str]:
    """Report the trials as lines of Markdown: counts, and a row for each mutant."""
    head = ["room", "drawn", "caught by a test", "by a new test", "by a tier", "explained", "survived", "not known"]
    rooms = [[mutant for mutant in drawn if mutant.room == room] for room in ROOMS]
    counts = [[room, *count_outcomes(mutants, trials)] for room, mutants in zip(ROOMS, rooms, strict=True)]
    total = ["all", *count_outcomes(drawn, trials)]
    rows = [[mutant.name, *describe_change(mutant), describe_outcome(mutant, trials)] for mutant in drawn]
    return [
        "# Defects drawn at random",
        "",
        HOW_TO_READ,
        "",
        *format_table(head, [*counts, total]),
        "",
        *format_table(["place", "was", "became", "caught by, or what became of it"], rows),
    ]


def count_outcomes(mutants: Sequence[Drawn], trials: Mapping[str, Trial]) -> list[str]:
    """Count mutants, and what became of them, in the order of the table's head."""
    outcomes = Counter(classify_outcome(mutant, trials) for mutant in mutants)
    return [str(len(mutants)), *(str(outcomes[name]) for name in OUTCOMES)]


def classify_outcome(mutant: Drawn, trials: Mapping[str, Trial]) -> str:
    """What became of a mutant, in a word."""
    trial = trials.get(mutant.name)
    if trial and trial.caught_by:
        by_test = "new test" if mutant.remark else "test"
        return "tier" if trial.caught_by.startswith("check") else by_test
    if mutant.remark:
        return "explained"
    return "survived" if trial and trial.in_time else "not known"


def describe_outcome(mutant: Drawn, trials: Mapping[str, Trial]) -> str:
    """Name what caught a mutant, without its message, or say what became of it."""
    trial = trials.get(mutant.name)
    if trial is None:
        return mutant.remark or "not tried"
    caught = trial.caught_by.partition(" - ")[0].removeprefix("tests/")
    missed = "nothing" if trial.in_time else f"nothing in {trial.seconds:.0f} s"
    return "; ".join(filter(None, [f"`{caught}`" if caught else missed, mutant.remark]))


def describe_change(mutant: Drawn) -> list[str]:
    """The lines that differ, before and after."""
    old, new = mutant.old.splitlines(), mutant.new.splitlines()
    differing = [pair for pair in itertools.zip_longest(old, new, fillvalue="") if pair[0] != pair[1]]
    return [
        "<br>".join("`" + line.strip().replace("|", "\\|") + "`" for line in lines if line)
        for lines in zip(*differing, strict=True)
    ]


def format_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Write a table as lines of Markdown."""
    return ["| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *rows)]


if __name__ == "__main__":
    main()
