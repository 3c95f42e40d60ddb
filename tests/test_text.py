"""Text from data: nothing in it acts on a terminal."""

from hypothesis import given, settings
from hypothesis import strategies as st

from snowrepro.text import make_lines_printable, make_printable, quote, quote_all


@given(st.text(st.characters()))
@settings(deadline=None, max_examples=200, derandomize=True)
def test_what_is_shown_is_printable(text):
    """Every letter, lone surrogates too; what is printable stays as it is; only lines may break."""
    assert make_printable(text).isprintable()
    assert quote(text).isprintable()
    assert all(line.isprintable() for line in make_lines_printable(text).split("\n"))
    assert make_printable(make_printable(text)) == make_printable(text)
    make_printable(text).encode("utf-8")


def test_examples():
    assert make_printable("a\x1b[31m\r\n\u202e\udc80ü") == "a\\x1b[31m\\r\\n\\u202e\\udc80ü"
    assert make_lines_printable("a\nb\x07") == "a\nb\\x07"
    assert quote("x" * 1000) == f"'{'x' * 57}...'"
    assert quote_all("abc", most=2) == "'a', 'b', and 1 more"
