"""The verbs of the command line: a file each, whose help costs nothing."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import snowrepro.cli
from snowrepro.cli.main import VERBS, build_parser

FOLDER = Path(snowrepro.cli.__file__).parent
HEAVY = ("taichi", "hydra", "omegaconf", "numpy", "pandas", "xarray", "pydantic", "matplotlib", "rich", "argcomplete")


def run_python(code: str) -> subprocess.CompletedProcess:
    """Run code in a process of its own, which has imported nothing."""
    return subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, timeout=120)


def test_each_verb_has_a_file_and_each_file_is_a_verb():
    """The table of ``main``, and what is in the folder."""
    assert {path.stem for path in (FOLDER / "verbs").glob("*.py")} == {"__init__", *VERBS}


@pytest.mark.parametrize("verb", VERBS)
def test_a_verb_has_what_main_asks_for(verb):
    """Its help, its arguments, its action, and a sentence on it; the parser knows the verb."""
    module = importlib.import_module(f"snowrepro.cli.verbs.{verb}")
    assert module.__doc__.startswith(f"``snowrepro {verb}``: ")
    assert isinstance(module.HELP, str)
    assert module.add_arguments.__doc__ and module.execute.__doc__
    with pytest.raises(SystemExit) as ended:
        build_parser([verb]).parse_args([verb, "--help"])
    assert ended.value.code == 0


@pytest.mark.parametrize("path", sorted(FOLDER.rglob("*.py")), ids=lambda path: path.relative_to(FOLDER).as_posix())
def test_imports_are_not_inside_functions(path):
    """What a file needs is seen at its top."""
    functions = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef)]
    inside = [
        node for function in functions for node in ast.walk(function) if isinstance(node, (ast.Import, ast.ImportFrom))
    ]
    assert inside == []


def test_no_help_imports_what_takes_seconds():
    """Every verb's arguments are there, and none of what its action needs."""
    done = run_python(
        "import sys; from snowrepro.cli.main import build_parser; build_parser()"
        f"\nprint([name for name in {HEAVY} if name in sys.modules])"
    )
    assert done.stdout == "[]\n", done.stderr


def test_a_stand_in_becomes_its_module_when_it_is_used():
    """It leaves no trace for others, has what the module has, and gives nothing before."""
    done = run_python(
        "import sys; from snowrepro.cli.deferred import deferred_imports"
        "\nwith deferred_imports():"
        "\n    from snowrepro.store import files"
        "\n    try:"
        "\n        from snowrepro.settings.case import Case"
        "\n    except ImportError as error:"
        "\n        print(error)"
        "\nprint([name for name in sys.modules if name.startswith(('snowrepro.store.', 'snowrepro.settings.'))])"
        "\nprint(files.require_writable.__module__, 'snowrepro.store.files' in sys.modules)"
    )
    told = "take 'Case' out of snowrepro.settings.case when it is used: import the module"
    assert done.stdout == f"{told}\n[]\nsnowrepro.store.files True\n", done.stderr


def test_what_is_imported_is_not_looked_through_for_garbage():
    """Neither during the import nor later; all else is, as ever."""
    done = run_python(
        "import gc; from snowrepro.cli.deferred import deferred_imports"
        "\nwith deferred_imports():"
        "\n    from snowrepro.settings import case"
        "\ngc.set_threshold(1)"
        "\nbefore = gc.get_stats()"
        "\ncase = case.Case"
        "\nprint(sum(new['collections'] - old['collections'] for old, new in zip(before, gc.get_stats())) < 100)"
        "\nprint(gc.get_freeze_count() > 10_000, gc.isenabled())"
    )
    assert done.stdout == "True\nTrue True\n", done.stderr


def test_no_verb_gives_the_help(snowrepro):
    """All verbs, as ``--help`` gives them."""
    done = snowrepro()
    assert (done.returncode, done.stderr) == (0, "")
    for verb, summary in VERBS.items():
        assert verb in done.stdout and summary in done.stdout


@pytest.mark.parametrize("words", [["rnu"], ["status", "--lsit"], ["redo", "a", "b"], ["clean", "--store"]])
def test_wrong_words_are_refused(snowrepro, tmp_path, words):
    """By argparse, in its way."""
    done = snowrepro(*words)
    assert done.returncode == 2
    assert done.stderr.startswith("usage: snowrepro") and "error: " in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_overrides_may_stand_around_options(snowrepro):
    """Argparse stops at the option; the overrides behind it count as well."""
    done = snowrepro("plan", "pressure=500,900", "-m", "sintering=none", "--list", "fidelity=preview")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("2 runs, 0 of them done")
    assert done.stdout.count("-none-preview-0-") == 2


def test_version(snowrepro):
    """The program's name and a number."""
    done = snowrepro("--version")
    assert done.returncode == 0
    assert done.stdout.startswith("snowrepro")
