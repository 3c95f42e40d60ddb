"""The row of numbers of a run: what it has, what its columns mean, and when it is worked out again."""

import json
import os

import pytest
import xarray as xr

from snowrepro.composition.compose import compose
from snowrepro.settings.case import ARMS
from snowrepro.store.run import Run
from snowrepro.summary import row as rows
from snowrepro.summary.columns import find_columns
from snowrepro.summary.row import ARM, read_bonds, read_row, summarise, tabulate_runs
from tests.configs import changed
from tests.conftest import QUICK, SMALL


@pytest.fixture
def stored(small_run, small_config, tmp_path) -> Run:
    """The small run in a store."""
    run = Run(changed(small_config, store=str(tmp_path)))
    run.save(small_run, wall_seconds=1.0, seconds_per_frame=0.01)
    return run


@pytest.fixture
def measured(monkeypatch) -> list[str]:
    """The ids of runs that are analysed, one after the other."""
    seen, measure = [], rows._analyse

    def count(run: Run) -> tuple:
        seen.append(run.id)
        return measure(run)

    monkeypatch.setattr(rows, "_analyse", count)
    return seen


def test_the_summary_of_an_indented_run(indented_run, small_run):
    """Hardness and what was at release, and nothing about a fall that was not; a fall has the reverse."""
    row, fallen = summarise(indented_run), summarise(small_run)
    assert row["indenter"] == "disc" and row["hardness"] > 1e3 and row["indentation_work"] > 0
    assert row["factor_at_release"] == fallen["factor_at_release"]
    assert not {"lump_fraction", "settled", "impact_speed", "rebound"} & set(row)
    assert {"lump_fraction", "flattening_most", "flattening_end", "rebound"} <= set(fallen)
    assert "hardness" not in fallen
    assert 0 < fallen["flattening_end"] <= fallen["flattening_most"] < 1
    assert 0 <= fallen["rebound"] < 1


@pytest.mark.parametrize("kind", ["fall", "test"])
def test_every_column_has_a_meaning(kind, small_run, indented_run):
    """A real row has the columns of the table of meanings, all and no others, words and numbers as it says."""
    dataset = {"fall": small_run, "test": indented_run}[kind]
    row, columns = summarise(dataset), find_columns([compose(QUICK if kind == "test" else SMALL).case])
    assert set(row) == set(columns)
    for name, value in row.items():
        about = columns[name].attrs("m")
        assert about["long_name"]
        assert isinstance(value, str) == columns[name].is_text == ("units" not in about), name
        assert about.get("units") != ""


def test_a_row_is_worked_out_once(stored, small_run, measured):
    """And kept beside the result with what its bonds saw: the same numbers as from memory."""
    row, seen = read_row(stored), read_bonds(stored)
    assert row == read_row(stored) and measured == [stored.id]
    of_saving = {"run_id": "", "seconds": 0.0, "seconds_per_frame": 0.0}
    assert {**row, **of_saving} == {**summarise(small_run), **of_saving}
    xr.testing.assert_identical(read_bonds(stored).drop_attrs(), seen.drop_attrs())
    assert measured == [stored.id]
    assert {path.name for path in stored.folder.iterdir()} >= {"summary.json", "analysis.nc"}


def test_a_row_is_worked_out_again_where_it_could_be_another(stored, measured, monkeypatch):
    """Under other settings of the analysis, by other code, or from a newer result; not by who asks or how it ran."""
    lumps = read_row(stored)["lump_fraction"]
    for same in ({"threads": 1, "checkpoint_seconds": 5.0}, {"rerun": ["code"], "reports": "elsewhere"}):
        assert read_row(Run(changed(stored.config, **same)))["lump_fraction"] == lumps
    assert len(measured) == 1
    analysis = stored.config.question.analysis.model_copy(update={"volume_change": (0.05, 0.1)})
    assert read_row(Run(changed(stored.config, analysis=analysis)))["lump_fraction"] < lumps
    assert len(measured) == 2
    assert read_row(stored)["lump_fraction"] == lumps, "only the last is kept"
    assert len(measured) == 3
    monkeypatch.setattr(rows, "make_key", lambda _: "of other code")
    read_row(stored)
    assert len(measured) == 4
    later = (stored.folder / "summary.json").stat().st_mtime_ns + 10**9
    os.utime(stored.result, ns=(later, later))
    read_row(stored)
    assert len(measured) == 5


def test_rows_stand_as_in_the_paper(small_run, tmp_path):
    """Scene by scene as they come, sintered first, pressure rising; each says its arm, which no file does."""
    asked = [("star", "none", 3000), ("ball", "paper", 3000), ("ball", "none", 500), ("ball", "paper", 500)]
    runs = []
    for shape, sintering, pressure in asked:
        options = [f"shape={shape}", f"sintering={sintering}", f"pressure={pressure}", f"store={tmp_path}"]
        run = Run(compose([*SMALL, *options]))
        run.save(small_run)
        run.save_row(rows.make_key(run.config.question.analysis), {"run_id": run.id})
        runs.append(run)
    table = tabulate_runs(runs)
    assert table["run_id"].tolist() == [runs[i].id for i in (0, 3, 1, 2)]
    assert table[ARM].tolist() == [ARMS[i] for i in (1, 0, 0, 1)]
    assert all(ARM not in json.loads((run.folder / "summary.json").read_text())["row"] for run in runs)
