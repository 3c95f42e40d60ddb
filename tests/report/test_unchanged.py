"""A report is drawn again when something that it shows may have changed, and else not."""

import os
from pathlib import Path

import pytest

from snowrepro.composition.compose import compose, list_option_files, option_files
from snowrepro.composition.experiments import CONF_DIR
from snowrepro.report.page.unchanged import STAMP, digest_inputs, draw_if_changed
from snowrepro.store import lease
from snowrepro.store.run import Run


class Drawing:
    """A report of one file, that counts how often it was drawn."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.count = folder, 0

    def draw(self) -> tuple[list[str], list[Path]]:
        """Write the file."""
        self.count += 1
        self.folder.mkdir(exist_ok=True)
        (self.folder / "index.html").write_text("page")
        return ["verdict: none"], [self.folder]

    def ask(self, inputs: str | None) -> bool:
        """Ask for the report; whether it was drawn."""
        lines, is_drawn = draw_if_changed(self.folder, inputs, self.draw)
        assert lines == ["verdict: none"]
        return is_drawn


@pytest.fixture
def drawing(tmp_path) -> Drawing:
    """A report that was drawn once, from the inputs "a"."""
    drawing = Drawing(tmp_path / "report")
    assert drawing.ask("a")
    return drawing


def test_what_did_not_change_is_not_drawn(drawing):
    assert not drawing.ask("a") and drawing.count == 1


@pytest.mark.parametrize("inputs", ["b", None])
def test_other_inputs_are_drawn(drawing, inputs):
    """None says that nobody knows, as somebody works on a run."""
    assert drawing.ask(inputs)
    assert drawing.ask("a")


@pytest.mark.parametrize("damage", ["change", "remove", "cut the stamp", "odd stamp"])
def test_a_report_that_is_not_whole_is_drawn(drawing, damage):
    page, stamp = drawing.folder / "index.html", drawing.folder / STAMP
    if damage == "change":
        page.write_text("other")
    elif damage == "remove":
        page.unlink()
    elif damage == "cut the stamp":
        stamp.write_text(stamp.read_text()[:40])
    else:
        stamp.write_text('{"inputs": "a", "files": [], "lines": {}}')
    assert drawing.ask("a") and page.read_text() == "page"


def test_a_drawing_that_failed_leaves_no_stamp(drawing):
    """The half-written report is not taken for a whole one."""

    def fail() -> tuple[list[str], list[Path]]:
        (drawing.folder / "index.html").write_text("half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        draw_if_changed(drawing.folder, "b", fail)
    assert drawing.ask("a") and drawing.ask("b")


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """A working folder with a store of one run, own options, a drawing that one names, and a copy of the program."""
    monkeypatch.chdir(tmp_path)
    texts = {
        "runs/a/run.nc": "1234",
        "conf/shape/flake.yaml": "name: flake\noutline: {kind: svg, file: my flake.svg, width: 3}\n",
        "experiments/stairs.yaml": "# @package _global_\nexperiment: {name: stairs}\n",
        "more/floor/far.yaml": "name: far\n",
        "my flake.svg": "<svg/>",
        "ball.svg": "<svg/>",
        "program/report.py": "x = 1",
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr("snowrepro.report.page.unchanged.PACKAGE", tmp_path / "program")
    return tmp_path


def digest(folder: Path, *more: str) -> str | None:
    """The digest of a report on the store of a folder."""
    words = ["experiment=fig5", f"hydra.searchpath=[file://{folder}/more]", "+shape.outline.file=ball.svg", *more]
    return digest_inputs(words, folder / "runs")


@pytest.mark.parametrize(
    "name", ["conf/shape/flake.yaml", "experiments/stairs.yaml", "more/floor/far.yaml", "my flake.svg", "ball.svg",
             "program/report.py", "runs/a/run.nc", "runs/.work/b/failure.json"]
)  # fmt: skip
@pytest.mark.parametrize("change", ["other text", "removed"])
def test_inputs_change_with_each_file_that_a_report_is_drawn_from(folder, name, change):
    """Options wherever they lie, drawings that they or the overrides name, the program, and runs, done or not."""
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text((folder / name).read_text() if (folder / name).exists() else "{}")
    before = digest(folder)
    assert before and digest(folder) == before
    if change == "removed":
        (folder / name).unlink()
    else:
        (folder / name).write_text("name: other\n# @package _global_")
    assert digest(folder) not in (before, None)


def test_inputs_change_with_what_is_asked_and_what_is_in_the_store(folder, monkeypatch):
    """Overrides, a new run, the time of a result, the environment where a setting is taken from it.

    What readers write beside a result is not among them.
    """
    digests = [digest(folder), digest(folder, "claims.alpha=0.01"), digest(folder, "seed=${oc.env:SEED}")]
    monkeypatch.setenv("SEED", "3")
    assert digest(folder) == digests[0]
    digests.append(digest(folder, "seed=${oc.env:SEED}"))
    (folder / "runs" / "b").mkdir()
    digests.append(digest(folder))
    (folder / "runs" / "a" / "summary.json").write_text("{}")
    assert digest(folder) == digests[-1]
    os.utime(folder / "runs" / "a" / "run.nc", (1, 1))
    digests.append(digest(folder))
    assert None not in digests and len(set(digests)) == len(digests)


def test_inputs_change_with_the_options_of_the_program(folder, monkeypatch):
    """An option file of the program is one of those that Hydra finds."""
    before = digest(folder)
    monkeypatch.setattr("snowrepro.report.page.unchanged.option_files", lambda words: option_files([]))
    assert digest(folder) != before
    assert CONF_DIR / "config.yaml" in list_option_files(option_files([]))


def test_nothing_is_known_while_somebody_works_on_a_run(tmp_path):
    run = Run(compose(["pressure=500", f"store={tmp_path}"]))
    held = lease.take(run.work)
    assert held and digest_inputs([], tmp_path) is None
    held.release()
    assert digest_inputs([], tmp_path) is not None
