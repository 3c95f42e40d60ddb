"""README and docs/: short, without dead links, and true.  Every example is run as it stands.

A page's ``sh`` and ``python`` blocks run in order, in an empty folder of its own, with a copy of the program whose runs
are coarse and short by default; so a block is run as the reader sees it.  A ``yaml`` block that begins with a comment
``# conf/...`` or ``# experiments/...``, maybe behind Hydra's own, is written to that file when its turn comes.  A
comment in front of a block says what else to do:

    <!-- test: skip, REASON -->       it is not run; what it calls must exist all the same
    <!-- test: from PATH -->          it is not run; it must stand in that file of the repository, word by word
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from snowrepro.composition.compose import compose
from snowrepro.report.figures.kinds import list_figure_names
from snowrepro.summary.row import ALL_COLUMNS
from tests.test_workflows import unknown

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
DOCS = ROOT / "docs"
PAGES = [README, *sorted(DOCS.rglob("*.md"))]
MOST_LINES = 150  # of the README
FENCE = re.compile(
    r"(?:^[ ]*<!-- test: (?P<note>[^\n]*?) -->\n)?^(?P<indent>[ ]*)```(?P<language>\w+)\n(?P<text>.*?)^(?P=indent)```$",
    re.MULTILINE | re.DOTALL,
)
LINK = re.compile(r"\]\(([^)\s]+)\)")
FILE = re.compile(r"(?:# @package _global_\n)?# ((?:conf|experiments)/\S+\.yaml)\n")
TOCTREE = re.compile(r"(?m)^```\{toctree\}\n(?:(?::.*)?\n)*((?:[\w/-]+\n)+)```")
MOST_SECONDS = 900
WORKING_FOLDER = "working-folder.txt"  # where the blocks of a page are
# What makes a run short: each text in a file of conf/ by another, everywhere in the file.
SHORTER = {
    "loading/paper.yaml": {r"press_frames: \d+": "press_frames: 20", r"\nframes: \d+": "\nframes: 60"},
    "reading/grid_units.yaml": {r"gravity: \S+": "gravity: 40.0", r"drop_height: \S+": "drop_height: 6.0"},
    "fidelity/paper.yaml": {r"dx: \S+": "dx: 2.0"},
    "fidelity/fine.yaml": {r"dx: \S+": "dx: 2.0"},
}
FRAMES = {2: "[12, 40]", 6: "[0, 20, 32, 48, 52, 60]"}  # in place of a figure's, by their number


@dataclass(frozen=True)
class Block:
    """A fenced block of a page, and the test's ``note`` in front of it."""

    line: int
    language: str
    text: str
    note: str

    @property
    def is_run(self) -> bool:
        return self.language in ("sh", "python") and not self.note

    @property
    def skipped(self) -> str:
        """Why it is not run; empty if that is not said."""
        return self.note.removeprefix("skip, ") if self.note.startswith("skip, ") else ""


def blocks(page: Path) -> Iterator[Block]:
    text = page.read_text(encoding="utf-8")
    for found in FENCE.finditer(text):
        line = text.count("\n", 0, found.start("text"))
        yield Block(line, found["language"], textwrap.dedent(found["text"]), found["note"] or "")


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def targets(page: Path) -> Iterator[str]:
    """Where the links of a page lead, without those that are in code."""
    text = re.sub(r"`[^`\n]*`", "", FENCE.sub("", page.read_text(encoding="utf-8")))
    return (target for target in LINK.findall(text) if not re.match(r"\w+:", target))


def calls(text: str) -> Iterator[list[str]]:
    """The words of each command of a shell block."""
    for line in text.replace("\\\n", " ").splitlines():
        for command in re.split(r" && | \| ", re.sub(r"(^|\s)#.*", "", line)):
            if command.strip():
                yield shlex.split(command)


@pytest.fixture(scope="session")
def short_program(tmp_path_factory) -> Path:
    """A folder with a copy of the program whose runs are coarse and short by default."""
    folder = tmp_path_factory.mktemp("program")
    for name in ("snowrepro", "hydra_plugins", "experiments", "conf"):
        shutil.copytree(ROOT / name, folder / name, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
    for name, changes in SHORTER.items():
        replace(folder / "conf" / name, changes)
    for path in (folder / "experiments").glob("*.yaml"):
        text = path.read_text(encoding="utf-8")
        shown = re.sub(r"(?m)^  frames: \[\d.*?\]", lambda found: f"  frames: {FRAMES[found[0].count(',') + 1]}", text)
        path.write_text(shown, encoding="utf-8")
    return folder


def replace(path: Path, changes: dict[str, str]) -> None:
    text = path.read_text(encoding="utf-8")
    for old, new in changes.items():
        text, count = re.subn(old, new, text)
        assert count, f"{old} is not in {path.name}"
    path.write_text(text, encoding="utf-8")


@pytest.fixture
def environment(short_program, tmp_path) -> dict[str, str]:
    """The environment of a reader: ``snowrepro`` and ``python`` are this program's."""
    programs = tmp_path / "bin"
    programs.mkdir()
    for name, words in (("snowrepro", "-m snowrepro "), ("python", "")):
        script = programs / name
        script.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {words}"$@"\n')
        script.chmod(0o755)
    path = f"{programs}{os.pathsep}{os.environ['PATH']}"
    return {**os.environ, "PATH": path, "PYTHONPATH": str(short_program), "MPLBACKEND": "agg"}


def run_page(page: Path, folder: Path, environment: dict[str, str]) -> None:
    """Run a page's blocks in order, from a folder on: where a block changes to another, the next ones are there."""
    place = folder.with_name(WORKING_FOLDER)
    place.write_text(str(folder))
    for block in blocks(page):
        here = Path(place.read_text().strip())
        if block.language == "yaml" and (named := FILE.match(block.text)):
            path = here / named[1]
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text, encoding="utf-8")
        if not block.is_run:
            continue
        how = ["bash", "-euo", "pipefail", "-c"] if block.language == "sh" else [sys.executable, "-c"]
        keep = f"\npwd > {shlex.quote(str(place))}\n" if block.language == "sh" else ""
        done = subprocess.run(
            [*how, block.text + keep], cwd=here, env=environment, capture_output=True, text=True, timeout=MOST_SECONDS,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip
        said = f"{name_of(page)}, line {block.line}:\n{block.text}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}"
        assert done.returncode == 0, said


ONE_PROGRAM = DOCS / "notebook.md"  # its blocks are the cells of a notebook, which tests/test_notebook.py runs
RUNNING = [page for page in PAGES if page != ONE_PROGRAM and any(block.is_run for block in blocks(page))]


@pytest.mark.nightly
@pytest.mark.parametrize("page", RUNNING, ids=name_of)
def test_every_example_runs(page, tmp_path, environment):
    """As it stands on the page, in an empty folder."""
    folder = tmp_path / "reader"
    folder.mkdir()
    run_page(page, folder, environment)


def list_in_order(page: Path) -> Iterator[Path]:
    """The pages that a page's tables of contents list, each followed by those of its own tables."""
    text = page.read_text(encoding="utf-8")
    for listed in TOCTREE.findall(text):
        for name in listed.split():
            path = page.parent / f"{name}.md"
            yield path
            yield from list_in_order(path)


def test_the_tables_of_contents_list_every_page():
    """Each once; the page itself, and that of the changes, are no part of them."""
    assert sorted([DOCS / "index.md", *list_in_order(DOCS / "index.md")]) == sorted(DOCS.rglob("*.md"))


@pytest.mark.nightly
def test_all_examples_run_in_one_folder(tmp_path, environment):
    """The README, then the documentation in its order, behind what ``make reproduce`` leaves."""
    folder = tmp_path / "reader"
    folder.mkdir()
    make = ["make", "--dry-run", "--old-file=.venv/installed", "BIN=.", "reproduce"]
    recipe = subprocess.run(make, cwd=ROOT, capture_output=True, text=True, check=True).stdout.replace("./snow", "snow")
    done = subprocess.run(["bash", "-euc", recipe], cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0 and (folder / "my_reports" / "paper" / "index.html").is_file(), done.stderr[-4000:]
    for page in (README, *list_in_order(DOCS / "index.md")):
        if page in RUNNING:
            run_page(page, folder, environment)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_what_is_not_run_says_why_and_calls_what_exists(page):
    """A reason, or the file it is from; targets of make, commands and options of snowrepro."""
    for block in blocks(page):
        if block.note.startswith("from "):
            source = (ROOT / block.note.removeprefix("from ")).read_text(encoding="utf-8")
            assert block.text in textwrap.dedent(source) or textwrap.indent(block.text, "    ") in source, block
        elif block.note:
            assert block.skipped, f"{name_of(page)}, line {block.line}: '{block.note}'"
        if block.language == "sh":
            assert [missing for words in calls(block.text) if (missing := unknown(words))] == []


def test_notes_stand_in_front_of_blocks():
    """None is lost, for example by a blank line."""
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        quoted = text.count("```text\n<!-- test: ")
        assert text.count("<!-- test: ") - quoted == sum(bool(block.note) for block in blocks(page)), name_of(page)


def test_the_readme_is_short():
    assert len(README.read_text(encoding="utf-8").splitlines()) <= MOST_LINES


@pytest.mark.parametrize("page", [*PAGES, ROOT / "CHANGELOG.md"], ids=name_of)
def test_links_lead_to_files(page):
    """Those that are relative."""
    missing = [
        target for target in targets(page) if (path := target.split("#")[0]) and not (page.parent / path).exists()
    ]
    assert missing == []


def settings_of(values: object, under: str = "") -> Iterator[str]:
    """Every setting that a configuration has, with its full name."""
    if isinstance(values, dict):
        for name, value in values.items():
            yield from settings_of(value, f"{under}.{name}" if under else name)
    else:
        yield under


@pytest.fixture
def generators(monkeypatch):
    """The scripts in docs/ that write pages."""
    monkeypatch.syspath_prepend(str(DOCS))
    import columns
    import commands
    import settings

    return settings, commands, columns


def test_the_page_of_settings_names_every_setting(generators):
    """Those of a fall, of a hardness test and of an experiment, and those of claims."""
    page = generators[0].page()
    config = compose(["indenter=disc", "experiment=hardness", "design=sobol"]).settings()
    claims = config["claims"].pop("list")
    expected = {*settings_of(config), *(f"claims.list[].{key}" for key in claims[0])}
    assert {name for name in expected if f"| `{name}` |" not in page} == set()


def test_the_page_of_settings_names_every_picture(generators):
    """With what each needs."""
    page = generators[0].page()
    assert {name for name in list_figure_names() if f"| `{name}` |" not in page} == set()
    assert (
        "| `setting` | Figure 4: the setting of a run, pressed and falling. | `frames` (2 of them) | falls | no |"
        in page
    )


def test_the_page_of_commands_names_every_command(generators):
    """And the options of one."""
    page = generators[1].page()
    for text in ("snowrepro run", "snowrepro bless", "`--against B`", "exit codes: 0 the same bits"):
        assert text in page


def test_the_page_of_numbers_explains_every_column(generators):
    """With what it means and its unit."""
    page = generators[2].page()
    assert {name for name in ALL_COLUMNS if f"| `{name}` | " not in page} == set()
    assert "| kg cell⁻¹ s⁻² | Pa |" in page and not re.search(r"\| *\|", page)


def test_skipped_blocks_are_few():
    """Most examples run; those that do not are listed by ``python -m tests.test_docs``."""
    found = [block for page in PAGES for block in blocks(page) if block.language in ("sh", "python")]
    assert sum(block.is_run for block in found) > 0.6 * len(found)


def main() -> None:
    """What of each page is run, and why something is not."""
    for page in PAGES:
        found = [*blocks(page)]
        if any(block.is_run or block.note for block in found):
            print(f"{name_of(page)}: {sum(block.is_run for block in found)} blocks are run")
        for block in found:
            if block.note:
                print(f"  line {block.line}: {block.note}")


if __name__ == "__main__":
    main()
