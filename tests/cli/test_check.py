"""``snowrepro check`` and ``bless`` as subprocesses: every exit code, what is written, and what is refused."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pandas as pd
import pytest

from snowrepro.checks import baseline, mutants
from snowrepro.checks.mutants import Edit

BASELINE = Path(__file__).parents[2] / baseline.FOLDER
ONE = ["--only", "sintered"]  # the quickest of the short runs
REASON = "a reason that a test has"


@pytest.fixture
def references(tmp_path) -> Path:
    """A copy of the references, to be spoilt."""
    return Path(shutil.copytree(BASELINE, tmp_path / "references"))


@pytest.fixture
def clone(tmp_path) -> Path:
    """The program as a git clone with one commit."""
    folder = tmp_path / "clone"
    folder.mkdir()
    mutants.copy_program(folder)
    git(folder, "init", "--quiet")
    commit(folder)
    return folder


def git(folder: Path, *arguments: str) -> None:
    who = ["-c", "user.name=A", "-c", "user.email=a@b.c"]
    subprocess.run(["git", "-C", folder, *who, *arguments], check=True, capture_output=True)


def commit(folder: Path) -> None:
    git(folder, "add", "--all")
    git(folder, "commit", "--quiet", "--message", "a step")


def of_clone(folder: Path, *arguments: str) -> subprocess.CompletedProcess:
    """The command line of a copy of the program, in its folder."""
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    command = [sys.executable, "-m", "snowrepro", *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300)


def test_fine(snowrepro, tmp_path):
    """Exit code 0, each finding once, and the same in three files."""
    done = snowrepro("check", "--tier", "1,2", *ONE, "--baseline", str(BASELINE))
    assert done.returncode == 0, done.stderr
    assert "tier 2, short horizon\n2  ok            sintered: " in done.stdout
    shown = (done.stdout + done.stderr).splitlines()
    assert sum(line.startswith("2  ok ") for line in shown) == 1
    assert done.stdout.splitlines()[-1].startswith("fine: ")
    assert sorted(path.name for path in (tmp_path / "my_reports/check").iterdir()) == [
        "check.json",
        "check.md",
        "check.xml",
    ]
    said = json.loads((tmp_path / "my_reports/check/check.json").read_text())
    assert said["finished"] and said["exit_code"] == 0 and {f["tier"] for f in said["findings"]} == {1, 2}
    assert ET.parse(tmp_path / "my_reports/check/check.xml").getroot().findall(".//testcase")


@pytest.mark.nightly
def test_an_unknown_platform_falls_to_tier_2_and_says_so(snowrepro, references):
    path = references / baseline.PRINTS
    path.write_text(path.read_text().replace('"Linux ', '"Plan9 ').replace('"Darwin ', '"Plan9 '))
    done = snowrepro("check", "--tier", "1", *ONE, "--baseline", str(references))
    assert done.returncode == 0, done.stderr
    assert "1  moved         sintered: no fingerprint for" in done.stdout and "tier 2 takes over" in done.stdout
    assert "2  ok            sintered: " in done.stdout


def test_regressed(snowrepro, references):
    """Exit code 1: a reference number is another, by a millionth."""
    path = references / "horizon.csv"
    table = pd.read_csv(path, float_precision="round_trip")
    chosen = (table["case"] == "sintered") & (table["frame"] == 60) & (table["number"] == "density mean")
    table.loc[chosen, "value"] *= 1 + 1e-6
    table.to_csv(path, index=False)
    done = snowrepro("check", "--tier", "2", *ONE, "--baseline", str(references))
    assert done.returncode == 1
    assert "2  REGRESSED     sintered: " in done.stdout and "at density mean, frame 60" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--tier", "7"], "there is no tier '7'; there are: 0 invariances, 1 fingerprints"),
        (["--only", "nothing"], "there is no 'nothing' to check; there are: sintered, "),
        (["--workers", "-1"], "workers: should be at least 1"),
        (["--out", "file"], "cannot write into the folder 'file'"),
    ],
)
def test_bad_input(snowrepro, tmp_path, arguments, told):
    """Exit code 2, one message, and nothing is run."""
    (tmp_path / "file").write_text("")
    done = snowrepro("check", *arguments)
    assert done.returncode == 2 and told in done.stderr and "Traceback" not in done.stderr
    assert not (tmp_path / "my_reports").exists()


@pytest.mark.parametrize("name", ["origin.json", "fingerprints.json", "horizon.csv"])
def test_a_broken_reference_is_bad_input(snowrepro, references, name):
    path = references / name
    path.write_bytes(path.read_bytes()[:100] + b'"')
    done = snowrepro("check", "--tier", "2", *ONE, "--baseline", str(references))
    assert done.returncode == 2 and name in done.stderr and "Traceback" not in done.stderr


def test_runs_failed(tmp_path, references):
    """Exit code 3: a program whose time step may not fall as far as it has to."""
    mutants.copy_program(tmp_path / "copy")
    mutants.apply_edit(tmp_path / "copy", Edit("conf/solver/apic.yaml", "max_substeps: 20000", "max_substeps: 2"))
    done = of_clone(tmp_path / "copy", "check", "--tier", "2", *ONE, "--baseline", str(references))
    assert done.returncode == 3
    assert "2  RUN FAILED    sintered: diverged in frame" in done.stdout


def test_nothing_to_compare_with(snowrepro, references):
    """Exit code 4: no reference at all, and one of another model."""
    done = snowrepro("check", "--tier", "1,2,3,4")
    assert done.returncode == 4 and done.stdout.count("NOT MEASURED") == 5
    told = "no reference in reports/baseline: they are in a clone of the program: go there, or name them"
    assert f"{told}, --baseline {BASELINE}, 0 s\n" in done.stdout
    path = references / baseline.ORIGIN
    path.write_text(path.read_text().replace('"model_version": ', '"model_version": 9'))
    done = snowrepro("check", "--tier", "2", "--baseline", str(references))
    assert done.returncode == 4 and "snowrepro bless renews it" in done.stdout


def test_interrupted(tmp_path):
    """Exit code 130, and what was found until then is kept.  By SIGTERM: SIGINT is ignored in the background."""
    command = [sys.executable, "-m", "snowrepro", "check", "--tier", "0"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        first = [process.stdout.readline() for _ in range(2)]
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=100)
    assert first[0] == "tier 0, invariances\n" and first[1].startswith("0  ok ") and process.returncode == 130
    said = json.loads((tmp_path / "my_reports/check/check.json").read_text())
    assert not said["finished"] and len(said["findings"]) >= 1


@pytest.mark.nightly
def test_blessing_is_refused(clone):
    """Without a reason, without a clone, from a tree that git does not know; and nothing is written."""
    ways = [([], "a reason of at least"), (["--reason", "because"], "a reason of at least")]
    for arguments, told in ways:
        done = of_clone(clone, "bless", "--tier", "1", *ONE, *arguments)
        assert done.returncode == 2 and told in done.stderr
    for change in (clone / "snowrepro/units.py", clone / "conf/shape/new.yaml"):
        before = change.read_text() if change.exists() else None
        change.write_text((before or "") + "# changed\n")
        done = of_clone(clone, "bless", "--tier", "1", *ONE, "--reason", REASON)
        assert done.returncode == 2 and f"commit first: {change.relative_to(clone)}" in done.stderr
        change.unlink() if before is None else change.write_text(before)
    shutil.rmtree(clone / ".git")
    done = of_clone(clone, "bless", "--tier", "1", *ONE, "--reason", REASON)
    assert done.returncode == 2 and "this is no clone" in done.stderr
    assert not [path for path in (clone / "reports").rglob("*") if path.is_file()]


@pytest.mark.nightly
def test_blessed_regressed_and_blessed_again(clone):
    """A reference is made, a changed law is noticed, and a renewal says what it changes."""
    short = ["--tier", "1,2", *ONE]
    done = of_clone(clone, "bless", *short, "--reason", "the first of all")
    assert done.returncode == 0, done.stderr
    assert "horizon: sintered: 356 numbers, new" in done.stdout
    commit(clone)
    assert of_clone(clone, "check", *short).returncode == 0
    law = clone / "conf/sintering/paper.yaml"
    law.write_text(law.read_text().replace("C1: 5.0e-7", "C1: 5.5e-7"))
    assert of_clone(clone, "check", *short).returncode == 1
    commit(clone)
    done = of_clone(clone, "bless", *short, "--reason", "C1 is a tenth larger")
    assert done.returncode == 0 and " -> " in done.stdout and "sintered moved" in done.stdout
    assert of_clone(clone, "check", *short).returncode == 0
    log = (clone / baseline.FOLDER / baseline.LOG).read_text()
    assert log.index("C1 is a tenth larger") < log.index("the first of all")
    assert log.count("\n## ") == 2 and log.count("model version") == 0


@pytest.mark.nightly
def test_the_figures_are_what_they_were(snowrepro, references):
    """Tiers 3 and 4 on Figure 5; then a claim that was another before, and a number that was."""
    figure = ["check", "--tier", "3,4", "--only", "fig5", "--baseline", str(references)]
    done = snowrepro(*figure)
    assert done.returncode == 0, done.stdout
    assert done.stdout.count("\n3  ok ") == 1 and done.stdout.count("\n4  ok ") == 5
    for name, column, value in (("verdicts", "verdict", "CONTRADICTED"), ("ensemble", "lump_fraction", 0.4)):
        path = references / f"{name}.csv"
        kept = path.read_text()
        table = pd.read_csv(path, float_precision="round_trip")
        table.loc[table["experiment"] == "fig5", column] = value
        table.to_csv(path, index=False)
        done = snowrepro(*figure)
        assert done.returncode == 1 and "REGRESSED" in done.stdout
        path.write_text(kept)


@pytest.mark.nightly
def test_a_defect_is_caught_in_a_copy_of_the_program(tmp_path):
    """From the list to the verdict; asked again, it is remembered."""
    (defect,) = (mutant for mutant in mutants.read_mutants() if mutant.name == "C1 x 1.1")
    for _ in range(2):
        (tried,) = mutants.try_mutants([defect], BASELINE, tmp_path / "store", False, 1)
        assert tried.verdict == "caught", tried.problem
    assert len(list((tmp_path / "store/mutants").glob("*.json"))) == 1
    assert not list((tmp_path / "store/mutants").glob("of-*"))
