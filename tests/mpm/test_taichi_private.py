"""What is changed inside Taichi: this fails first when the next version has moved it."""

import textwrap

import pytest
import taichi as ti
from taichi.lang.ast import ast_transformer_utils

from snowrepro.mpm import taichi_private


@ti.kernel
def wrong() -> ti.f64:
    some_long_name = 1.0 + 2.0 + 3.0 + 4.0 + 5.0 + 6.0 + 7.0
    return some_long_name + some_long_name + some_long_name + some_long_name + there_is_no_such_name  # noqa: F821


def message_of(kernel) -> str:
    with pytest.raises(ti.TaichiNameError) as caught:
        kernel()
    return str(caught.value)


def test_a_message_quotes_whole_lines(taichi, monkeypatch):
    """All that Taichi's own says, which breaks lines and loses the ends of some; and where."""
    whole = message_of(wrong)
    monkeypatch.setattr(ast_transformer_utils, "TextWrapper", textwrap.TextWrapper)
    broken = message_of(wrong)
    assert f'File "{__file__}", line 15, in wrong:' in whole
    assert f"    return {'some_long_name + ' * 4}there_is_no_such_name  # noqa: F821\n" in whole
    assert {word for word in broken.split() if "^" not in word} <= set(whole.split())


def test_taichi_looks_for_what_is_replaced():
    """Else the replacement would change nothing."""
    assert issubclass(ast_transformer_utils.TextWrapper, textwrap.TextWrapper)
    assert "TextWrapper" in ast_transformer_utils.ASTTransformerContext.get_pos_info.__code__.co_names
    taichi_private.leave_lines_unwrapped()
    assert ast_transformer_utils.TextWrapper is not textwrap.TextWrapper
