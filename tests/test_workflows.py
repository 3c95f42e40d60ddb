"""The workflows of GitHub: well formed, safe by two outside checkers, and calling only what there is."""

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from snowrepro.cli.main import build_parser
from snowrepro.composition.experiments import list_in_paper_order, read_experiments
from snowrepro.report.figures.kinds import find_figure
from snowrepro.settings.question import Experiment

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / ".github" / "workflows"
WORKFLOWS = sorted(FOLDER.glob("*.yml"))
BIN = Path(sys.executable).parent
SCHEMA = (BIN / "check-jsonschema", "--builtin-schema", "vendor.github-workflows")
AUDIT = (BIN / "zizmor", "--offline", "--no-progress", "--config", ROOT / ".github" / "zizmor.yml")


def checked(*command: str | Path) -> tuple[int, str]:
    """Exit code and all words of a checker."""
    done = subprocess.run(
        command, cwd=ROOT, env={**os.environ, "LC_ALL": "C"}, capture_output=True, text=True, timeout=120
    )
    return done.returncode, done.stdout + done.stderr


def commands(workflow: Path) -> Iterator[list[str]]:
    """Each line of each step's ``run``, in words."""
    for job in yaml.safe_load(workflow.read_text())["jobs"].values():
        for step in job["steps"]:
            for line in step.get("run", "").splitlines():
                yield shlex.split(line, comments=True)


def unknown(words: list[str]) -> str | None:
    """What a command names that neither Makefile nor ``snowrepro`` has; None if nothing."""
    program, *arguments = words
    if program == "make":
        code, told = checked("make", "--dry-run", *arguments)
        return told if code or "Nothing to be done" in told else None  # the latter of files without a rule
    if Path(program).name == "snowrepro":
        try:
            build_parser().parse_args(arguments)
        except SystemExit:
            return f"snowrepro {' '.join(arguments)}"
    return None


def test_the_schema_and_an_audit_find_nothing():
    """Keys and values as GitHub has them; no injection, no needless permission or credential."""
    for checker in (SCHEMA, AUDIT):
        code, told = checked(*checker, *WORKFLOWS)
        assert code == 0, told


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.name)
def test_what_is_called_exists(workflow):
    """Targets of make, commands and options of snowrepro."""
    called = list(commands(workflow))
    assert {Path(words[0]).name for words in called} >= {"make", "snowrepro"}
    assert [missing for words in called if (missing := unknown(words))] == []


@pytest.mark.parametrize(
    "words", ["make tests PYTHON=python", ".venv/bin/snowrepro chek", ".venv/bin/snowrepro report fig5 --again fig6"]
)
def test_what_does_not_exist_is_noticed(words):
    """A wrong target, command or option."""
    assert unknown(words.split())


@pytest.mark.parametrize(
    ("checker", "right", "wrong", "told"),
    [
        (SCHEMA, "timeout-minutes: 15", "timeout: 15", "timeout"),
        (SCHEMA, "runs-on: ubuntu-latest", "needs: [lint]", "runs-on"),
        (AUDIT, "PYTHON=python", "TITLE=${{ github.event.head_commit.message }}", "template-injection"),
        (AUDIT, "contents: read", "contents: write", "excessive-permissions"),
        (AUDIT, "persist-credentials: false", "fetch-depth: 1", "artipacked"),
        (AUDIT, "actions/checkout@v6", "someone/checkout@v6", "unpinned-uses"),
    ],
)
def test_a_broken_workflow_is_reported(tmp_path, checker, right, wrong, told):
    """A misspelt key, no machine, a message that the shell runs, rights too wide, a stray token, a stranger."""
    text = (FOLDER / "ci.yml").read_text()
    assert right in text
    broken = tmp_path / ".github" / "workflows" / "ci.yml"
    broken.parent.mkdir(parents=True)
    broken.write_text(text.replace(right, wrong))
    code, message = checked(*checker, broken)
    assert code != 0
    assert told in message


def read_make_list(name: str) -> set[str]:
    """The words of a list in the Makefile."""
    line = next(line for line in (ROOT / "Makefile").read_text().splitlines() if line.startswith(f"{name} :="))
    return set(line.partition(":=")[2].split())


def test_make_paper_has_every_experiment_of_the_paper():
    """Those by which claims are judged with three seeds, the others with their own; none that needs no run."""
    experiments = read_experiments()
    kinds = {name: find_figure(Experiment.model_validate(experiments[name])) for name in list_in_paper_order()}
    judged = {name for name, kind in kinds.items() if kind.is_judged}
    assert read_make_list("JUDGED") == judged
    assert read_make_list("STUDIES") == {name for name, kind in kinds.items() if kind.needs_runs} - judged


@pytest.mark.skipif(shutil.which("make") is None, reason="there is no make")
def test_make_paper_runs_them_and_make_plan_paper_runs_nothing():
    """As make would do it, without doing it."""
    said = {target: checked("make", "-n", target)[1] for target in ("paper", "plan-paper", "reproduce")}
    assert "for name in fig5 fig6 seen grid; do .venv/bin/snowrepro claims experiment=$name" in said["paper"]
    assert said["paper"].count("--no-report || test $? -eq 3; done") == 2  # a run that fails is an outcome
    assert "||" not in said["reproduce"].partition("for name")[2]
    assert " map " in said["paper"] and "snowrepro report" in said["paper"] and " map " not in said["reproduce"]
    assert "snowrepro run" not in said["plan-paper"] and said["plan-paper"].count("snowrepro plan") == 2
