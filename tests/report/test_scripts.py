"""The viewer's files of JavaScript: modules on their own, and one script in a page."""

from pathlib import Path

from snowrepro.report.viewer import scripts

FOLDER = Path(scripts.__file__).parents[1] / "templates" / "viewer"


def imports(name: str) -> dict[str, set[str]]:
    """What a file imports, by the file it names."""
    found = scripts.IMPORTS.findall(scripts.read_source(name))
    return {file: {word.strip() for word in names.split(",") if word.strip()} for names, file in found}


def test_every_file_is_in_the_page():
    """None is forgotten; the last one starts the viewer."""
    assert sorted(scripts.FILES) == sorted(path.name for path in FOLDER.iterdir())
    assert scripts.FILES[-1] == "main.js"


def test_each_import_is_of_what_an_earlier_file_exports():
    """In one script a wrong import is not noticed, as all names are there: so it is looked for here."""
    for place, name in enumerate(scripts.FILES):
        for file, names in imports(name).items():
            assert file in scripts.FILES[:place], f"{name} imports from {file}"
            assert names <= set(scripts.EXPORTS.findall(scripts.read_source(file))), f"{name} imports from {file}"


def test_each_export_is_needed():
    """Some other file imports it."""
    exported = {(name, word) for name in scripts.FILES for word in scripts.EXPORTS.findall(scripts.read_source(name))}
    imported = {(file, word) for name in scripts.FILES for file, names in imports(name).items() for word in names}
    assert exported == imported


def test_the_page_imports_nothing():
    """All lines that only modules in files have are gone, and nothing else."""
    lines = scripts.join_scripts().splitlines()
    assert not [line for line in lines if line.startswith(("import", "export"))]
    own = [line.removeprefix("export ") for name in scripts.FILES for line in scripts.read_source(name).splitlines()]
    assert [line for line in lines if line and line[3:] not in scripts.FILES] == [
        line for line in own if line and not line.startswith("import ")
    ]
