"""Files, JSON and text that somebody else made: what is read, and what is refused with a reason."""

import html
import json
import os
import re
import subprocess
import sys
from typing import Literal, get_origin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snowrepro import foreign
from snowrepro.errors import ConfigError
from snowrepro.foreign import Unreadable
from snowrepro.report.document import escape, format_code
from snowrepro.report.page.html import render_inline, render_paragraphs
from snowrepro.settings.base import Settings
from snowrepro.settings.case import Shape
from snowrepro.text import make_cell, make_cells, make_printable

CIRCLE = {"kind": "circle", "radius": 3.0}


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "no JSON"), (b"[1]", "a list"), (b"1", "a number"), (b'"x"', "a text"), (b"null", "nothing"),
        (b"\xff\xfe", "UTF-8"), (b"\0" * 9, "no JSON"), (b'{"a": 1, "a": 2}', "key 'a' twice"),
        (b'{"a":' * 90 + b"1" + b"}" * 90, "too deeply"), (b'{"a":' * 50_000, "too deeply"),
        (b'{"a": [' + b"[]," * 3_000_000 + b"1]}", "too many lists"),
        (b'{"a": 1' + b"0" * 5000 + b"}", "cannot be read"),
    ],
)  # fmt: skip
def test_json_that_is_no_data_of_ours(tmp_path, content, reason):
    """One reason each, in bounded time."""
    path = tmp_path / "x.json"
    path.write_bytes(content)
    with pytest.raises(Unreadable, match=reason):
        foreign.read_json(path, foreign.MIB * 16)


def test_only_regular_files_of_a_bounded_size_are_read(tmp_path):
    """Neither links, nor folders, nor pipes or devices, which would be waited for; nor what is too large."""
    (tmp_path / "file").write_text("{}")
    (tmp_path / "link").symlink_to(tmp_path / "file")
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "large").touch()
    os.truncate(tmp_path / "large", 5 << 30)
    assert foreign.read_json(tmp_path / "file", 10) == {}
    for name, reason in (
        ("link", "is a link"), ("folder", "no regular file"), ("pipe", "no regular file"),
        ("large", "has 5,368,709,120 bytes, and may have 10"), ("file\0", "cannot be read"),
    ):  # fmt: skip
        with pytest.raises(Unreadable, match=reason):
            foreign.read_json(tmp_path / name, 10)
    with pytest.raises(FileNotFoundError):
        foreign.read_json(tmp_path / "none", 10)


def test_links_on_the_way_count_below_the_store_alone(tmp_path):
    """The store itself may be a link: whoever gives the command names it."""
    (tmp_path / "real" / "a").mkdir(parents=True)
    (tmp_path / "store").symlink_to(tmp_path / "real")
    (tmp_path / "real" / "b").symlink_to(tmp_path / "real" / "a")
    foreign.refuse_links(tmp_path / "store" / "a" / "x", tmp_path / "store")
    with pytest.raises(Unreadable, match="b is a link"):
        foreign.refuse_links(tmp_path / "store" / "b" / "x", tmp_path / "store")
    assert [entry.name for entry in foreign.list_own(tmp_path / "store", tmp_path / "store")] == ["a", "b"]
    assert foreign.list_own(tmp_path / "store" / "b", tmp_path / "store") == []


@given(st.text())
@settings(derandomize=True, deadline=None)
def test_no_text_reaches_a_terminal_raw(text):
    """Nothing of it moves the cursor or begins a line, and what can be seen stays."""
    shown = make_printable(text)
    assert shown.isprintable() and len(shown.splitlines()) <= 1
    assert not text.isprintable() or shown == text
    shown.encode("utf-8")


@given(st.text(st.sampled_from("ab1 `*_[]()<>!|#+-=.\\\n&:/\x1b"), max_size=30))
@settings(derandomize=True, deadline=None)
def test_no_text_is_taken_for_markdown(text):
    """It is shown letter by letter, in a paragraph of its own, in a list or as code."""
    plain = make_printable(re.sub(r"\s*[\r\n]\s*", " ", text))  # a line break is a blank
    shown = escape(text)
    assert "\n" not in shown and "\n" not in format_code(text)
    assert html.unescape(str(render_inline(shown))).split() == plain.split()
    if plain.strip() and not text.startswith("    "):  # which only a cell of a table can
        assert re.fullmatch(r"<p>[^<]*</p>\n", render_paragraphs(shown))


@given(st.text(st.sampled_from("=+-@\t\r\n ab1.e,;\"'"), max_size=12))
@settings(derandomize=True, deadline=None)
def test_no_cell_is_taken_for_a_formula(text):
    """Numbers that are written as text stay numbers."""
    cell = str(make_cell(text))
    is_number = cell.lstrip("+-").replace(".", "", 1).replace("e", "", 1).lstrip("-+").isdigit()
    assert is_number or cell.lstrip()[:1] not in {*"=+-@"}
    assert "\n" not in cell and "\t" not in cell


def test_numbers_and_plain_words_stay_in_a_table():
    pd = pytest.importorskip("pandas")
    table = pd.DataFrame({"n": [1.5, 2.0], "w": ["-1", "ball"], "f": ["=x", "@y"], "b": [True, False], 3: [None, "a"]})
    made = make_cells(table)
    assert made["n"].tolist() == [1.5, 2.0] and made["w"].tolist() == ["-1", "ball"]
    assert made["f"].tolist() == ["'=x", "'@y"] and made["b"].tolist() == [True, False]


GOOD = ["ball", "L", "si", "grid_units", "Schneeball ä", "3", "a.b", "x=1", "C1", "no-1", "名前", "a+b", "z~(1)"]
BAD = [
    "", ".", "..", "../x", "a/b", "a\\b", ".hidden", "-x", " x", "x ", "x.", "a\nb", "a\0b", "\x1b[2J", "a:b", "a*b",
    "a?b", 'a"b', "a<b", "a|b", "a'b", "${x}", "a$b", "CON", "nul", "com1.txt", "x" * 61, "=1+1", "@x", "a\u202eb",
    "a\u200bb",
]  # fmt: skip


@pytest.mark.parametrize("name", GOOD)
def test_names_that_a_folder_can_have(name):
    assert Shape.model_validate({"name": name, "outline": CIRCLE}).name == name


@pytest.mark.parametrize("name", BAD)
def test_names_that_not_every_system_takes(name):
    with pytest.raises(ValueError, match="a name becomes part of a folder's"):
        Shape.model_validate({"name": name, "outline": CIRCLE})


def test_every_section_with_a_name_requires_a_plain_one():
    """Whatever section is added later."""
    from snowrepro.settings.base import Name
    from snowrepro.settings.config import PARTS

    def sections(kind: type[Settings]):
        yield kind
        for field in kind.model_fields.values():
            for inner in (field.annotation, *getattr(field.annotation, "__args__", ())):
                if isinstance(inner, type) and issubclass(inner, Settings):
                    yield from sections(inner)

    all_sections = {section for part in PARTS.values() for section in sections(part)}
    free = (section for section in all_sections if "name" in section.model_fields)
    named = {section for section in free if get_origin(section.model_fields["name"].annotation) is not Literal}
    assert {section.__name__ for section in named} >= {"Shape", "Floor", "Sintering", "Fidelity", "Experiment"}
    validators = Name.__metadata__
    assert [s.__name__ for s in named if not {*validators} <= {*s.model_fields["name"].metadata}] == []


def test_names_together_fit_a_folder():
    from snowrepro.composition.compose import compose

    long = "n" * 60
    assert len(compose([f"shape.name={long}", f"floor.name={long}"]).case.shape.name) == 60
    with pytest.raises(ConfigError, match=r"have 2\d\d bytes together"):
        compose([f"shape.name={long}", f"floor.name={long}", f"sintering.name={long}", f"fidelity.name={long}"])


def test_a_name_that_leads_out_of_the_store_is_refused(snowrepro, tmp_path):
    """One line, exit code 2, and nothing is written anywhere."""
    done = snowrepro("run", "shape.name=../../x")
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "shape.name: a name becomes part" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_hydra_has_a_block_list():
    """Of what a configuration may not have it call."""
    code = "from hydra.utils import instantiate; instantiate({'_target_': 'os.system', '_args_': ['exit 0']})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode != 0 and "os.system" in done.stderr and "block" in done.stderr.lower(), done.stderr
    aliased = code.replace("os.system", "logging.os.system")
    assert subprocess.run([sys.executable, "-c", aliased], capture_output=True, timeout=120).returncode != 0


def test_json_of_ours_is_read_as_it_was_written(tmp_path):
    """NaN and long texts too."""
    content = {"a": [1.5, None, True, "ü" * 1000], "b": {"c": float("inf")}}
    (tmp_path / "x").write_text(json.dumps(content))
    assert foreign.read_json(tmp_path / "x", foreign.MIB) == content
