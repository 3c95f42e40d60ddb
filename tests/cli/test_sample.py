"""``snowrepro sample``: a design run, with a run that fails; enlarged; and what the other commands say of it."""

import pytest

from snowrepro.cli.verbs.sample import add_design
from tests.conftest import SMALL

ASKED = [*SMALL, "pressure=choice(3000,1e9)", "reading.friction=interval(0,1)"]


def test_the_usual_design_is_sobols():
    """Unless the words or their experiment say another."""
    assert add_design(["pressure=log(1,2)"]) == ["design=sobol", "pressure=log(1,2)"]
    for words in (["design=morris", "pressure=log(1,2)"], ["experiment=mine"]):
        assert add_design(words) == words


@pytest.mark.nightly
def test_a_sample_is_run_and_enlarged(snowrepro, tmp_path):
    """Failures are kept and not tried again; more points run only what is new; other commands know the sweep."""
    done = snowrepro("sample", *ASKED, "design.points=2")
    assert done.returncode == 3 and "1 of 2 runs have no result" in done.stderr, done.stderr
    (first,) = (tmp_path / "runs").glob("[!.]*/run.nc")
    before = first.stat().st_mtime_ns
    larger = snowrepro("sample", *ASKED, "design.points=4")
    assert "4 runs, 1 of them done" in larger.stderr and "to run: 2, never run" in larger.stderr, larger.stderr
    assert "left alone: 1, failed, and would fail again" in larger.stderr
    assert first.stat().st_mtime_ns == before
    name = next(line for line in larger.stdout.splitlines() if line.startswith("sweep: ")).removeprefix("sweep: ")
    assert "2 done, 2 failed" in snowrepro("status", name).stdout
    again = snowrepro("sample", *ASKED, "design.points=4")
    assert "to run" not in again.stderr
    plotted = snowrepro("plot", name, "x=reading.friction", "y=lump_fraction", "colour=pressure")
    assert plotted.returncode == 0 and "2 of 4 runs have no result" in plotted.stderr
    reported = snowrepro("report", name)
    assert reported.returncode == 0 and "missing: 2 of 4 runs have no result" in reported.stdout


def test_without_a_range_nothing_is_sampled(snowrepro):
    done = snowrepro("sample", "pressure=500,3000")
    assert done.returncode == 2 and "design=sobol has nothing to sample: write a range" in done.stderr
    done = snowrepro("sample", "experiment=fig5")
    assert done.returncode == 2 and "this experiment has no design: add one, as in design=sobol" in done.stderr
