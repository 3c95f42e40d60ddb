"""Sweeps on the command line: what one of the user's own says at its end, and what is remembered of one refused."""

import re
import shlex

import pytest

from snowrepro.cli import folders, sweeping
from snowrepro.cli.main import read_command_line
from snowrepro.cli.plans import plan_sweep
from snowrepro.cli.sweeping import describe_sweep
from snowrepro.composition.overrides import override_folder
from snowrepro.errors import ConfigError
from snowrepro.sweep import record
from snowrepro.sweep.plan import make_plan


@pytest.mark.parametrize(
    ("overrides", "drawn"),
    [
        (
            ["pressure=500,900", "sintering=paper,none", "seed=0,1"],
            ["x=pressure", "y=lump_fraction", "colour=sintering"],
        ),
        (
            ["sintering=paper,none", "reading.gravity=10,20"],
            ["x=reading_gravity", "y=lump_fraction", "colour=sintering"],
        ),
        (["shape=ball,star", "seed=0,1"], ["x=shape", "y=lump_fraction"]),
        (["seed=0,1"], ["x=seed", "y=lump_fraction"]),
        (["seed=0"], ["x=pressure", "y=lump_fraction"]),
        (["pressure=500,900", "indenter=disc"], ["x=pressure", "y=hardness"]),
    ],
)
def test_the_next_command_draws_what_varies(overrides, drawn):
    """A number along x, what else varies in colours, seeds as points."""
    last = describe_sweep(make_plan(overrides, multirun=True))[-1]
    assert shlex.split(last)[4:] == drawn


def test_commands_hold_whatever_a_name_has(tmp_path):
    """A store elsewhere is named too; the table only if it is there."""
    store = override_folder("store", str(tmp_path / "it's here"))
    lines = describe_sweep(make_plan(["pressure=range(500,700,100)", store], multirun=True))
    name = "pressure=range_500,700,100_"
    assert lines[0] == f"sweep: {name}"
    assert [shlex.split(line)[1:4] + shlex.split(line)[-1:] for line in lines[1:]] == [
        ["snowrepro", verb, name, store] for verb in ("report", "plot")
    ]


def test_a_refused_sweep_is_not_remembered(tmp_path, monkeypatch):
    """Unless it was before; what else is remembered stays."""

    def refuse(*_):
        raise ConfigError("this launcher is not installed")

    monkeypatch.setattr(sweeping, "launch", refuse)
    store = override_folder("store", str(tmp_path))
    known, new = (make_plan([f"pressure={values}", store], multirun=True) for values in ("1,2", "3,4"))
    record.write_record(known)
    for plan in (known, new):
        with pytest.raises(ConfigError, match="not installed"):
            sweeping.run_missing(plan)
    assert record.list_sweeps(tmp_path) == ["pressure=1,2"]
    assert [path.name for path in (tmp_path / "sweeps").iterdir()] == ["pressure=1,2"]


def test_no_script_is_written_for_what_cannot_be_run(snowrepro, tmp_path):
    """The floor is wider than its domain: plan says so, writes nothing, and remembers nothing."""
    done = snowrepro("plan", "-m", "pressure=500,600", "floor.width=12", "--sbatch", "job.sh")
    assert done.returncode == 2
    assert "error: floor 'L' lies outside its domain" in done.stderr
    assert not list(tmp_path.glob("**/sweep.json")) and not (tmp_path / "job.sh").exists()


def test_a_named_sweep_takes_other_seeds(tmp_path):
    """In place of those that it is remembered with."""
    store = override_folder("store", str(tmp_path))
    record.write_record(make_plan(["experiment=fig5", "pressure=500", "seed=0,1", store], multirun=True))
    plan = plan_sweep(["fig5,pressure=500,seed=0,1", "seeds=3", store], multirun=False)
    assert sorted({run.case.seed for run in plan.runs}) == [0, 1, 2]
    assert record.name_sweep(plan.overrides) == "fig5,pressure=500,seed=0,1,2"
    assert len(plan_sweep(["fig5", store], multirun=False).runs) == 4


def call(*words: str) -> None:
    """Do what a verb does, in this process."""
    options, named = read_command_line(words)
    folders.settle_folders(options, named)
    options.execute(options)


@pytest.fixture
def remembered(tmp_path, monkeypatch) -> str:
    """The name of the one sweep that a store remembers, in the working folder."""
    monkeypatch.chdir(tmp_path)
    return record.write_record(make_plan(["pressure=500,900", "sintering=paper,none"], multirun=True)).name


@pytest.mark.parametrize("words", [["pressure=500,900"], ["-m", "pressure=500,900"], ["pressure=500,900,sintering=p"]])
def test_status_needs_no_word_for_several_runs(remembered, capsys, words):
    """It counts what the same words would run, or what the name begins."""
    call("status", *words)
    first, *_ = capsys.readouterr().out.splitlines()
    assert re.fullmatch(r"pressure=500,900(: 2|,sintering=paper,none: 4) pending", first)


def test_a_list_of_all_runs_is_one_of_a_sweep(remembered):
    """Not silently a line for each sweep."""
    with pytest.raises(ConfigError, match="--list: name a sweep, as in 'snowrepro status grid --list'"):
        call("status", "--list")


@pytest.mark.parametrize(
    ("verb", "message"),
    [
        ("run", "pressure=1,2 names several runs: add -m, which makes them a sweep"),
        ("plan", "pressure=1,2 names several runs: add -m, which makes them a sweep"),
        ("config", "pressure=1,2 names several runs, and this prints the settings of one: name one value"),
        ("report", "there is no sweep 'pressure=1,2' .*; this makes it: snowrepro run -m pressure=1,2"),
    ],
)
def test_each_verb_says_what_to_do_with_several_runs(remembered, verb, message):
    """What is true of it."""
    with pytest.raises(ConfigError, match=message):
        call(verb, "pressure=1,2")


@pytest.mark.parametrize(
    "words", [["sintering=paper,none", "pressure=500,900"], ["pressure=500,900,sintering=p"], ["pressure=500,900",
              "sintering=paper,none", "seeds=2"]],
)  # fmt: skip
def test_a_report_finds_a_sweep_by_its_words(remembered, monkeypatch, words):
    """In any order, by the beginning of its name, and with other seeds."""
    asked: list[list[str]] = []
    monkeypatch.setattr("snowrepro.cli.reporting.print_report", lambda overrides, store: asked.append(overrides))
    call("report", *words)
    (overrides,) = asked
    assert record.name_without_seeds(overrides) == remembered
    assert ("seed=0,1" in overrides) == ("seeds=2" in words)


def test_a_report_without_a_sweep_is_on_the_paper(remembered, monkeypatch):
    """Where the words are those of no sweep, and name one value each."""
    asked: list[list[str]] = []
    monkeypatch.setattr("snowrepro.cli.reporting.print_paper_report", lambda overrides, store: asked.append(overrides))
    call("report", "fidelity=preview")
    call("report")
    assert asked == [["fidelity=preview", "store='runs'"], ["store='runs'"]]
