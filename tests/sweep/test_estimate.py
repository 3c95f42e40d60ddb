"""Names and records of sweeps, estimates from what runs took, parts of a job array."""

import os
from pathlib import Path

import pytest

from snowrepro.composition.compose import compose
from snowrepro.composition.overrides import override_folder
from snowrepro.errors import ConfigError
from snowrepro.store import manifest
from snowrepro.store.cost import kind_of
from snowrepro.store.run import Run
from snowrepro.sweep import record
from snowrepro.sweep.batch import ranges
from snowrepro.sweep.estimate import GUESS_COST, GUESS_STARTUP, LAUNCH_SECONDS, estimate
from snowrepro.sweep.explain import explain, run_named
from snowrepro.sweep.plan import make_plan


def finished(run: Run, seconds: float, per_frame: float, megabytes: int = 300, frames: int = 600) -> None:
    """A run that took so long, without its particles."""
    run.folder.mkdir(parents=True)
    took = {"wall_seconds": seconds, "seconds_per_frame": per_frame, "peak_memory_mb": megabytes, "frames": frames}
    manifest.write(run.folder, [], {"run_id": run.id, "kind": vars(kind_of(run.case)), **took})


@pytest.fixture
def of(tmp_path):
    """A run of a store, by its overrides."""
    return lambda *overrides: Run(compose([*overrides, f"store={tmp_path}"]))


def test_without_a_run_it_is_a_guess(of, tmp_path):
    case = of("fidelity=preview").case
    found = estimate([case, case], tmp_path / "nowhere")
    one = GUESS_STARTUP + 600 * kind_of(case).work * GUESS_COST + LAUNCH_SECONDS
    assert found.measured == 0
    assert found.seconds == pytest.approx(2 * one)


def test_a_like_run_tells(of, tmp_path):
    """Another seed takes what this one took: its start, its frames, and the launcher's time."""
    finished(of("fidelity=preview", "pressure=500"), seconds=14.0, per_frame=0.02)
    finished(of("fidelity=preview", "pressure=3000"), seconds=31.0, per_frame=0.05, megabytes=900)
    low = estimate([of("fidelity=preview", "pressure=500", "seed=7").case], tmp_path)
    high = estimate([of("fidelity=preview", "pressure=2500", "seed=7").case], tmp_path)
    assert low.seconds == pytest.approx(14.0 + LAUNCH_SECONDS)
    assert high.seconds == pytest.approx(31.0 + LAUNCH_SECONDS)
    assert (low.measured, high.memory_mb) == (2, 900)


def test_a_run_that_ended_at_rest_tells(of, tmp_path):
    """Another seed will end as early."""
    finished(of("fidelity=preview"), seconds=8.0, per_frame=0.02, frames=300)
    found = estimate([of("fidelity=preview", "seed=7").case], tmp_path)
    assert found.seconds == pytest.approx(8.0 + LAUNCH_SECONDS)


def test_a_finer_run_takes_as_much_more_work(of, tmp_path):
    """Four times the particles, twice the substeps; the start is the same."""
    finished(of("fidelity=preview"), seconds=14.0, per_frame=0.02)
    found = estimate([of("fidelity=paper").case], tmp_path)
    assert found.seconds == pytest.approx(2.0 + 8 * 600 * 0.02 + LAUNCH_SECONDS, rel=1e-3)


def test_what_differs_more_tells_less(of, tmp_path):
    """The nearest in the physics is asked, of equals all."""
    finished(of("fidelity=preview", "sintering=none"), seconds=62.0, per_frame=0.1)
    finished(of("fidelity=preview", "pressure=1000"), seconds=32.0, per_frame=0.05)
    for seed, seconds in ((0, 14.0), (1, 20.0), (2, 26.0)):
        finished(of("fidelity=preview", "floor=zigzag", f"seed={seed}"), seconds, per_frame=(seconds - 2.0) / 600)
    found = estimate([of("fidelity=preview").case], tmp_path)
    assert found.seconds == pytest.approx(20.0 + LAUNCH_SECONDS)


def test_runs_of_this_processor_count_first(of, tmp_path, monkeypatch):
    monkeypatch.setattr(manifest, "environment", lambda: {"processor": "another"})
    finished(of("fidelity=preview"), seconds=602.0, per_frame=1.0)
    case = of("fidelity=preview", "seed=1").case
    assert estimate([case], tmp_path).seconds == pytest.approx(602.0 + LAUNCH_SECONDS)
    monkeypatch.undo()
    finished(of("fidelity=preview", "floor=zigzag"), seconds=14.0, per_frame=0.02)
    assert estimate([case], tmp_path).seconds == pytest.approx(14.0 + LAUNCH_SECONDS)


@pytest.mark.parametrize(
    ("overrides", "name"),
    [
        (["experiment=fig5"], "fig5"),
        (["fidelity=preview", "experiment=fig5"], "fig5,fidelity=preview"),
        (["experiment=fig5", "fidelity=preview", "store=/x/y", "reports=z", "threads=1"], "fig5,fidelity=preview"),
        (["experiment=grid", "hydra/launcher=ray", "hydra.launcher.workers=4", "rerun=[code]"], "grid"),
        (["pressure=1,2", "+solver.flip=0.5", "seed=range(0,3)"], "+solver.flip=0.5,pressure=1,2,seed=range_0,3_"),
        (["floor.outline.file=a b/c.svg"], "floor.outline.file=a_b_c.svg"),
        ([], "default"),
    ],
)
def test_a_sweep_has_a_name_that_a_folder_can_have(overrides, name):
    """What changes no result does not enter, nor does the order."""
    assert record.name_sweep(overrides) == name
    assert record.name_sweep(overrides[::-1]) == name


def test_long_names_are_cut_and_told_apart():
    names = {record.name_sweep([f"pressure={','.join(map(str, range(first, 200)))}"]) for first in (0, 100)}
    assert len(names) == 2
    assert all(len(name) < 140 for name in names)


def test_a_sweep_is_remembered(tmp_path):
    """By what asked for it; a second one of the name takes its place; an unknown name tells the known."""
    overrides = ["experiment=fig5", "fidelity=preview", f"store={tmp_path}"]
    plan = make_plan(overrides, True)
    assert record.write_record(plan) == tmp_path / "sweeps" / "fig5,fidelity=preview"
    found = record.read_record("fig5,fidelity=preview", tmp_path)
    assert found.overrides == ("experiment=fig5", "fidelity=preview")
    assert list(found.cells.values()) == [run.id for run in plan.runs]
    again = make_plan([*found.overrides, f"store={tmp_path}"], True)
    assert [run.config for run in again.runs] == [run.config for run in plan.runs]
    with pytest.raises(ConfigError, match=r"no sweep 'fig6' in the store .*; there are: fig5,fidelity=preview"):
        record.read_record("fig6", tmp_path)
    with pytest.raises(ConfigError, match="there are: none yet"):
        record.read_record("fig6", Path(os.devnull))


@pytest.mark.parametrize(
    ("numbers", "text"), [([1], "1"), ([1, 2, 3], "1-3"), ([1, 3, 4, 9], "1,3-4,9"), (list(range(5, 1000)), "5-999")]
)
def test_numbers_as_slurm_writes_them(numbers, text):
    assert ranges(numbers) == text


def test_a_run_that_was_only_asked_for_is_known(tmp_path):
    """By an end of its id, in a store whose path and a sweep whose overrides have blanks and quotes."""
    store = tmp_path / "it's a store"
    plan = make_plan(["pressure=1,2", "reading.plastic_volume=[0.1, 10.0]", override_folder("store", str(store))], True)
    record.write_record(plan)
    wanted = plan.runs[1]
    assert run_named(wanted.id[-10:], store).config == wanted.config
    lines = explain(wanted.id, store)
    assert lines[:2] == [f"{wanted.id}: pending", "  never run"]
