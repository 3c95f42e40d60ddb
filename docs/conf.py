"""Sphinx's configuration: Markdown pages, some of them completed from the program itself."""

import os
import re
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import columns  # noqa: E402
import commands  # noqa: E402
import settings  # noqa: E402

project = "snowrepro"
author = "The snowrepro maintainers"
copyright = f"{author}. Apache-2.0"
html_title = "snowrepro"
html_theme = "furo"
html_show_sphinx = False
html_show_sourcelink = False
html_copy_source = False
html_static_path = ["static"]
html_css_files = ["wide.css"]
extensions = ["myst_parser"]
myst_enable_extensions = ["attrs_inline"]
myst_heading_anchors = 4
nitpicky = True

# Where links to files outside docs/ lead, such as ../reports/fig5/index.md: to the repository where the pages are
# published (SNOWREPRO_FILES=https://github.com/OWNER/NAME/blob/COMMIT), else to the clone around build/docs.
FILES = os.environ.get("SNOWREPRO_FILES", "")
LINK = re.compile(r"(?<!!)(\[[^\]]*\])\(((?:\.\./)+[^)#\s]+)\)")
GENERATED = {"settings": settings.page, "commands": commands.page, "columns": columns.page}


def complete(app, docname: str, source: list[str]) -> None:
    """Add to a page what is generated, and lead its links to files outside docs/ out of the website."""
    text = source[0] + (GENERATED[docname]() if docname in GENERATED else "")
    source[0] = LINK.sub(lambda found: _outside(found, docname), text)


def _outside(found: re.Match, docname: str) -> str:
    """The link as one to the file, if it leads out of docs/; else as it is."""
    path = (HERE / docname).parent.joinpath(found[2]).resolve()
    if path.is_relative_to(HERE):
        return found[0]
    base = FILES or "/".join([".."] * (2 + docname.count("/")))
    return f"{found[1]}({base}/{path.relative_to(HERE.parent).as_posix()}){{.external}}"


def setup(app) -> dict[str, bool]:
    """Sphinx's hook."""
    app.connect("source-read", complete)
    return {"parallel_read_safe": True}
