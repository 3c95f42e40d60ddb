"""Write docs/notebook.ipynb from the page docs/notebook.md: ``python docs/notebook.py``."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

PAGE = Path(__file__).with_suffix(".md")
CODE = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def make_notebook(text: str) -> str:
    """Make a notebook of a page: its blocks of Python are cells of code, what is between them is text."""
    cells = [{"id": f"cell-{number:02d}", **cell} for number, cell in enumerate(_make_cells(text), 1)]
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    metadata = {"kernelspec": kernel, "language_info": {"name": "python"}}
    content = {"cells": cells, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def _make_cells(text: str) -> Iterator[dict[str, Any]]:
    """Make the cells, without outputs."""
    for number, part in enumerate(CODE.split(text)):
        source = part.strip().splitlines(keepends=True)
        if source and number % 2:
            yield {"cell_type": "code", "execution_count": None, "metadata": {}, "outputs": [], "source": source}
        elif source:
            yield {"cell_type": "markdown", "metadata": {}, "source": source}


if __name__ == "__main__":
    PAGE.with_suffix(".ipynb").write_text(make_notebook(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
