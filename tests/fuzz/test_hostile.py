"""A store that somebody made to do harm, given to every verb: nothing outside changes, nothing hangs, no traceback."""

import hashlib
import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from snowrepro.store.files import write_json
from tests.fuzz import stores

ESCAPE = "\x1b]0;owned\x07\x1b[2J\u202e"
NOW = "2026-01-01T00:00:00+00:00"
VERBS = ("status", "plan", "explain", "retry", "report", "crate", "diff", "animate", "classify", "redo", "run", "clean")
WRITING = ("status", "retry", "report", "redo", "clean")  # and the one that reads all
SOME = ["callback", "reports", "name", "cells", "pipe"]


def write_record(store: Path, name: str, overrides: list[str], **changes) -> None:
    """A sweep's record that says whatever it likes."""
    content = {"name": name, "overrides": overrides, "recorded": NOW, "cells": {"": "ball-L-1"}, **changes}
    write_json(store / "sweeps" / name / "sweep.json", content)


def forge(folder: Path, **changes) -> None:
    """Change what a manifest says, with the checksum of what it then says."""
    content = {**json.loads((folder / "manifest.json").read_text()), **changes}
    body = {key: value for key, value in content.items() if key != "checksum"}
    digest = hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()
    (folder / "manifest.json").write_text(json.dumps({**body, "checksum": digest}))


def write_hostile_records(store: Path, outside: Path) -> list[str]:
    """Records that would run code, or write, read or reach elsewhere; returns their names."""
    touch = f"{{_target_: pathlib.Path.touch, self: {outside}/ran}}"
    records = {
        "callback": [f"+hydra.callbacks.x={touch}"],
        "callback2": [
            "experiment=fig5",
            f"++hydra.callbacks.x={{_target_: os.system, command: 'touch {outside}/ran'}}",
        ],
        "launcher": ["pressure=1,2", "hydra.launcher._target_=builtins.exec"],
        "launcher2": ["pressure=1,2", "hydra.launcher.setup=[touch x]", "hydra/launcher=slurm"],
        "searchpath": [f"hydra.searchpath=[file://{outside}]", "shape=evil"],
        "rundir": ["pressure=1,2", f"hydra.sweep.dir={outside}/dir"],
        "reports": ["experiment=fig2", f"reports={outside}/reports"],
        "reports2": ["experiment=fig2", f"++reports={outside}/reports"],
        "store": ["pressure=1,2", f"+store={outside}/store"],
        "resolver": ["pressure=1,2", "experiment.title=${oc.env:HOME}"],
        "name": ["shape.name=../../outside/x", "pressure=1,2"],
        "experiment": ["experiment=../../../outside/evil"],
        "figure": ["experiment=fig2", "experiment.name=.."],
        "drawing": ["shape.outline={kind: image, file: /dev/zero, width: 3}"],
        "package": ["shape@hydra.callbacks=ball"],
        "deep": ["pressure=" + "[" * 3000],
        "escape": ["pressure=1,2", f"shape.name={ESCAPE}"],
    }
    for name, overrides in records.items():
        write_record(store, name, overrides)
    write_record(store, "cells", ["pressure=1,2"], cells={"pressure=1": "../../outside/copy", "pressure=2": "good"})
    write_record(store, "types", [1, None], cells=[])
    write_record(store, "large", ["pressure=1"])
    os.truncate(store / "sweeps" / "large" / "sweep.json", 5 << 30)
    (store / "sweeps" / "pipe").mkdir()
    os.mkfifo(store / "sweeps" / "pipe" / "sweep.json")
    (store / "sweeps" / "linked").symlink_to(outside / "copy")
    (store / "sweeps" / f"x{ESCAPE}").mkdir()
    (store / "sweeps" / f"x{ESCAPE}" / "sweep.json").write_text("{}")
    return [*records, "cells", "types", "large", "pipe"]


def write_hostile_runs(store: Path, ids: list[str], outside: Path) -> None:
    """Finished and unfinished runs, all but the first two of the finished ones made odd; and folders of no run."""
    third, fourth, failed, interrupted, left = ids[2], ids[3], *ids[4:]
    forge(store / third, run_id=fourth, files=[], created=ESCAPE)
    shutil.rmtree(store / fourth)
    shutil.copytree(store / ids[0], store / fourth)
    forge(store / fourth, run_id=fourth, machine=ESCAPE)
    (store / ".work" / failed / "outcome.json").write_text('{"message": "no state"}')
    outcome = {"state": "interrupted", "message": f"=cmd|{ESCAPE}\n<script>alert(1)</script>", "final": False}
    write_json(store / ".work" / interrupted / "outcome.json", outcome)
    np.savez(store / ".work" / interrupted / "checkpoint.npz", frame=np.array(3), evil=np.zeros(3))
    (store / ".work" / interrupted / "run.log").unlink()
    (store / ".work" / interrupted / "run.log").symlink_to(outside / "precious.txt")
    lease = json.loads((store / ".work" / left / "lease.3").read_text())
    write_json(store / ".work" / left / "lease.4", {**lease, "more": 1, "host": ESCAPE})
    os.mkfifo(store / ".work" / left / "lease.5")
    (store / ".work" / left / "result.x").symlink_to(outside / "copy")
    (store / ".work" / "linked").symlink_to(outside / "copy")
    (store / ".trash").symlink_to(outside / "trash")
    (store / "linked").symlink_to(outside / "copy")
    (store / "half.part").symlink_to(outside / "precious.txt")
    (store / ids[1] / "summary.json").unlink()
    (store / ids[1] / "summary.json").symlink_to(outside / "precious.txt")
    (store / f"evil{ESCAPE}").mkdir()
    (store / f"evil{ESCAPE}" / "run.nc").symlink_to("/dev/zero")
    (store / "nested").mkdir()
    (store / "nested" / "manifest.json").write_bytes(b'{"a":' * 100_000)
    os.mkfifo(store / "nested" / "run.nc")


@pytest.fixture
def hostile(surrounded, made):
    """The folder to be in, its store, the ids of the runs, and the names of hostile sweeps."""
    cwd, store = surrounded()
    outside = cwd.parent / "outside"
    for name in ("copy", "trash", "reports"):
        (outside / name).mkdir(exist_ok=True)
        (outside / name / "kept.txt").write_text("kept\n")
    (outside / "evil.yaml").write_text("# @package _global_\nexperiment: {name: evil, title: evil, picture: shapes}\n")
    shutil.copy2(store / made[1][0] / "run.nc", outside / "copy" / "run.nc")
    shutil.copy2(store / made[1][0] / "manifest.json", outside / "copy" / "manifest.json")
    names = write_hostile_records(store, outside)
    write_hostile_runs(store, made[1], outside)
    return cwd, store, made[1], names


def list_commands(verb: str, ids: list[str], names: list[str], is_whole: bool) -> list[list[str]]:
    """What a user may ask of a store with a verb; ``is_whole``: also what takes longer."""
    first, second, third, fourth, failed = ids[:5]
    each = [*names, "good"]
    return {
        "status": [["status"], *(["status", name] for name in each), ["status", "good", "--list", "--verify"]],
        "plan": [["plan", name] for name in each],
        "explain": [["explain", name] for name in (*ids, "linked", "nested", "evil", "ball")],
        "retry": [["retry", name] for name in (*names, third, "linked", "nested")],
        "report": [
            *(["report", name] for name in names),
            ["report", "good", "--against", "callback", "reports=out/reports"],
            *([["report", "good", "reports=out/reports"]] if is_whole else []),
        ],
        "crate": [*(["crate", name, "--out", f"out/{name}"] for name in (*each, first, third, "linked", "nested"))],
        "diff": [["diff", first, name] for name in (second, third, fourth, "linked", "nested")]
        + [["diff", "good", name] for name in ("callback", "cells", "large")],
        "animate": [
            ["animate", name, "--out", "out/x.gif", "--width", "160"] for name in (*names, third, "linked", failed)
        ],
        "classify": [["classify", name] for name in (first, third, fourth, "linked", "nested", "runs/nested")],
        "redo": [["redo", name, "--into", "out/redone"] for name in (third, fourth, "linked", "nested", failed)],
        "run": [["run", "-m", *names], ["run", "shape.name=../../x"], ["run", "shape=../../x"]],
        "clean": [["clean"], ["clean", "scraps", "failed", "unfinished", "broken", "unused", "launchers", "--yes"]],
    }[verb]


@pytest.mark.parametrize("verb", WRITING)
def test_a_hostile_store_does_no_harm(hostile, verb):
    """The surroundings are as they were, to the byte; every command ends in time, with an exit code and one line."""
    give_to(verb, *hostile[:3], SOME, is_whole=False)


@pytest.mark.nightly
@pytest.mark.parametrize("verb", VERBS)
def test_every_hostile_record_does_no_harm(hostile, verb):
    """The same for all of them, and with a whole report."""
    give_to(verb, *hostile, is_whole=True)


def give_to(verb: str, cwd: Path, store: Path, ids: list[str], names: list[str], is_whole: bool) -> None:
    """Give a hostile store to a verb, and check what became of it and of its surroundings."""
    around = [cwd.parent / "outside", cwd.parent / "home"]
    before = [stores.hash_tree(folder) for folder in around], sorted(path.name for path in cwd.iterdir())
    commands = list_commands(verb, ids, names, is_whole)
    used = stores.use(commands, cwd, around[1])
    assert len(used) == len(commands)
    assert [(each.words, flaw) for each in used if (flaw := stores.flaw_of(each))] == []
    assert [stores.hash_tree(folder) for folder in around] == before[0]
    assert sorted(path.name for path in cwd.iterdir()) == before[1]
    by_words = {each.words: each for each in used}
    refused = [each for each in used if each.words[-1] in names and verb in ("plan", "retry", "report")]
    assert [each.words for each in refused if each.code == 0] == []
    assert all(each.errors.count("\n") == 1 for each in refused)
    if verb == "status":
        assert "good: " in by_words["status",].out and by_words["status",].code == 0
        assert "is not used: the override" in by_words["status",].out
    if verb == "explain":
        assert by_words["explain", ids[0]].out.startswith(f"{ids[0]}: done\n")
        for broken in (ids[2], ids[3], ids[4], "nested"):
            assert ": broken\n" in by_words["explain", broken].out, broken
    if verb == "clean":
        assert (store / ids[0] / "run.nc").is_file() and (store / ".trash").is_symlink()
        assert "left alone: runs/.trash is a link" in used[0].errors


@pytest.mark.parametrize(
    "own",
    [".work", ".trash", *(pytest.param(own, marks=pytest.mark.nightly) for own in ("sweeps", ".sweep", "sweep.log"))],
)
def test_a_stores_own_folders_are_no_links(surrounded, made, own):
    """Whatever would write through one is refused, by the name of the link; what only reads goes on."""
    cwd, store = surrounded()
    outside = cwd.parent / "outside"
    target = outside / own.strip(".")
    shutil.rmtree(store / own, ignore_errors=True)
    target.touch() if own == "sweep.log" else target.mkdir()
    (store / own).symlink_to(target)
    before = stores.hash_tree(outside)
    kinds = ["scraps", "failed", "unfinished", "broken", "launchers"]
    used = stores.use(
        [["run", *stores.SMALL, "seed=77"], ["run", "-m", *stores.SMALL, "seed=77,78"], ["explain", made[1][0]],
         ["clean", *kinds, "--yes"], ["status"]], cwd, cwd.parent / "home",
    )  # fmt: skip
    assert [flaw for each in used if (flaw := stores.flaw_of(each))] == []
    assert stores.hash_tree(outside) == before
    for each in used[:2]:
        assert each.code == 2 and f"{own} is a link" in each.errors
    assert f"{made[1][0]}: done" in used[2].out
