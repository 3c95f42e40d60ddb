"""``snowrepro report`` as a user calls it, and what is on the disk afterwards."""

import json
import re
import shutil

import pytest

from tests.conftest import SMALL

FIG5 = ["experiment=fig5", "pressure=500,3000", "sintering=paper", "experiment.frames=[0,20,60]", *SMALL]
PAGES = ("index.html", "index.md", "report.json")


@pytest.mark.nightly
def test_a_paper_without_runs_says_how_to_make_them(snowrepro, tmp_path):
    """What needs no runs is drawn, all else is named with its command; the store is not touched."""
    done = snowrepro("report")
    assert done.returncode == 0, done.stderr
    assert done.stdout == "report: my_reports/paper/index.html\n"
    folder = tmp_path / "my_reports" / "paper"
    parts = {path.stem: path.read_text() for path in folder.glob("*.md")}
    assert "../fig2/shapes.png" in parts["index"] and "12 of 13 parameters" in parts["table1"]
    for name in ("fig5", "fig6", "grid", "convergence"):
        assert f"**Not run here.** `snowrepro run experiment={name}`" in parts[name]
    assert set(re.findall(r"\]\((\w+)\.md\)", parts["index"])) == set(parts) - {"index"}, "each part has a link"
    page = "".join(parts.values())
    html = (tmp_path / "my_reports" / "paper" / "index.html").read_text()
    assert html.count("<img") == 2 and "../fig2/shapes.png" not in html
    assert not (tmp_path / "runs").exists()
    assert str(tmp_path) not in page + html


@pytest.mark.nightly
def test_a_paper_that_was_never_run_so_is_not_drawn(snowrepro, tmp_path):
    """A user may take the words of one run for those of a report."""
    done = snowrepro("report", "pressure=300")
    assert done.returncode == 2
    assert "nothing of the paper was run with pressure=300 in the folder 'runs'" in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.nightly
def test_two_processes_write_the_same_bytes(snowrepro, tmp_path):
    """Page, text, JSON, pictures and tables of one store, made twice in processes of their own."""
    ran = snowrepro("run", *FIG5)
    assert ran.returncode == 0, ran.stderr
    (folder,) = (tmp_path / "my_reports").iterdir()
    assert ran.stdout.splitlines()[-1] == f"report: my_reports/{folder.name}/index.html"
    first = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert set(PAGES) <= set(first)
    stamps = {path.name: path.stat().st_mtime_ns for path in folder.iterdir()}
    unchanged = snowrepro("report", *FIG5)
    assert unchanged.stdout == "\n".join(ran.stdout.splitlines()[-2:]) + "\n" and "nothing changed" in unchanged.stderr
    assert {path.name: path.stat().st_mtime_ns for path in folder.iterdir()} == stamps
    shutil.rmtree(folder)
    again = snowrepro("report", *FIG5)
    assert again.returncode == 0, again.stderr
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == first


@pytest.mark.nightly
def test_without_a_report(snowrepro, tmp_path):
    """``--no-report`` runs, prints verdicts, and draws nothing."""
    assert snowrepro("run", *FIG5, "--no-report").returncode == 0
    judged = snowrepro("claims", *FIG5, "seeds=1", "--no-report")
    assert judged.returncode == 0 and "C1" in judged.stdout and "report:" not in judged.stdout
    assert not (tmp_path / "my_reports").exists()


@pytest.mark.nightly
def test_seeds_once_asked_for_stay_in_the_report(snowrepro, tmp_path):
    """Claims with two seeds, then the experiment alone: the report has both seeds; named ones win.

    So it has by the experiment's name alone, which stands for the newest of its sweeps in other verbs too.
    """
    assert snowrepro("claims", *FIG5, "seeds=2").returncode == 0
    assert snowrepro("run", *FIG5).returncode == 0
    (folder,) = (tmp_path / "my_reports").iterdir()
    assert json.loads((folder / "claims.json").read_text())["seeds"] == [0, 1]
    named = snowrepro("report", "fig5")
    assert named.returncode == 0 and "'fig5' stands for the newest of 2 sweeps: " in named.stderr
    assert [*(tmp_path / "my_reports").iterdir()] == [folder]
    assert json.loads((folder / "claims.json").read_text())["seeds"] == [0, 1]
    assert "2 done" in snowrepro("status", "fig5").stdout
    assert snowrepro("report", *FIG5, "seeds=1").returncode == 0
    assert json.loads((folder / "claims.json").read_text())["seeds"] == [0]


@pytest.mark.nightly
def test_two_readings_side_by_side(snowrepro, tmp_path):
    """What was asked for otherwise and what it changes comes first; a run that failed on one side is named."""
    assert snowrepro("run", *FIG5).returncode == 0
    changed = [option.replace("pressure=500,3000", "pressure=500,1e9") for option in FIG5]
    assert snowrepro("run", *changed, "reading.release=rest").returncode == 3
    records = [json.loads(path.read_text()) for path in (tmp_path / "runs" / "sweeps").glob("*/sweep.json")]
    first, second = sorted(records, key=lambda record: "reading.release=rest" in record["overrides"])
    done = snowrepro("report", first["name"], "--against", second["name"])
    assert done.returncode == 0, done.stderr
    folder = tmp_path / done.stdout.removeprefix("report: ").strip().rpartition("/")[0]
    page = (folder / "index.md").read_text()
    assert page.index("reading.release keep_velocity -> rest") < page.index("differences.png")
    assert "**missing** (failed): ball on L, 1e\\+09" in page
    assert "Cells of A alone: 1" in page and "Cells of B alone: 1" in page
    assert page.count("](a/strip.png)") == page.count("](b/strip.png)") == 1
    html = (folder / "index.html").read_text()
    assert html.count("<img") > 8 and 'src="a/' not in html


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["nothing"], "there is no experiment 'nothing'; there are: ablation, audit, calibration"),
        (["paper", "seeds=3"], "leave out the seeds"),
        (["--against", "fig5"], "snowrepro report A --against fig5"),
        (["fig5", "--against", "fig2"], "'fig2' is no experiment with runs"),
    ],
)
def test_what_cannot_be_reported_is_said_in_one_line(snowrepro, tmp_path, words, told):
    """A name that is none, seeds of the whole paper, a comparison of what has no runs."""
    done = snowrepro("report", *words)
    assert done.returncode == 2
    assert told in done.stderr and "Traceback" not in done.stderr
    assert done.stderr.count("\n") == 1
