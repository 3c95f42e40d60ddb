"""``snowrepro search``: rounds over the store, with runs that stand for real ones."""

import pytest

from snowrepro.cli import searching
from snowrepro.cli.main import main
from snowrepro.store.run import Run
from snowrepro.sweep import record
from snowrepro.sweep.plan import Plan

HALVES = {"L": 740.0, "square": 1500.0}  # pressures at which the stand-ins have half their mass in lumps


class Store:
    """Stands for runs: each is done once, and its mass in lumps follows from floor, pressure and seed."""

    def __init__(self) -> None:
        self.done: set[str] = set()
        self.rounds: list[list[str]] = []
        self.most_rounds = 100

    def run_missing(self, plan: Plan, is_whole: bool = True) -> None:
        if len(self.rounds) >= self.most_rounds:
            raise KeyboardInterrupt
        new = [run.id for run in plan.runs if run.id not in self.done]
        self.rounds.append(new)
        self.done |= set(new)

    def read_row(self, run: Run) -> dict[str, float]:
        half = HALVES[run.case.floor.name] * (1 + 0.1 * (run.case.seed - 1))
        return {"lump_fraction": 1 / (1 + (half / run.case.pressure) ** 4)}


@pytest.fixture
def store(monkeypatch) -> Store:
    stand_in = Store()
    monkeypatch.setattr(searching, "run_missing", stand_in.run_missing)
    monkeypatch.setattr(searching, "read_row", stand_in.read_row)
    monkeypatch.setattr(searching, "write_table", lambda plan: None)
    monkeypatch.setattr(Run, "is_done", lambda run: run.id in stand_in.done)
    return stand_in


def search(folder, *words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["search", "pressure=log(200,6000)", f"store={folder}", *words])
    return ended.value.code


def test_each_scene_has_its_search(store, tmp_path, capsys):
    """All of a round together, all seeds averaged; in the end each is a sweep that the store remembers."""
    assert search(tmp_path, "floor=L,square", "seeds=3", "--within", "0.3") == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(store.rounds[0]) == 2 * 2 * 3, "both ends, both floors, three seeds"
    answers = [line for line in lines if " of pressure, by a straight line at " in line]
    for line, half in zip(answers, HALVES.values(), strict=True):
        found = float(line.partition(" by a straight line at ")[2].partition(";")[0])
        assert found == pytest.approx(half, rel=0.1), line
        assert int(line.partition("; ")[2].partition(" values")[0]) <= 10
    names = [line.removeprefix("sweep: ") for line in lines if line.startswith("sweep: ")]
    assert sorted(names) == sorted(record.list_sweeps(tmp_path))
    planned = record.plan_remembered(names[0], tmp_path)
    assert {run.id for run in planned.runs} <= store.done and len(planned.runs) % 3 == 0


def test_a_search_that_was_stopped_takes_the_same_path(store, tmp_path, capsys):
    """Called again no run is done twice, and the end is the same."""
    assert search(tmp_path, "--points", "5") == 0
    whole, said = [*store.rounds], capsys.readouterr().out
    store.done.clear()
    store.rounds.clear()
    store.most_rounds = 2
    assert search(tmp_path, "--points", "5") == 130
    assert store.rounds == whole[:2] and len(whole) == 4
    store.most_rounds = 100
    assert search(tmp_path, "--points", "5") == 0 and store.rounds == whole
    assert capsys.readouterr().out == said


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["reading.gravity=log(1,2)"], "a search goes along one range, as in 'pressure=log(200,6000)' (got pressure"),
        (["--measure", "floor"], "measure: 'floor' is no column of numbers"),
        (["--measure", "lumps_fraction"], "is no column of numbers; did you mean 'lump_fraction'?"),
        (["--target", "half"], "target: should be a number, most or least (got half)"),
        (["--target", "nan"], "target: should be a number, most or least (got nan)"),
        (["pressure=300"], "a search goes along 'pressure', so leave out 'pressure=300'"),
    ],
)
def test_what_is_wrong_is_said(store, tmp_path, capsys, words, message):
    assert search(tmp_path, *words) == 2
    assert message in capsys.readouterr().err and store.rounds == []
