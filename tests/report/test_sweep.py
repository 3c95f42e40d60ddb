"""The report of a sweep that is no experiment."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread

from snowrepro.cli.main import main
from snowrepro.report.figures import sweep as sweep_figure
from snowrepro.report.page.compare import write_comparison
from snowrepro.report.page.page import draw_experiment, write_experiment_page
from snowrepro.report.page.unchanged import STAMP
from snowrepro.report.sections import sizes, snow
from snowrepro.sweep import record
from snowrepro.sweep.plan import Plan, make_plan
from tests.configs import carrying
from tests.conftest import SMALL
from tests.report.small_runs import shaken

ASKED = [*SMALL, "pressure=500,3000", "sintering=paper,none", "seed=0,1"]
PAGES = {"index.html", "index.md", "report.json"}
PICTURES = {"over-pressure.png", "snow.png", "sizes.png"}
FLOOR, SINTERED = (0x30, 0x7A, 0x78), (0xD5, 0x5E, 0x00)


def write_report(plan: Plan, folder: Path | None = None) -> str:
    """Write the report of a plan; returns its Markdown."""
    return write_experiment_page(draw_experiment(plan, folder)).with_suffix(".md").read_text(encoding="utf-8")


def share(path, colour: tuple[int, int, int]) -> float:
    """Part of a picture's pixels that have a colour."""
    return float((np.abs(imread(path)[..., :3] * 255 - colour).max(axis=-1) < 4).mean())


@pytest.fixture(scope="module")
def swept(small_run, tmp_path_factory):
    """Two pressures with and without sintering, two seeds each: five runs done, one failed, two never run."""
    folder = tmp_path_factory.mktemp("swept")
    plan = make_plan([*ASKED, f"store={folder}/runs", f"reports={folder}/reports"], multirun=True)
    for run in plan.runs[:5]:
        run.save(carrying(shaken(small_run, 0.1 * run.case.seed, 1), run.config), wall_seconds=2.0)
    plan.runs[5].save_outcome("failed", "it blew up")
    record.write_record(plan)
    return plan, folder


@pytest.fixture(scope="module")
def report(swept):
    """Its report: the folder and the Markdown."""
    plan, folder = swept
    text = write_report(plan)
    return folder / "reports" / record.name_without_seeds(ASKED), text


def test_all_is_there(report):
    """Pages, pictures and tables, in a folder that is named like the sweep without its seeds."""
    folder, _ = report
    assert {path.name for path in folder.iterdir()} == PAGES | PICTURES | {"summary.csv", "results.csv", "sizes.csv"}
    assert json.loads((folder / "report.json").read_text())["title"] == "Sweep over pressure, sintering, seed"
    assert len(pd.read_csv(folder / "results.csv")) == 8
    assert share(folder / "snow.png", FLOOR) > 0.02 and share(folder / "over-pressure.png", SINTERED) > 1e-4


def test_what_varies_and_the_numbers(report):
    """Settings with their values; a row a cell with its mean and range; what failed and why; how to do it again."""
    _, page = report
    assert "5 of 8 runs are done; **1 failed**; **2 pending**" in page
    assert "| `pressure` | 500, 3000 | 2 |" in page and "| `sintering` | paper, none | 2 |" in page
    assert "The same in all runs: shape ball, floor L." in page
    rows = [line for line in page.split("### Numbers")[1].split("###")[0].splitlines() if line.startswith("| ")]
    assert [row.split(" | ")[0].strip("| ") for row in rows[2:]] == ["500", "500", "3000", "3000"]
    assert [row.rstrip(" |").split(" | ")[-1] for row in rows[2:]] == ["2 of 2", "2 of 2", "1 of 2", "0 of 2"]
    assert " to " in rows[2] and rows[5].count(" - ") >= 4
    assert "**missing** (failed): ball on L, 3000, paper, seed 1: it blew up" in page
    assert "snowrepro run -m fidelity=preview" in page
    assert "3 of 8 runs have no result" in page


def test_no_title_stands_twice_and_no_section_is_empty(report):
    """What the page is called is not said again; a heading whose only picture is at the top is left out."""
    _, page = report
    heads = [line.lstrip("# ") for line in page.splitlines() if line.startswith("#")]
    assert len(set(heads)) == len(heads) and "Results" in heads
    assert "Results over what varies" not in heads and "at the top" not in page
    assert "Each lump has a colour, crushed snow is dark, loose snow the colour of sand." in page


@pytest.fixture
def without_snow(monkeypatch):
    """Reports without what takes long."""
    monkeypatch.setattr(snow, "make_blocks", lambda _: [])
    monkeypatch.setattr(sizes, "make_blocks", lambda _: [])


def test_of_many_cells_some_are_shown(swept, monkeypatch, tmp_path):
    """And the page says so; a long table is folded."""
    monkeypatch.setattr(snow, "MOST_ROWS", 2)
    monkeypatch.setattr(sweep_figure, "MOST_OPEN", 3)
    page = write_report(swept[0], tmp_path)
    assert "Of 4 cells 2 are shown, evenly picked of those with a result." in page
    assert "#### All 4 cells" in page


@pytest.fixture
def plot(monkeypatch, capsys, tmp_path):
    """Call the command in an empty folder; returns a function from arguments to exit code, output, errors."""

    def call(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.chdir(tmp_path)
        with pytest.raises(SystemExit) as ended:
            main(["plot", *arguments])
        return ended.value.code, *capsys.readouterr()

    return call


@pytest.mark.nightly
def test_a_name_is_enough(swept, report, snowrepro, plot):
    """``report``, which in another process writes the same bytes, and ``plot``."""
    plan, folder = swept
    first = {path.name: path.read_bytes() for path in report[0].iterdir()}
    name = record.name_sweep(plan.overrides)
    places = (f"store={folder}/runs", f"reports={folder}/reports")
    done = snowrepro("report", name, *places)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == f"report: {report[0]}/index.html"
    assert done.stdout.startswith("verdict: Mass in lumps: from ")
    assert {path.name: path.read_bytes() for path in report[0].iterdir() if path.name != STAMP} == first
    path = report[0] / "broken_bonds-over-pressure-sintering.png"
    code, out, said = plot(name, "y=broken_bonds", "--log", "x", *places)
    assert (code, out) == (0, f"{path}\n"), said
    assert path.read_bytes().startswith(b"\x89PNG")
    assert "not in the picture: 3 of 8 runs have no result" in said
    path.unlink()


@pytest.mark.nightly
def test_a_report_is_of_all_seeds_that_were_asked_for(small_run, snowrepro, tmp_path):
    """By the words of either sweep, by their order or name: its folder has no seeds in its name."""
    for seeds in ("0,1", "2"):
        plan = make_plan([*ASKED[:-1], f"seed={seeds}", f"store={tmp_path}/runs"], multirun=True)
        for run in plan.runs:
            run.save(carrying(small_run, run.config), wall_seconds=2.0)
        record.write_record(plan)
    for words in ([*ASKED[:-1], "seed=2"], [*ASKED[:-1], "seed=0,1"], ["-m", *ASKED[:-1]]):
        done = snowrepro("report", *words, f"store={tmp_path}/runs", f"reports={tmp_path}/reports")
        assert done.returncode == 0, done.stderr
        (page,) = (tmp_path / "reports").glob("*/index.md")
        assert "12 of 12 runs" in page.read_text(), words


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["nothing"], "there is no sweep 'nothing' in the store"),
        (["nothing", "color=pressure"], "colour=COLUMN, panel=COLUMN; did you mean 'colour'?"),
        (["nothing", "pressure"], "'pressure' is none of x=COLUMN, y=COLUMN"),
        (["nothing", "--out", "plot.jpg"], "a plot is a .png, .svg or .pdf file"),
    ],
)
def test_a_plot_that_cannot_be_is_said_in_one_line(plot, tmp_path, words, told):
    code, out, said = plot(*words)
    assert (code, out) == (2, "")
    assert told in said and said.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_hardness_tests_have_a_report(small_run, indented_run, tmp_path):
    """Their hardness is drawn beside the lumps of runs that fall."""
    plan = make_plan([*SMALL, "indenter=disc,none", f"store={tmp_path}/runs", f"reports={tmp_path}"], multirun=True)
    for run in plan.runs:
        run.save(indented_run if run.case.indenter else small_run, wall_seconds=2.0)
    page = write_report(plan)
    assert "Hardness tests are not shown." in page
    assert "hardness \\[kg cell⁻¹ s⁻²\\]" in page
    assert "| `indenter` | disc, none | 2 |" in page


def test_an_experiment_can_be_drawn_so(swept, without_snow):
    """One of a user's own that has no picture of its own."""
    plan, folder = swept
    words = [word for word in plan.overrides if not word.startswith("reports=")]
    own = ["experiment=fig5", "experiment.picture=sweep", "experiment.name=own", f"reports={folder}/own"]
    page = write_report(make_plan([*words, *own], multirun=True))
    assert "5 of 8 runs are done" in page and "over-pressure.png" in page


def test_no_result_is_a_report_too(tmp_path):
    plan = make_plan([*ASKED, f"store={tmp_path}/runs", f"reports={tmp_path}"], multirun=True)
    page = write_report(plan)
    assert "0 of 8 runs are done" in page and "No run has a result." in page
    assert "| `pressure` | 500, 3000 | 2 |" in page


def test_two_sweeps_side_by_side(swept, without_snow):
    """Without verdicts, as no claim is judged by them."""
    plan, _ = swept
    page = write_comparison(plan, plan).with_suffix(".md").read_text()
    assert "erdict" not in page.split("## Numbers")[0]
    assert "](a/over-pressure.png)" in page and "](b/over-pressure.png)" in page
