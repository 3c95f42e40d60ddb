"""The viewer's JavaScript files, joined to one script that the page contains.

In templates/viewer the files are modules: each states what it imports, and a linter can check that.  A page of one
file cannot import, so there the files follow one another in one module, without the lines that import and export.
"""

import re
from importlib.resources import files

# Each after those that it imports from; main.js starts the viewer.
FILES = (
    "elements.js", "times.js", "unpack.js", "paint.js", "draw.js", "controls.js", "legend.js", "tables.js", "player.js",
    "panes.js", "main.js",
)  # fmt: skip
IMPORTS = re.compile(r'^import \{([^}]*)\} from "\./([^"]+)";\n', re.MULTILINE)
EXPORTS = re.compile(r"^export (?=(?:async )?(?:function|class|const) ([\w$]+))", re.MULTILINE)


def read_source(name: str) -> str:
    """Read a script as it is written."""
    return (files("snowrepro.report") / "templates" / "viewer" / name).read_text(encoding="utf-8")


def join_scripts() -> str:
    """Join all scripts for an element <script type="module">; the browser reports names that are given twice."""
    return "\n".join(f"// {name}\n{EXPORTS.sub('', IMPORTS.sub('', read_source(name)))}" for name in FILES)
