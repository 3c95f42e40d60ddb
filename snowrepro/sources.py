"""The source files that a module is made of: itself, and whatever of this package it imports, in turn.

What is kept beside a result is kept under a digest of these, so no list of files has to be kept by hand.
"""

import ast
import functools
import hashlib
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent
# What an error is called, where compiled kernels are kept and how lumps are put into words changes no number; and which
# compiler there is stands in the environment of a result.
NOT_DIGESTED = frozenset({"errors.py", "compiler.py", "mpm/home.py", "analysis/view.py"})


@functools.cache
def digests_of(module: str) -> dict[str, str]:
    """Each source file of a module, by its path in the package, with a digest of its text.

    ``module``: its name inside the package, such as ``simulation``.  Imports are followed without running them; those
    for type checkers alone are not, nor are the files of packages themselves, which hold a sentence each.
    """
    digests: dict[str, str] = {}
    waiting = [_file_of(module)]
    while waiting:
        path = waiting.pop()
        name = path.relative_to(PACKAGE).as_posix()
        if name in digests or name in NOT_DIGESTED:
            continue
        text = path.read_bytes()
        digests[name] = hashlib.sha256(text).hexdigest()[:16]
        waiting += _imported(text, path)
    return dict(sorted(digests.items()))


@functools.cache
def digest_of(module: str) -> str:
    """All source files of a module in one word."""
    text = "\n".join(f"{name} {digest}" for name, digest in digests_of(module).items())
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _file_of(module: str) -> Path:
    return PACKAGE.joinpath(*module.split(".")).with_suffix(".py")


@functools.cache
def _imported(text: bytes, path: Path) -> tuple[Path, ...]:
    """The package's own modules that a file imports, by relative imports, wherever in the file they stand."""
    return tuple(_read_imports(ast.parse(text), path))


def _read_imports(tree: ast.Module, path: Path) -> Iterator[Path]:
    """The files that ``_imported`` gives, from the parsed text."""
    for node in _walk_statements(tree):
        if isinstance(node, ast.ImportFrom) and node.level:
            module = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            candidates = [module, *(module / alias.name for alias in node.names)]
            yield from (file for each in candidates if (file := each.with_suffix(".py")).is_file())


def _walk_statements(block: ast.AST) -> Iterator[ast.stmt]:
    """All statements in a block, and in those in it, but for what is for type checkers; no expressions: they are most.

    What is neither holds statements: the handlers of a try, the cases of a match.
    """
    for node in ast.iter_child_nodes(block):
        if isinstance(node, ast.expr) or _is_for_types(node):
            continue
        if isinstance(node, ast.stmt):
            yield node
        yield from _walk_statements(node)


def _is_for_types(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
