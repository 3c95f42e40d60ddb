"""Small changes of a Python file, as a careless hand would make them, found by its syntax tree and made in its text.

Kernels are compiled from their text, so that a change in memory would not reach them.
"""

import ast
from collections.abc import Callable, Iterator
from dataclasses import dataclass

ARITHMETIC = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.Pow: ("**", "*")}
COMPARISONS = {
    ast.Lt: ("<", ("<=", ">=")), ast.LtE: ("<=", ("<", ">")), ast.Gt: (">", (">=", "<=")), ast.GtE: (">=", (">", "<")),
    ast.Eq: ("==", ("!=",)), ast.NotEq: ("!=", ("==",)), ast.Is: ("is", ("is not",)), ast.IsNot: ("is not", ("is",)),
    ast.In: ("in", ("not in",)), ast.NotIn: ("not in", ("in",)),
}  # fmt: skip
PAIRS = (
    ("min", "max"), ("minimum", "maximum"), ("argmin", "argmax"), ("fmin", "fmax"), ("nanmin", "nanmax"),
    ("sin", "cos"), ("floor", "ceil"), ("any", "all"), ("zeros", "ones"), ("first", "last"), ("row", "column"),
    ("sum", "max"),
)  # fmt: skip
TWINS = {one: other for pair in PAIRS for one, other in (pair, pair[::-1])} | {"max": "min"}
# What has arguments whose order is no matter of a slip: types, and names as text.
NOT_SWAPPED = ("isinstance", "issubclass", "getattr", "hasattr", "setattr", "zip")

Replacement = tuple[int, int, str]  # of the bytes from .. to, by a text


@dataclass(frozen=True)
class Change:
    """One replacement in a file: whole lines, which stand there once, become others."""

    line: int  # the first that differs, from 1
    operator: str
    old: str
    new: str


@dataclass(frozen=True)
class Source:
    """The text of a file, and where its nodes are."""

    text: bytes
    starts: tuple[int, ...]  # byte at which each line begins

    def start(self, node: ast.AST) -> int:
        """Byte at which a node begins."""
        return self.starts[node.lineno - 1] + node.col_offset

    def end(self, node: ast.AST) -> int:
        """Byte after the end of a node."""
        return self.starts[node.end_lineno - 1] + node.end_col_offset

    def write(self, node: ast.AST) -> str:
        """The text of a node."""
        return self.text[self.start(node) : self.end(node)].decode()

    def replace_between(self, left: ast.AST, right: ast.AST, old: str, new: str) -> Iterator[Replacement]:
        """Replace a sign between two nodes."""
        at = self.text.find(old.encode(), self.end(left), self.start(right))
        if at >= 0:
            yield at, at + len(old), new


def find_changes(text: str) -> list[Change]:
    """Find all changes of the text of a file, in the order of its lines; ask ``says_something_else`` of each."""
    source = _make_source(text)
    changes = []
    for node in _walk(ast.parse(text)):
        for operator, find in OPERATORS.items():
            made = (_make_change(text, source, operator, replacement) for replacement in find(node, source))
            changes += [change for change in made if change]
    return sorted(changes, key=lambda change: (change.line, change.operator, change.new))


def says_something_else(text: str, change: Change) -> bool:
    """Whether a file is still Python after a change, and not the same in other words."""
    try:
        changed = ast.parse(text.replace(change.old, change.new))
    except SyntaxError:
        return False
    return ast.dump(changed) != ast.dump(ast.parse(text))


def _make_source(text: str) -> Source:
    starts = [0]
    for line in text.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    return Source(text.encode(), tuple(starts))


def _make_change(text: str, source: Source, operator: str, replacement: Replacement) -> Change | None:
    """Make whole lines of a replacement, with lines before them until they stand once; None where they never do."""
    begin, end, new = replacement
    first = max(i for i, at in enumerate(source.starts) if at <= begin)
    after = source.text.find(b"\n", end)
    for top in range(first, -1, -1):
        head = source.text[source.starts[top] : begin].decode()
        tail = source.text[end:after].decode()
        old = source.text[source.starts[top] : after].decode()
        if text.count(old) == 1:
            return Change(first + 1, operator, old, head + new + tail)
    return None


def _walk(node: ast.AST) -> Iterator[ast.AST]:
    """All nodes below one that compute: no types, decorators, messages, imports, texts or assertions."""
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "type_params"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.Raise):
                yield child
            elif isinstance(child, ast.AST) and not isinstance(child, (ast.JoinedStr, ast.Import, ast.Assert)):
                yield from _walk(child)


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))


def change_arithmetic(node: ast.AST, source: Source) -> Iterator[Replacement]:
    """+ and -, * and /, a power as a product; not in paths and texts."""
    if not isinstance(node, ast.BinOp) or _is_text(node.left) or _is_text(node.right):
        return
    if type(node.op) in ARITHMETIC:
        yield from source.replace_between(node.left, node.right, *ARITHMETIC[type(node.op)])


def change_comparison(node: ast.AST, source: Source) -> Iterator[Replacement]:
    """The bound itself, and the other side."""
    if isinstance(node, ast.Compare):
        for left, op, right in zip([node.left, *node.comparators], node.ops, node.comparators, strict=False):
            old, others = COMPARISONS[type(op)]
            for new in others:
                yield from source.replace_between(left, right, old, new)


def change_logic(node: ast.AST, source: Source) -> Iterator[Replacement]:
    """And and or, not, True and False, a condition turned round."""
    if isinstance(node, ast.BoolOp):
        old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        yield from source.replace_between(node.values[0], node.values[1], old, new)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield source.start(node), source.start(node.operand), ""
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield source.start(node), source.end(node), str(not node.value)
    if isinstance(node, (ast.If, ast.While, ast.IfExp)):
        yield source.start(node.test), source.end(node.test), f"(not ({source.write(node.test)}))"


def change_sign(node: ast.AST, source: Source) -> Iterator[Replacement]:
    """A minus that is forgotten."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield source.start(node), source.start(node.operand), ""


def change_number(node: ast.AST, source: Source) -> Iterator[Replacement]:
    """A number twice as large, a count or an index one larger."""
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        other = node.value + 1 if isinstance(node.value, int) else 2 * node.value or 1.0
        yield source.start(node), source.end(node), repr(other)


def change_index(node: ast.AST, source: Source) -> Iterator[Replacement]:
    """The other axis or column: 1 as 0 (0 as 1 is one larger)."""
    if isinstance(node, ast.Subscript):
        for index in [node.slice, *getattr(node.slice, "elts", [])]:
            if isinstance(index, ast.Constant) and index.value == 1:
                yield source.start(index), source.end(index), "0"
    if isinstance(node, ast.keyword) and node.arg == "axis" and getattr(node.value, "value", None) == 1:
        yield source.start(node.value), source.end(node.value), "0"


def change_function(node: ast.AST, source: Source) -> Iterator[Replacement]:
    """Its twin, such as the least in place of the largest."""
    if isinstance(node, ast.Call):
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if name in TWINS:
            yield source.end(node.func) - len(name), source.end(node.func), TWINS[name]


def swap_arguments(node: ast.AST, source: Source) -> Iterator[Replacement]:
    """The first two arguments of a call, the other way round."""
    if isinstance(node, ast.Call) and len(node.args) > 1 and source.write(node.func) not in NOT_SWAPPED:
        one, other = node.args[:2]
        if not isinstance(one, ast.Starred) and not isinstance(other, ast.Starred):
            between = source.text[source.end(one) : source.start(other)].decode()
            yield source.start(one), source.end(other), source.write(other) + between + source.write(one)


def drop_statement(node: ast.AST, source: Source) -> Iterator[Replacement]:
    """What is called, added, written to a place, raised or skipped, is not."""
    call = isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)
    place = isinstance(node, ast.Assign) and isinstance(node.targets[0], (ast.Subscript, ast.Attribute))
    if call or place or isinstance(node, (ast.AugAssign, ast.Raise, ast.Continue, ast.Break)):
        yield source.start(node), source.end(node), "pass"


OPERATORS: dict[str, Callable[[ast.AST, Source], Iterator[Replacement]]] = {
    "arithmetic": change_arithmetic,
    "comparison": change_comparison,
    "logic": change_logic,
    "sign": change_sign,
    "number": change_number,
    "index": change_index,
    "function": change_function,
    "arguments": swap_arguments,
    "statement": drop_statement,
}
