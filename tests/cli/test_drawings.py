"""Drawings on the command line: what cannot be read is one line and exit code 2, before anything is written."""

import json
from pathlib import Path

import pytest

from tests.composition.test_images import write_png_head

SHORT = ("fidelity=preview", "loading.press_frames=4", "loading.frames=8", "output.every=4")
YAML = "name: drawn\noutline: {{kind: {kind}, file: {file}, width: 60}}\n"


@pytest.mark.parametrize(
    ("file", "reason"),
    [
        ("text.svg", "shape.outline: text.svg: <text>: text is no outline: turn it into paths"),
        ("huge.png", "huge.png: it has too many pixels; at most 25,000,000 can be read"),
    ],
)
def test_what_cannot_be_read(snowrepro, tmp_path: Path, file, reason):
    """The file is named as the user named it."""
    (tmp_path / "conf/shape").mkdir(parents=True)
    kind = "svg" if file.endswith("svg") else "image"
    (tmp_path / "conf/shape/drawn.yaml").write_text(YAML.format(kind=kind, file=file))
    (tmp_path / "text.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"><text>snow</text></svg>')
    write_png_head(tmp_path / "huge.png", 60_000, 60_000)
    before = sorted(tmp_path.rglob("*"))
    told = snowrepro("run", "shape=drawn", "fidelity=preview")
    assert told.returncode == 2
    assert reason in told.stderr
    assert len(told.stderr.splitlines()) == 1
    assert sorted(tmp_path.rglob("*")) == before


def test_a_drawing_with_a_hole_is_recorded_as_corners(snowrepro, tmp_path: Path):
    """What a record holds is the polygon with its hole, not the file."""
    (tmp_path / "conf/floor").mkdir(parents=True)
    (tmp_path / "conf/floor/cave.yaml").write_text("name: cave\noutline: {kind: svg, file: cave.svg, width: 200}\n")
    cave = "M0 0H100V20H0ZM40 5H60V15H40Z"
    (tmp_path / "cave.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg"><path fill-rule="evenodd" d="{cave}"/></svg>'
    )
    told = snowrepro("run", "floor=cave", *SHORT)
    assert told.returncode == 0, told.stderr
    (manifest,) = tmp_path.glob("runs/*/manifest.json")
    outline = json.loads(manifest.read_text())["config"]["floor"]["outline"]
    assert outline["kind"] == "polygon"
    assert len(outline["rings"]) == 1
    assert set(outline) == {"kind", "centre", "radius", "points", "rings"}


def test_too_much_snow(snowrepro, tmp_path: Path):
    told = snowrepro("run", "shape.outline.radius=4000")
    assert told.returncode == 2
    assert "201,061,930 particles of shape 'ball', at most 2,000,000" in told.stderr
    assert len(told.stderr.splitlines()) == 1
    assert not list(tmp_path.iterdir())
