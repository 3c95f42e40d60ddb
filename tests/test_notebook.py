"""The notebook in docs/: made of its page, and every cell of it runs and shows what it should."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.test_docs import DOCS, environment, short_program  # noqa: F401 - fixtures

# Runs the cells of a notebook in one namespace, as a kernel does, and prints what each shows: its HTML, or its text.
KERNEL = """
import ast, json, sys

shown, names = [], {}
for cell in json.load(open(sys.argv[1], encoding="utf-8"))["cells"]:
    if cell["cell_type"] != "code":
        continue
    *before, last = ast.parse("".join(cell["source"])).body
    value = None
    if isinstance(last, ast.Expr):
        exec(compile(ast.Module(before, []), "cell", "exec"), names)
        value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    else:
        exec(compile(ast.Module([*before, last], []), "cell", "exec"), names)
    shown.append(value._repr_html_() if hasattr(value, "_repr_html_") else repr(value))
json.dump(shown, open(sys.argv[2], "w", encoding="utf-8"))
"""
# What stands in the output of each cell.
EXPECTED = (
    ".",  # the version
    "None",
    "data:image/png;base64,",
    "data:image/png;base64,",
    "xarray.DataArray",
    "Lumps, crushed and loose snow in frame 60",
    "Lumps, crushed and loose snow in frame 60",
    "data:image/gif;base64,",
    "4 runs: 4 done. What varies: pressure, sintering.",
    "data:image/png;base64,",
    "xarray.DataArray",
)


def test_the_notebook_is_made_of_its_page(monkeypatch):
    """``python docs/notebook.py`` has been called since the page was changed."""
    monkeypatch.syspath_prepend(str(DOCS))
    import notebook

    page = (DOCS / "notebook.md").read_text(encoding="utf-8")
    written = (DOCS / "notebook.ipynb").read_text(encoding="utf-8")
    assert written == notebook.make_notebook(page), "call: python docs/notebook.py"
    cells = json.loads(written)["cells"]
    assert sum(cell["cell_type"] == "code" for cell in cells) == page.count("```python") == len(EXPECTED)
    assert len({cell["id"] for cell in cells}) == len(cells)
    assert not any(cell.get("outputs") for cell in cells)


@pytest.mark.nightly
def test_every_cell_shows_what_it_should(tmp_path: Path, environment: dict):  # noqa: F811 - the fixture
    """In an empty folder, with runs that are coarse and short."""
    folder = tmp_path / "reader"
    folder.mkdir()
    output = tmp_path / "shown.json"
    done = subprocess.run(
        [sys.executable, "-c", KERNEL, str(DOCS / "notebook.ipynb"), str(output)],
        cwd=folder, env=environment, capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    shown = json.loads(output.read_text(encoding="utf-8"))
    missing = [(text, html[:500]) for text, html in zip(EXPECTED, shown, strict=True) if text not in html]
    assert missing == []
    assert len([path for path in (folder / "runs").iterdir() if path.name.startswith("ball")]) == 4
