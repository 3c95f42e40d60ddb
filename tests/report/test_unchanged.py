"""A report is drawn again when something that it shows may have changed, and else not."""

import os
from pathlib import Path

import pytest

from snowrepro.composition.compose import compose
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


def test_inputs_change_with_all_that_a_report_is_drawn_from(tmp_path, monkeypatch):
    """Runs, what is asked of them, files of the store, own options; not what readers write beside a result."""
    monkeypatch.chdir(tmp_path)
    store = tmp_path / "runs"
    words = ["experiment=fig5", f"store={store}"]
    run = Run(compose(["pressure=500", *words]))

    def digest(run: Run = run) -> str | None:
        return digest_inputs([[run]], words, store)

    digests = [digest(), digest(Run(compose(["pressure=600", *words]))),
               digest(Run(compose(["pressure=500", "claims.alpha=0.01", *words])))]  # fmt: skip
    run.folder.mkdir(parents=True)
    (run.folder / "run.nc").write_text("1234")
    digests.append(digest())
    (run.folder / "summary.json").write_text("{}")
    assert digest() == digests[-1]
    os.utime(run.folder / "run.nc", (1, 1))
    digests.append(digest())
    (tmp_path / "conf").mkdir()
    (tmp_path / "conf" / "own.yaml").write_text("a: 1")
    digests.append(digest())
    assert digest() == digests[-1] and None not in digests
    assert len(set(digests)) == len(digests)


def test_nothing_is_known_while_somebody_works_on_a_run(tmp_path):
    run = Run(compose(["pressure=500", f"store={tmp_path}"]))
    held = lease.take(run.work)
    assert held and digest_inputs([[run]], [], tmp_path) is None
    held.release()
    assert digest_inputs([[run]], [], tmp_path) is not None
