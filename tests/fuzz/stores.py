"""Stores to be damaged: a small one with all that a store can have, ways to damage it, and a way to use it."""

import hashlib
import json
import os
import random
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from snowrepro.composition.compose import compose
from snowrepro.store import lease
from snowrepro.store.files import write_json
from snowrepro.store.run import Run
from snowrepro.summary.row import read_bonds
from snowrepro.sweep import record
from snowrepro.sweep.plan import make_plan
from tests.conftest import SMALL
from tests.report import small_runs

SWEEP = [*SMALL, "sintering=paper,none", "pressure=500,3000", "experiment=fig5", "experiment.frames=[0,20,60]"]
UNFINISHED = [1, 2, 3]  # seeds of runs that failed, were interrupted, and are worked on by somebody who died
JSON_FILES = ("manifest.json", "summary.json", "outcome.json", "config.json", "lease.3", "progress.json", "sweep.json")
SECONDS = 10  # of computing that one command may take; and of waiting, where the machine is busy
WAITING = 20

# Several command lines in one process, as a shell would give them: what each printed, and how it ended.
DRIVER = """
import contextlib, io, json, sys, time, traceback
from snowrepro.cli import screen
from snowrepro.cli.main import main
for words in json.loads(sys.argv[1]):
    out, errors, began = io.StringIO(), io.StringIO(), time.process_time()
    screen.console.file = errors
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
        try:
            main(words)
            code = 0
        except SystemExit as end:
            code = end.code
        except BaseException:
            code = "traceback"
            traceback.print_exc()
    seconds = time.process_time() - began
    print(json.dumps([words, code, seconds, out.getvalue(), errors.getvalue()]), flush=True)
"""


@dataclass(frozen=True)
class Used:
    """What became of a command: its exit code, "traceback" or "hang"; how long it took, and what it printed."""

    words: tuple[str, ...]
    code: int | str
    seconds: float
    out: str
    errors: str


def build(run: xr.Dataset, store: Path) -> list[str]:
    """Make a store with four finished runs of a sweep 'good' and three unfinished ones; returns the ids of all."""
    finished = small_runs.saved(run, store, vanish=False)
    for each in finished:
        read_bonds(each)
    folder = record.write_record(make_plan([*SWEEP, f"store={store}"], multirun=True))
    folder.rename(folder.with_name("good"))
    others = [Run(compose([*SMALL, f"seed={seed}", f"store={store}"])) for seed in UNFINISHED]
    failed, interrupted, left = others
    for each in others:
        each.work.mkdir(parents=True)
        each.save_config()
        (each.work / "run.log").write_text("began\n")
    failed.save_outcome("failed", "diverged in frame 3", final=True)
    interrupted.save_outcome("interrupted", "stopped in frame 3")
    interrupted.save_checkpoint({"frame": np.array(3), "position": np.zeros((5, 2))})
    write_json(left.work / "lease.3", {**vars(lease.here()), "pid": 2**22 + 1})
    left.save_progress(3, 60, 100)
    return [each.id for each in (*finished, *others)]


def use(commands: Sequence[Sequence[str]], cwd: Path, home: Path, waiting: float = WAITING) -> list[Used]:
    """Give command lines to one process that starts in ``cwd``; one that hangs ends it and is the last."""
    environment = {
        **os.environ,
        "HOME": str(home),
        "MPLCONFIGDIR": str(cwd / "out"),
        "XDG_CACHE_HOME": str(cwd / "out"),
    }
    process = subprocess.Popen(
        [sys.executable, "-c", DRIVER, json.dumps([list(words) for words in commands])],
        cwd=cwd, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    try:
        printed, _ = process.communicate(timeout=60 + waiting * len(commands))
    except subprocess.TimeoutExpired:
        process.kill()
        printed, _ = process.communicate()
    read = [json.loads(line) for line in printed.splitlines() if line.startswith('[["')]
    used = [Used(tuple(words), code, took, out, errors) for words, code, took, out, errors in read]
    missing = [Used(tuple(words), "hang", np.inf, "", printed[-2000:]) for words in commands[len(used) :]]
    return [*used, *missing[:1]]


def flaw_of(used: Used) -> str:
    """What is wrong with how a command ended; empty if nothing is."""
    if used.code not in (0, 1, 2, 3, 4):
        return f"{used.code}: {used.errors.strip().splitlines()[-1] if used.errors.strip() else ''}"
    if "Traceback" in used.errors:
        return "traceback"
    if used.seconds > SECONDS:
        return f"took {used.seconds:.0f} s"
    return "raw text" if not (used.out + used.errors).replace("\n", "").isprintable() else ""


def hash_tree(folder: Path) -> dict[str, str]:
    """Each file, folder and link below a folder, with what is in it or where it leads."""
    found = {}
    for place, folders, names in os.walk(folder):
        for name in (*folders, *names):
            path = Path(place, name)
            if path.is_symlink():
                found[str(path)] = f"-> {path.readlink()}"
            elif path.is_file():
                found[str(path)] = hashlib.sha256(path.read_bytes()).hexdigest()
            else:
                found[str(path)] = "folder"
    return found


def damage(store: Path, ids: Sequence[str], outside: Path, seed: int) -> str:
    """Damage one or two things of one run or of a new sweep, by a seed; returns what was done, in words."""
    rng = random.Random(seed)
    files = sorted(
        path for path in store.rglob("*") if path.is_file() and "good" not in path.parts and ids[0] not in path.parts
    )
    done = []
    for _ in range(rng.choice((1, 1, 2))):
        path = rng.choice(files)
        if not path.is_file() or path.is_symlink():
            continue
        ways = [*BYTES, *LINKS, *([mutate_json] * 6 if path.name in JSON_FILES else [])]
        way = rng.choice(ways)
        way(path, outside, rng)
        done.append(f"{way.__name__} {path.relative_to(store)}")
    return ", ".join(done)


def flip(path: Path, _: Path, rng: random.Random) -> None:
    """Change some bytes; half of the times behind the same time."""
    status, content = path.stat(), bytearray(path.read_bytes())
    for _ in range(rng.choice((1, 3, 50))):
        if content:
            content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    path.write_bytes(content)
    if rng.random() < 0.5:
        os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


def truncate(path: Path, _: Path, rng: random.Random) -> None:
    os.truncate(path, rng.randrange(path.stat().st_size + 1))


def empty(path: Path, _: Path, rng: random.Random) -> None:
    path.write_bytes(b"")


def replace(path: Path, _: Path, rng: random.Random) -> None:
    """Put something else in its place."""
    deep = b'{"a":' * 60_000 + b"1" + b"}" * 60_000
    others = (b"\0" * 100, b"\xff\xfe\x80 text", b"[1, 2]", b'"text"', b"{}", deep, b"[" * 100_000, b'{"a": 1, "a": 2}')
    path.write_bytes(rng.choice(others))


def grow(path: Path, _: Path, rng: random.Random) -> None:
    """Make it larger than any real one is, without taking room on the disk."""
    os.truncate(path, 5 << 30)


def swap(path: Path, _: Path, rng: random.Random) -> None:
    """Put the file of the same name of another run there."""
    others = [each for each in path.parents[1].glob(f"*/{path.name}") if each != path and each.is_file()]
    if others:
        shutil.copy2(rng.choice(others), path)


def link_file(path: Path, outside: Path, rng: random.Random) -> None:
    path.unlink()
    path.symlink_to(rng.choice((outside / "precious.txt", outside / "copy" / path.name, Path("/dev/zero"), path)))


def link_folder(path: Path, outside: Path, rng: random.Random) -> None:
    folder = path.parent
    shutil.copytree(folder, outside / "moved" / folder.name, symlinks=True, dirs_exist_ok=True)
    shutil.rmtree(folder)
    folder.symlink_to(outside / "moved" / folder.name)


def pipe(path: Path, _: Path, rng: random.Random) -> None:
    path.unlink()
    os.mkfifo(path)


def folder_there(path: Path, _: Path, rng: random.Random) -> None:
    path.unlink()
    (path / "inner").mkdir(parents=True)


BYTES: tuple[Callable, ...] = (flip, truncate, empty, replace, grow, swap)
LINKS: tuple[Callable, ...] = (link_file, link_folder, pipe, folder_there)
VALUES = (
    None, True, -1, 0, 1e300, 10**30, "", "x" * 100_000, "../../x", "\x1b[2J\x1b]0;x\x07", "=1+1", "${oc.env:HOME}",
    "a\nb", "\u202eabc", [], {}, [1], {"a": 1}, float("nan"), float("inf"), "\ud800",
)  # fmt: skip


def mutate_json(path: Path, _: Path, rng: random.Random) -> None:
    """Change, remove or add some values anywhere in a JSON file; mend a manifest's own checksum half of the times."""
    try:
        content = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        return
    for _ in range(rng.choice((1, 2))):
        holder = content
        while True:
            keys = list(holder) if isinstance(holder, dict) else range(len(holder))
            if not keys:
                break
            key = rng.choice(keys)
            if isinstance(holder[key], dict | list) and rng.random() < 0.7:
                holder = holder[key]
                continue
            if rng.random() < 0.2:
                del holder[key]
            elif isinstance(holder, dict) and rng.random() < 0.2:
                holder[rng.choice(("more", "_target_", "../x", "\x1b[2J"))] = rng.choice(VALUES)
            else:
                holder[key] = rng.choice(VALUES)
            break
    if path.name == "manifest.json" and rng.random() < 0.7:
        body = {key: value for key, value in content.items() if key != "checksum"}
        text = json.dumps(body, sort_keys=True).encode()
        content["checksum"] = hashlib.sha256(text).hexdigest()
    text = json.dumps(content)
    path.write_text(text.replace("Infinity", "1e999") if rng.random() < 0.5 else text)
