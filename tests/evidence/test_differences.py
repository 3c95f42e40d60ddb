"""What differs between two runs and between two sweeps."""

import shutil

import numpy as np
import pytest

from snowrepro.composition.compose import compose
from snowrepro.errors import ConfigError, StoreError
from snowrepro.evidence.collect import collect_sweep
from snowrepro.evidence.differences import (
    ArrayChange,
    compare_runs,
    compare_sweeps,
    describe_differences,
    describe_sweep_differences,
)
from snowrepro.store import manifest
from snowrepro.store.run import Run
from snowrepro.summary import row as summary
from snowrepro.sweep import record
from snowrepro.sweep.plan import make_plan
from tests.configs import carrying
from tests.conftest import SMALL


@pytest.fixture
def save(small_run, small_config, tmp_path):
    """Save the small run, or another dataset, in a store of its own; returns its folder."""

    def saved(name, dataset=small_run, *changes, seconds=1.0):
        run = Run(compose([*SMALL, "pressure=3000", *changes, f"store={tmp_path / name}"]))
        return run.save(carrying(dataset, run.config), wall_seconds=seconds).parent

    return saved


def test_the_same_run_twice(save):
    """Another store, wall time and moment are no difference."""
    lines = describe_differences(str(save("a")), str(save("b", seconds=2.0)))
    same = ["the same configuration", "the same code and environment", "the same summary", "the same bits"]
    assert lines[2:] == same


def test_one_setting(save, small_run):
    """It is named, and so is each number that differs, by how much."""
    other = small_run.copy(deep=True)
    other["substeps"][3] += 5
    found = compare_runs(save("a"), save("b", other, "reading.gravity=20").joinpath("run.nc"))
    assert found.config == ["reading.gravity 40 -> 20"]
    (change,) = found.numbers
    substeps = int(small_run["substeps"].sum())
    assert (change.name, change.a, change.b, change.difference) == ("substeps", substeps, substeps + 5, 5.0)
    assert found.arrays == [ArrayChange("substeps", largest=5.0, frame=3)]


def test_lines_say_what_differs(save, small_run, tmp_path):
    """By id in a store, as a user asks."""
    other = small_run.copy(deep=True)
    other["substeps"][3] += 5
    first, second = save("s"), save("s", other, "reading.gravity=20")
    substeps = int(small_run["substeps"].sum())
    assert describe_differences(first.name, second.name, tmp_path / "s") == [
        f"a: {first.name}",
        f"b: {second.name}",
        "configuration:",
        "  reading.gravity: 40 -> 20",
        "the same code and environment",
        "summary:",
        f"  substeps: {substeps} -> {substeps + 5} (+5)",
        "arrays:",
        "  substeps: by at most 5, first in frame 3",
    ]


def test_bits_alone(save, small_run):
    """The sign of a zero, the last bit of a coordinate, a NaN: each array with its first frame."""
    a, b = small_run.copy(deep=True), small_run.copy(deep=True)
    a["damping_work"][7], b["damping_work"][7] = 0.0, -0.0
    places = b["position"].values
    places[5, 10, 1] = np.nextafter(places[5, 10, 1], np.float32(np.inf))
    b["top_speed"][9] = np.nan
    b["volume"][4] += 0.5
    found = compare_runs(save("a", a), save("b", b))
    assert found.config == [] and found.made == []
    changes = {change.name: change for change in found.arrays}
    assert set(changes) == {"damping_work", "position", "top_speed", "volume"}
    assert changes["damping_work"] == ArrayChange("damping_work", largest=0.0, frame=7)
    assert changes["position"].frame == int(small_run["snapshot"][5])
    assert 0 < changes["position"].largest < 1e-4
    assert changes["top_speed"] == ArrayChange("top_speed", largest=np.inf, frame=9)
    assert changes["volume"].frame is None and changes["volume"].largest == pytest.approx(0.5)


def test_arrays_of_other_forms(save, small_run):
    """What cannot be set side by side is said to be so."""
    other = small_run.drop_vars("density").isel(particle=slice(0, -1))
    other["top_speed"] = other["top_speed"].astype(np.float32)
    forms = {change.name: change.form for change in compare_runs(save("a"), save("b", other)).arrays}
    assert forms["density"] == "in a only"
    assert forms["mass"] == "float64 (2038,) in a, float64 (2037,) in b"
    assert forms["top_speed"] == "float64 (61,) in a, float32 (61,) in b"
    assert "substeps" not in forms


def test_code_and_environment(save, monkeypatch, tmp_path):
    """By the manifests; without one it cannot be told."""
    first = save("a")
    monkeypatch.setitem(manifest.CODE, "units.py", "changed")
    monkeypatch.setattr(manifest, "environment", lambda: {**manifest.read(first)["environment"], "numpy": "0.1"})
    second = save("b")
    kept = manifest.read(first)
    assert compare_runs(first, second).made == [
        f"code.units.py {kept['code']['units.py']} -> changed",
        f"environment.numpy {kept['environment']['numpy']} -> 0.1",
    ]
    bare = shutil.copy(second / "run.nc", tmp_path / "bare.nc")
    assert compare_runs(first, bare).made is None
    assert "  not known, as a manifest is missing" in describe_differences(str(first), str(bare))


def test_what_is_no_run_is_refused(save, small_run, tmp_path):
    first = save("a")
    with pytest.raises(StoreError, match="there is no run 'nothing'"):
        compare_runs(first, "nothing", tmp_path)
    with pytest.raises(StoreError, match=r"there is no run 'nothing': .*; sweeps are: none yet"):
        describe_differences(str(first), "nothing", tmp_path)
    small_run.drop_attrs().to_netcdf(tmp_path / "other.nc")
    with pytest.raises(ConfigError, match=r"other.nc' is no run of snowrepro"):
        compare_runs(first, tmp_path / "other.nc")


@pytest.fixture
def sweep(small_run, tmp_path):
    """Record a sweep whose runs have the numbers given, as many as there are; returns the plan."""

    def recorded(overrides, *rows):
        plan = make_plan([*SMALL, *overrides, f"store={tmp_path}"], multirun=True)
        record.write_record(plan)
        for run, row in zip(plan.runs, rows, strict=False):
            if row is not None:
                run.save(small_run)
                run.save_row(summary.make_key(run.config.question.analysis), row)
        return plan

    return recorded


def lumps(*values):
    return [None if value is None else {"lump_fraction": value} for value in values]


def test_sweeps_are_matched_by_their_cells(sweep, tmp_path):
    """Pressures that one sweep has alone, runs without a result, and another fidelity throughout."""
    a = sweep(["pressure=300,500,700,900"], *lumps(0.2, 0.5, None, 0.1))
    b = sweep(["pressure=1100,300,500,700,800", "fidelity=paper"], *lumps(0.9, 0.2, 0.75, 0.3, None))
    found = compare_sweeps(collect_sweep(a), collect_sweep(b))
    assert found.config[0] == "fidelity.name preview -> paper"
    assert all(change.startswith("fidelity.") for change in found.config)
    assert found.cells.set_index("pressure")["difference"].to_dict() == {300: 0.0, 500: 0.25}
    assert found.cells["measure"].tolist() == ["lump_fraction"] * 2
    assert found.lacking[["pressure", "state_a", "state_b"]].to_numpy().tolist() == [[700.0, "pending", "done"]]
    assert found.only_a["pressure"].tolist() == [900]
    assert sorted(found.only_b["pressure"]) == [800, 1100]
    lines = describe_differences(*(record.name_sweep(plan.overrides) for plan in (a, b)), tmp_path)
    assert lines == describe_sweep_differences(found)
    rest = "shape ball, floor L, sintering paper, seed 0"
    assert f"lump_fraction: 2 cells, 1 the same, median change +0.125, largest +0.25 at pressure 500, {rest}" in lines
    assert f"  pressure 500, {rest}: lump_fraction 0.5 -> 0.75 (+0.25)" in lines
    assert f"  pressure 700, {rest}: pending in a, done in b" in lines
    assert lines[lines.index("cells in a only:") + 1] == f"  pressure 900, {rest}"


def test_the_largest_change_comes_first(sweep, monkeypatch):
    """Also a fall; and long lists are cut."""
    a = sweep(["pressure=300,500,700"], *lumps(0.5, 0.5, 0.5))
    b = sweep(["pressure=300,500,700", "solver.cfl=0.25"], *lumps(0.6, 0.1, 0.7))
    monkeypatch.setattr("snowrepro.evidence.differences.MOST_LINES", 2)
    lines = describe_sweep_differences(compare_sweeps(collect_sweep(a), collect_sweep(b)))
    start = lines.index("cells that changed, largest first:")
    assert [line.split()[1] for line in lines[start + 1 : start + 3]] == ["500,", "700,"]
    assert lines[start + 3] == "  ... and 1 more"


def test_a_coordinate_that_differs_throughout_matches_nothing(sweep):
    """Two pressures with one value each: cells are matched by the rest, and the pressure is the difference."""
    a = sweep(["sintering=paper,none", "pressure=300"], *lumps(0.5, 0.1))
    b = sweep(["sintering=paper,none", "pressure=310"], *lumps(0.6, 0.1))
    found = compare_sweeps(collect_sweep(a), collect_sweep(b))
    assert found.config == ["pressure 300 -> 310"]
    assert found.cells.set_index("sintering")["difference"].round(9).to_dict() == {"paper": 0.1, "none": 0.0}
    assert found.only_a.empty and found.only_b.empty


def test_without_a_cell_in_common_the_first_runs_say_what_differs(sweep, tmp_path):
    """Other scenes at other pressures are not the same configuration."""
    a = sweep(["pressure=300,500", "material.E=200000"], *lumps(0.5, 0.1))
    b = sweep(["pressure=310,510", "shape=star"], *lumps(0.6, 0.1))
    lines = describe_differences(*(record.name_sweep(plan.overrides) for plan in (a, b)), tmp_path)
    start = lines.index("configuration, in the first run of each, as no cell is in both:")
    said = "\n".join(lines[start:])
    assert "pressure: 300 -> 310" in said and "material.E: 200000 -> 140000" in said
    assert "the same configuration" not in said


def test_hardness_is_compared_where_there_is_some(sweep):
    """A sweep of falls and tests: each by its own measure."""
    asked = ["indenter=none,disc"]
    a = sweep(asked, {"lump_fraction": 0.5}, {"hardness": 10.0})
    b = sweep([*asked, "seed=1"], {"lump_fraction": 0.25}, {"hardness": 13.0})
    found = compare_sweeps(collect_sweep(a), collect_sweep(b))
    measures = found.cells.set_index("indenter")[["measure", "difference"]].to_dict("index")
    assert measures["none"] == {"measure": "lump_fraction", "difference": -0.25}
    assert measures["disc"] == {"measure": "hardness", "difference": 3.0}
    assert [line.split(":")[0] for line in describe_sweep_differences(found) if " cells, 0 the same" in line] == [
        "hardness",
        "lump_fraction",
    ]


def test_a_fall_is_not_compared_with_a_test(sweep):
    """Lumps and hardness are no change of one another."""
    a = sweep(["pressure=300"], {"lump_fraction": 0.5})
    b = sweep(["pressure=300", "indenter=disc"], {"hardness": 10.0})
    found = compare_sweeps(collect_sweep(a), collect_sweep(b))
    assert found.cells.empty and len(found.lacking) == 1
    assert "cells without results to compare:" in describe_sweep_differences(found)


def test_a_sweep_beside_itself(sweep, tmp_path):
    plan = sweep(["pressure=300,500"], *lumps(0.5, 0.1))
    name = record.name_sweep(plan.overrides)
    assert describe_differences(name, name, tmp_path)[2:] == [
        "the same configuration",
        "lump_fraction: 2 cells, 2 the same",
        "no cell changed",
    ]


def test_what_cannot_be_compared_is_refused(sweep, tmp_path):
    """A run with a sweep, and sweeps that vary different keys."""
    plan, other = sweep(["pressure=300,500"], *lumps(0.5)), sweep(["solver.cfl=0.2,0.25"])
    name, run = record.name_sweep(plan.overrides), plan.runs[0].id
    for pair in ((name, run), (run, name)):
        with pytest.raises(ConfigError, match=f"'{name.replace('+', '.')}' is a sweep and '{run}' is none"):
            describe_differences(*pair, tmp_path)
    with pytest.raises(ConfigError, match=r"only one of the sweeps varies solver.cfl"):
        compare_sweeps(collect_sweep(plan), collect_sweep(other))
