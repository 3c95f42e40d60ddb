"""What is remembered of sweeps: names, and the seeds that were ever asked for."""

import re

import pytest

from snowrepro.composition.overrides import override_folder
from snowrepro.errors import ConfigError
from snowrepro.sweep import explain, record
from snowrepro.sweep.plan import make_plan, with_seeds

FIG5 = ["experiment=fig5", "fidelity=preview"]


def ask(store, *overrides, seeds=None):
    """Remember a sweep as ``snowrepro run`` does."""
    words = [*overrides, override_folder("store", str(store))]
    record.write_record(make_plan(with_seeds(words, seeds) if seeds else words, multirun=True))


def test_seeds_once_asked_for_are_found_again(tmp_path):
    """All of them, whatever else the call that asked for them named first; not those of another sweep."""
    ask(tmp_path, *FIG5)
    ask(tmp_path, *reversed(FIG5), seeds=2)
    ask(tmp_path, *FIG5, "seed=7,12")
    ask(tmp_path, *FIG5, "reading.gravity=20", "seed=5")
    ask(tmp_path, "experiment=fig6", "fidelity=preview", seeds=4)
    assert record.add_remembered_seeds(FIG5, tmp_path)[-1] == "seed=0,1,7,12"
    assert record.add_remembered_seeds([*FIG5, "reading.gravity=20"], tmp_path)[-1] == "seed=5"


@pytest.mark.parametrize("overrides", [["experiment=fig5"], [*FIG5, "seed=3"]])
def test_nothing_is_added_where_none_was_asked_for_or_seeds_are_named(tmp_path, overrides):
    """Other overrides are another sweep; seeds that are named win."""
    ask(tmp_path, *FIG5, seeds=2)
    assert record.add_remembered_seeds(overrides, tmp_path) == overrides


def test_a_name_fits_a_folder():
    """Long names end in a digest, so that two that begin alike stay two."""
    one, other = ("fig5" + ",reading.gravity=20" * 40 + end for end in "ab")
    assert record.shorten_name("fig5") == "fig5"
    assert len(record.shorten_name(one)) < 140
    assert record.shorten_name(one) != record.shorten_name(other)


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """A store that remembers sweeps; those of fig5 were asked for at known times."""
    folder = tmp_path_factory.mktemp("store")
    asked = {"09": FIG5, "11": ["experiment=fig5", "seed=0,1"], "10": ["experiment=fig5", "reading.gravity=20"]}
    for overrides in (*asked.values(), ["experiment=grid", "shape=ball", "floor=L"], ["pressure=500,2000"]):
        ask(folder, *overrides)
    for hour, overrides in asked.items():
        path = record.locate_sweep(record.name_sweep(overrides), folder) / record.RECORD
        path.write_text(re.sub(r'("recorded": ")[^"]*', rf"\g<1>2026-01-01T{hour}:00:00+00:00", path.read_text()))
    return folder


@pytest.mark.parametrize(
    ("word", "more", "name"),
    [
        ("fig5", [], "fig5,seed=0,1"),
        ("fig5,fidelity=preview", [], "fig5,fidelity=preview"),
        ("fig5", ["fidelity=preview"], "fig5,fidelity=preview"),
        ("fig5", ["rerun=[code]", "hydra.launcher.workers=2"], "fig5,seed=0,1"),
        ("fig5", ["reading.gravity=30"], None),
        ("grid", [], "grid,floor=L,shape=ball"),
        ("gr", [], "grid,floor=L,shape=ball"),
        ("press", [], "pressure=500,2000"),
        ("pressure=500", [], None),
        ("fig5,fid", [], "fig5,fidelity=preview"),
        ("fig5,fidelity=pre", [], "fig5,fidelity=preview"),
        ("fig5,", [], None),
        ("fig", [], None),
        ("fig6", [], None),
        ("", [], None),
    ],
)
def test_a_name_stands_for_the_newest_sweep_of_its_experiment(store, word, more, name):
    """A whole name first; then the experiment's; then a beginning of one alone.  An override names no sweep."""
    assert record.find_sweep(word, store, more) == name


def test_a_name_with_an_equals_sign_can_be_shortened(tmp_path):
    """Where it could be an override of one key it is a name only for who asks for names."""
    for sintering in ("paper,none", "none"):
        ask(tmp_path, "fidelity=preview", "pressure=500,2000", f"sintering={sintering}")
    begun, whole = (
        "fidelity=preview,pressure=500,2000,sintering=p",
        "fidelity=preview,pressure=500,2000,sintering=paper,none",
    )
    assert record.find_sweep(begun, tmp_path) == whole
    assert record.find_sweep("fidelity=preview,pressure", tmp_path) is None, "it begins two"
    ask(tmp_path, "pressure=7,8", "seed=0,1")
    assert record.find_sweep("pressure=7", tmp_path) is None
    assert record.require_sweep("pressure=7", tmp_path) == "pressure=7,8,seed=0,1"


def test_which_of_several_sweeps_is_taken_is_said(store, caplog):
    """Once, and not where there is but one."""
    record.find_sweep("grid", store)
    assert caplog.messages == []
    assert record.plan_remembered("fig5", store).overrides[:2] == ("experiment=fig5", "seed=0,1")
    assert caplog.messages == ["'fig5' stands for the newest of 3 sweeps: fig5,seed=0,1"]


def test_a_name_that_fits_nothing_is_told_what_is_near(store):
    """The nearest first; of an experiment, the command that makes it."""
    with pytest.raises(ConfigError, match=r"no sweep 'grdi' in the store '.*'; there are: grid,floor=L,shape=ball, "):
        record.require_sweep("grdi", store)
    with pytest.raises(ConfigError, match=r"this makes it: snowrepro run experiment=fig6 reading=si$"):
        record.require_sweep("fig6", store, ["reading=si"])


def test_a_record_that_cannot_be_read_is_no_sweep_of_an_experiment(tmp_path, caplog):
    """The others still are, and it is said that one is left out."""
    ask(tmp_path, *FIG5)
    broken = record.locate_sweep("fig5,seed=7", tmp_path)
    broken.mkdir()
    (broken / record.RECORD).write_text("{")
    assert record.find_sweep("fig5", tmp_path) == "fig5,fidelity=preview"
    assert "a sweep of 'fig5' cannot be read and is left out" in caplog.text and "seed=7" in caplog.text


def test_further_overrides_take_the_places_of_those_of_their_key():
    """So that a sweep is not named by what it is not."""
    merged = record.merge_overrides(["experiment=fig5", "seed=0,1", "pressure=500"], ["seed=3", "floor=L"])
    assert merged == ["experiment=fig5", "seed=3", "pressure=500", "floor=L"]
    twice = ["fidelity=preview", "seed=1", "fidelity=paper"]
    assert record.merge_overrides(twice, ["floor=L"]) == [*twice, "floor=L"]
    assert record.merge_overrides(twice, ["fidelity=fine", "seed=1"]) == ["fidelity=fine", "seed=1"]


def test_a_name_that_is_no_runs_is_told_what_it_may_be(store):
    """A sweep, where a run is wanted; where either would do, the nearest sweeps."""
    with pytest.raises(ConfigError, match=r"no run is; of the sweep 'grid,.*' they are named by: snowrepro status"):
        explain.id_of_run("grid", store)
    with pytest.raises(ConfigError, match=r"'fig6' should name .*; no run is; sweeps are: fig5,.* experiment=fig6$"):
        explain.run_named("fig6", store, or_sweep=True)
