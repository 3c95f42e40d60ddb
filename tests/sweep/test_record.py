"""What is remembered of sweeps: names, and the seeds that were ever asked for."""

import pytest

from snowrepro.composition.overrides import override_folder
from snowrepro.sweep import record
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
