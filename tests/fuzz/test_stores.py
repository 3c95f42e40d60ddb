"""Stores that are damaged at random, by seeds: every command goes on with what is whole, and touches nothing else."""

import shutil
from pathlib import Path

import pytest

from snowrepro.store import leftovers, states
from snowrepro.store.run import Run
from snowrepro.sweep import explain, record
from snowrepro.sweep.estimate import measured_in
from tests.fuzz import stores

QUICK, FEW, MANY = range(40), range(100, 101), range(1000, 1200)


def commands(ids, done):
    """What is asked of a damaged store: of all of it, of the runs that were damaged, and of one that is whole."""
    touched = [run_id for run_id in ids if run_id in done]
    return [["status"], ["status", "good"], ["clean"], *(["explain", run_id] for run_id in (ids[0], *touched))]


def judge(used, ids):
    """What is wrong with how commands ended."""
    wrong = [f"{' '.join(each.words)}: {flaw}" for each in used if (flaw := stores.flaw_of(each))]
    by_words = {each.words: each for each in used}
    whole = by_words.get(("explain", ids[0]))
    if whole is None or f"{ids[0]}: done" not in whole.out:
        wrong.append("the run that nobody touched is not done")
    return wrong


def try_damage(surrounded, ids, seed, more=()):
    """Damage a copy of the store and use it; returns what is wrong, with what was damaged."""
    cwd, store = surrounded()
    around = [cwd.parent / "outside", cwd.parent / "home"]
    shutil.rmtree(around[0] / "moved", ignore_errors=True)
    done = stores.damage(store, ids, around[0], seed)
    before = [stores.hash_tree(folder) for folder in around]
    wrong = judge(stores.use([*commands(ids, done), *more], cwd, around[1]), ids)
    if [stores.hash_tree(folder) for folder in around] != before:
        wrong.append("something outside changed")
    return [f"seed {seed}, {done}: {text}" for text in wrong]


def read_everything(runs: list[Run], store: Path) -> dict[str, str]:
    """What the reading functions make of a store: the state of each run by its id, and of each sweep by its name."""
    records, problems = record.read_all(store)
    found = {each.name: "read" for each in records}
    for run in runs:
        found[run.id] = states.standing(run, thorough=True).state
        run.row("key"), run.analysis("key"), run.checkpoint(), run.manifest()
        if found[run.id] == states.DONE:
            run.open().close()
    for kind in leftovers.KINDS:
        leftovers.find(kind, store, {runs[0].id})
    measured_in(store)
    assert all(str(store) in problem for problem in problems)
    return found


def test_damaged_stores_are_read(surrounded, made, monkeypatch):
    """In this process; now and then by the commands that read a whole store."""
    ids, wrong = made[1], []
    cwd, store = surrounded()
    outside = cwd.parent / "outside"
    runs = [explain.run_named(run_id, store) for run_id in ids]
    before = stores.hash_tree(outside)
    for seed in QUICK:
        surrounded()
        done = stores.damage(store, ids, outside, seed)
        try:
            found = read_everything(runs, store)
        except Exception as error:  # noqa: BLE001 - whatever it is, it is a finding
            wrong.append(f"seed {seed}, {done}: {type(error).__name__}: {error}")
            continue
        if found[ids[0]] != states.DONE or "good" not in found:
            wrong.append(f"seed {seed}, {done}: what is whole is not listed: {found}")
        shutil.rmtree(outside / "moved", ignore_errors=True)
        if stores.hash_tree(outside) != before:
            wrong.append(f"seed {seed}, {done}: something outside changed")
    assert wrong == []


@pytest.mark.parametrize("seed", FEW)
def test_damaged_stores_are_used(surrounded, made, seed):
    """Through the command line, by what reads a whole store."""
    assert try_damage(surrounded, made[1], seed) == []


@pytest.mark.nightly
def test_many_damaged_stores(surrounded, made):
    """Through the command line, with the verbs that write as well."""
    ids = made[1]
    more = [
        ["plan", "good"],
        ["diff", ids[0], ids[1]],
        ["classify", ids[0]],
        ["crate", "good", "--out", "out/crate"],
    ]
    drawn = [
        ["report", "good", "reports=out/reports"],
        ["animate", "good", "--out", "out/film.gif", "--width", "160", "--fps", "2"],
    ]
    cleaned = [["clean", "scraps", "failed", "unfinished", "broken", "unused", "launchers", "--yes"]]
    wrong = []
    for seed in MANY:
        wrong += try_damage(surrounded, ids, seed, [*more, *(drawn if seed % 10 == 0 else []), *cleaned])
    assert wrong == []
