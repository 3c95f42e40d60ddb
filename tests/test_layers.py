"""The rooms of the program and their order, read from its imports: nothing leans on what comes after it."""

import ast
import graphlib
from collections.abc import Iterator
from pathlib import Path

import pytest

import snowrepro

PACKAGE = Path(snowrepro.__file__).parent
ROOMS = (
    "errors", "compiler", "units", "quantities", "sources", "version", "text", "markup", "progress", "foreign",
    "settings", "own_law", "composition", "analysis", "physics", "scene", "laws", "mpm", "reference",
    "simulation", "point", "sintering_map", "rules", "store", "summary", "run", "sweep", "evidence", "report",
    "notebook", "checks", "cli",
)  # fmt: skip
ROOMS_OF_REPORT = ("document", "drawing", "sections", "figures", "viewer", "page", "film", "crate")
DOORS = ("snowrepro", "snowrepro.__main__")  # lead to the rooms, and are led to from none
Graph = dict[str, set[str]]  # the modules that each module imports


def read_modules(package: Path) -> dict[str, ast.Module]:
    """The modules of a package by their full names; a folder's is that of its ``__init__``."""
    found = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found[name] = ast.parse(path.read_text(encoding="utf-8"))
    return found


def imports_of(package: Path) -> Graph:
    """What each module imports of its package: anywhere in its file, and for type checkers too."""
    modules = read_modules(package)
    folders = {name for name in modules if package.parent.joinpath(*name.split(".")).is_dir()}

    def named(node: ast.AST, module: str) -> Iterator[str]:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parts = module.split(".")
            home = parts[: len(parts) - node.level + (module in folders)] if node.level else []
            base = ".".join([*home, *([node.module] if node.module else [])])
            full = (f"{base}.{alias.name}" for alias in node.names)
            yield from (name if name in modules else base for name in full)

    return {
        module: {name for node in ast.walk(tree) for name in named(node, module) if name in modules} - {module}
        for module, tree in modules.items()
    }


def leaning(graph: Graph, rooms: tuple[str, ...], within: str) -> list[str]:
    """Imports from a room into one that comes after it, in words."""
    place = {f"{within}.{room}": number for number, room in enumerate(rooms)}

    def room_of(module: str) -> int | None:
        return next((place[name] for name in place if module == name or module.startswith(f"{name}.")), None)

    return [
        f"{module} imports {other}"
        for module, others in sorted(graph.items())
        for other in sorted(others)
        if (here := room_of(module)) is not None and (there := room_of(other)) is not None and there > here
    ]


def cycle_in(graph: Graph) -> list[str]:
    """Modules that import one another in a ring; none if there is no ring."""
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return error.args[1]
    return []


@pytest.fixture(scope="module")
def graph() -> Graph:
    """The imports of the program, but for those of its doors."""
    return {name: others for name, others in imports_of(PACKAGE).items() if name not in DOORS}


def test_every_module_is_in_a_room(graph):
    """A new one has to be given its place."""
    assert {name.split(".")[1] for name in graph} == set(ROOMS)
    inside = {name.split(".")[2] for name in graph if name.startswith("snowrepro.report.")}
    assert inside == set(ROOMS_OF_REPORT)


def test_rooms_lean_on_those_before_them(graph):
    """Each module imports only from its own room and from rooms to the left."""
    assert leaning(graph, ROOMS, "snowrepro") == []


def test_the_rooms_of_the_report_lean_on_those_before_them(graph):
    """Inside ``report`` likewise."""
    assert leaning(graph, ROOMS_OF_REPORT, "snowrepro.report") == []


def test_no_modules_import_one_another(graph):
    """Not even through others, in a function, or for type checkers."""
    assert cycle_in(graph) == []


def test_nothing_imports_the_doors(graph):
    """What the package offers to users is for users: from inside it would be a way around all rooms."""
    assert [name for name, others in graph.items() if others & set(DOORS)] == []


def test_what_leans_the_wrong_way_is_noticed(tmp_path):
    """In every spelling of an import, wherever it stands; a ring of three; and nothing where all is well."""
    package = tmp_path / "house"
    (package / "cellar").mkdir(parents=True)
    texts = {
        "__init__.py": "",
        "roof.py": "from . import cellar\nfrom .cellar.wine import x\n",
        "cellar/__init__.py": "from .wine import x\n",
        "cellar/wine.py": "import os\nfrom typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from .. import roof\n",
        "cellar/late.py": "def late():\n    from ..roof import x\n",
        "cellar/plain.py": "import house.roof\n",
        "cellar/full.py": "from house import roof\n",
        "cellar/fine.py": "from . import wine\nfrom .wine import roof\n",
    }
    for name, text in texts.items():
        (package / name).write_text(text)
    found = imports_of(package)
    assert found["house.cellar"] == {"house.cellar.wine"} and "house.cellar.wine" in found["house.cellar.fine"]
    assert leaning(found, ("cellar", "roof"), "house") == [
        f"house.cellar.{name} imports house.roof" for name in ("full", "late", "plain", "wine")
    ]
    assert leaning(found, ("roof", "cellar"), "house") == [
        "house.roof imports house.cellar", "house.roof imports house.cellar.wine",
    ]  # fmt: skip
    assert set(cycle_in(found)) >= {"house.roof", "house.cellar.wine"}
    assert cycle_in({"a": {"b"}, "b": {"c"}, "c": set()}) == []
