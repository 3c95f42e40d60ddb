"""The bar: in a notebook as HTML, on a terminal as text, elsewhere nothing."""

import io
import sys
from types import SimpleNamespace

import pytest

from snowrepro import progress
from snowrepro.progress import show_progress


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.fixture
def displayed(monkeypatch):
    """A notebook whose cell shows these texts, one after the other; returns the list of them."""
    shown: list[str] = []
    handle = SimpleNamespace(update=shown.append)

    def display(text, display_id):
        shown.append(text)
        return handle

    shell = SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(display=display, HTML=str))
    monkeypatch.setattr(progress, "REDRAW_SECONDS", 0.0)
    return shown


def test_a_notebook_shows_a_bar_and_then_a_line(displayed, capfd):
    with show_progress("frame", 4) as update:
        for done in range(1, 5):
            update(done, 4)
    assert 'value="0" max="4"' in displayed[0] and "left" not in displayed[0]
    assert 'value="3" max="4"' in displayed[3] and "frame 3 of 4, about 0:00:00 left" in displayed[3]
    assert displayed[-1] == "frame 4 of 4, 0:00:00"
    assert capfd.readouterr() == ("", "")


def test_a_failure_leaves_the_bar_where_it_was(displayed):
    with pytest.raises(KeyboardInterrupt), show_progress("frame", 4) as update:
        update(2, 4)
        raise KeyboardInterrupt
    assert 'value="2" max="4"' in displayed[-1]


def test_a_terminal_shows_a_bar(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setenv("TERM", "xterm")
    with show_progress("frame", 4) as update:
        update(3, 4)
    assert "frame 3/4" in sys.stderr.getvalue()


@pytest.mark.parametrize("hidden", [False, True])
def test_elsewhere_there_is_nothing(monkeypatch, hidden):
    """In a file, and on a terminal if it is not wanted."""
    monkeypatch.setattr(sys, "stderr", Terminal() if hidden else io.StringIO())
    with show_progress("frame", 4, is_hidden=hidden) as update:
        update(3, 4)
    assert sys.stderr.getvalue() == ""
