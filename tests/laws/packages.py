"""The template package as if it were installed: a folder with its files and what an installer writes beside them."""

import shutil
import sys
from pathlib import Path

from snowrepro import own_law
from snowrepro.composition import own_options

TEMPLATE = Path(__file__).parents[2] / "docs" / "own_law"
ENTRY_POINTS = """[snowrepro.material]
plastic = snow_template.plastic:LAW
[snowrepro.sintering]
power_law = snow_template.power_law:LAW
"""


def place_template(folder: Path, version: str = "1.0", entry_points: str = ENTRY_POINTS, name: str = "snow-template"):
    """Put the template into a folder of packages, in place of what is there of it."""
    shutil.copytree(
        TEMPLATE / "snow_template",
        folder / "snow_template",
        dirs_exist_ok=True,
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    about = folder / f"{name.replace('-', '_')}.dist-info"
    about.mkdir(parents=True, exist_ok=True)
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    (about / "entry_points.txt").write_text(entry_points)
    forget_packages()


def forget_packages() -> None:
    """Look anew at what is installed, as a new process does."""
    cached_functions = (own_law.list_laws, own_law.identify_law, own_law.load_law, own_options.warn_of_hidden_laws)
    for cached in cached_functions:
        cached.cache_clear()
    for name in [name for name in sys.modules if name.partition(".")[0] == "snow_template"]:
        del sys.modules[name]
