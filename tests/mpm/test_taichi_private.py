"""What is changed inside Taichi: this fails first when the next version has moved it."""

import inspect
import re
import textwrap
from pathlib import Path

import pytest

from snowrepro.compiler import name_compiler, ti
from snowrepro.mpm import taichi_private

ast_transformer_utils = ti.lang.ast.ast_transformer_utils


@ti.kernel
def wrong() -> ti.f64:
    some_long_name = 1.0 + 2.0 + 3.0 + 4.0 + 5.0 + 6.0 + 7.0
    return some_long_name + some_long_name + some_long_name + some_long_name + there_is_no_such_name  # noqa: F821


def message_of(kernel) -> str:
    with pytest.raises(getattr(ti, f"{name_compiler().title()}NameError")) as caught:
        kernel()
    return str(caught.value)


def test_a_message_quotes_whole_lines(taichi, monkeypatch):
    """All that Taichi's own says, which breaks lines and loses the ends of some; and where."""
    whole = message_of(wrong)
    monkeypatch.setattr(ast_transformer_utils, "TextWrapper", textwrap.TextWrapper)
    broken = message_of(wrong)
    assert f'File "{__file__}", line 19, in wrong:' in whole
    assert f"    return {'some_long_name + ' * 4}there_is_no_such_name  # noqa: F821\n" in whole
    assert {word for word in broken.split() if "^" not in word} <= set(whole.split())


@ti.kernel
def compute(a: ti.f64, b: ti.f64, c: ti.f64) -> ti.types.vector(5, ti.f64):
    both = ti.Vector([a, c]) / b
    matrix = ti.Matrix([[a, b], [c, a]])
    return ti.Vector([a * b + c, a / 3.0, both[0] + both[1], a**2 + b, (matrix @ matrix)[0, 1]])


@ti.kernel
def add_to_square(a: ti.f64, b: ti.f64) -> ti.f64:
    return a**2 + b  # alone: beside others the compiler may hide it in a vector


def find_rearrangeable(folder: Path) -> list[str]:
    """Operations of the optimised kernels in a folder that a compiler might combine: a sum of a product, or a quotient
    whose divisor is another's too.
    """
    found = []
    for path in folder.glob("*.ll"):
        products, divisors = set(), set()
        for line in path.read_text().splitlines():
            if line.startswith("define"):
                products, divisors = set(), set()
            parts = re.match(r"\s*(%\S+) = (fmul|fadd|fsub|fdiv) (?:<.*> |double )(\S+), (\S+)", line)
            if not parts:
                continue
            name, operation, *operands = parts.groups()
            if operation == "fmul":
                products.add(name)
            elif operation == "fdiv":
                if operands[1] in divisors or not operands[1].startswith("%"):
                    found.append(line)
                divisors.add(operands[1])
            elif products & {*operands}:
                found.append(line)
    return found


def test_products_and_quotients_are_kept_apart(tmp_path, monkeypatch):
    """As for a GPU: no sum of a product, no shared divisor is left to the compiler, and the numbers are the same."""
    answers, found = {}, {}
    for is_needed in (False, True):
        folder = tmp_path / str(is_needed)
        folder.mkdir()
        monkeypatch.chdir(folder)
        ti.init(ti.cpu, default_fp=ti.f64, fast_math=False, offline_cache=False, print_kernel_llvm_ir_optimized=True)
        taichi_private.round_each(is_needed)
        try:
            answers[is_needed] = [
                (*compute(x, 0.1 + x, 1 / x).to_list(), add_to_square(x, 1 / x)) for x in (0.3, 7.1, 1e9)
            ]
        finally:
            taichi_private.round_each(False)
        found[is_needed] = find_rearrangeable(folder)
    assert answers[True] == answers[False]
    assert len(found[False]) >= 5
    assert not found[True]


def test_taichi_looks_for_what_is_replaced():
    """Else the replacement would change nothing."""
    assert issubclass(ast_transformer_utils.TextWrapper, textwrap.TextWrapper)
    assert "TextWrapper(" in inspect.getsource(ast_transformer_utils)
    taichi_private.leave_lines_unwrapped()
    assert ast_transformer_utils.TextWrapper is not textwrap.TextWrapper
