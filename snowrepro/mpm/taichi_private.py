"""All that is changed inside Taichi, or inside Quadrants by the same names, which their next version may move.

``tests/mpm/test_taichi_private.py`` fails first when one has.
"""

import textwrap
from typing import Any

from ..compiler import name_compiler, ti

HUGE = 1e30  # beyond what any sound quantity reaches, within what f32 holds
ops, Expr = ti.lang.ops, ti.lang.expr.Expr
_multiply, _divide, _raise = ops.mul, ops.truediv, ops.pow


class _Unwrapped(textwrap.TextWrapper):
    """Leaves each line of text as long as it is."""

    def wrap(self, text: str) -> list[str]:
        """The text as one line; none where it is blank."""
        return [text.rstrip()] if text.strip() else []


def find_program() -> Any:
    """What kernels are compiled for and run in; None before the compiler has started, where Quadrants would raise."""
    return vars(ti.lang.impl.get_runtime())["_prog" if name_compiler() == "quadrants" else "prog"]


def leave_lines_unwrapped() -> None:
    """Have Taichi quote source lines in its messages as they stand, instead of at most 80 letters a line.

    It prepares a message for each expression of each kernel that it compiles, and wrapping these takes more than a
    third of the time that a coarse run takes.
    """
    ti.lang.ast.ast_transformer_utils.TextWrapper = _Unwrapped


def round_each(is_needed: bool) -> None:
    """Have kernels round each product and each quotient as they stand, or leave that to the compiler again.

    For CUDA Taichi marks every function as one whose arithmetic may be rearranged, with fast math or without it: in a *
    b + c the product is not rounded, x / 3 becomes x times 1/3, and of two quotients by one number both become
    products with its inverse.  Results then differ from those of a CPU.  So that the compiler does not see what is
    combined with what, a product passes a selection that always takes it unless it is no number; and so does a divisor.
    """
    ops.mul = multiply_rounded if is_needed else _multiply
    ops.truediv = divide_rounded if is_needed else _divide
    ops.pow = raise_rounded if is_needed else _raise


def multiply_rounded(a: Any, b: Any) -> Any:
    """The product of two numbers, vectors or matrices; where it is no number, their sum, which is then not finite."""
    product = _multiply(a, b)
    return ops.select(ops.cmp_eq(product, product), product, ops.add(a, b)) if _is_real(product) else product


def divide_rounded(a: Any, b: Any) -> Any:
    """The quotient of two numbers, vectors or matrices; not finite where the dividend is none or beyond all bounds."""
    return _divide(a, ops.select(ops.cmp_lt(a, HUGE), b, 0.0)) if _is_real(a) else _divide(a, b)


def raise_rounded(base: Any, exponent: Any) -> Any:
    """A power; a square is a product."""
    return multiply_rounded(base, base) if _is_real(base) and exponent == 2 else _raise(base, exponent)


def _is_real(value: Any) -> bool:
    """Whether a value of a kernel is a real number, or a vector or matrix of such."""
    return isinstance(value, Expr) and "f" in value.ptr.get_rvalue_type().element_type().to_string()
