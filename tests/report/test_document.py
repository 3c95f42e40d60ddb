"""The content of a report and its forms: text from data stays text, links follow the files."""

import html
import re

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snowrepro.report.document import (
    Document,
    Fold,
    Pair,
    Picture,
    Section,
    Table,
    escape,
    format_code,
    format_list,
    relocate_block,
)
from snowrepro.report.page.html import link_data, render_inline, render_paragraphs
from snowrepro.report.page.markdown import MOST_QUOTED, write_markdown, write_markdown_parts

PRINTABLE = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"], include_characters=" "), max_size=40)


@given(PRINTABLE)
def test_text_from_data_comes_out_as_it_went_in(text):
    """Whatever letters Markdown or HTML give a meaning to."""
    shown = render_inline(f"x{escape(text)}x")
    assert html.unescape(shown) == f"x{text}x"
    assert "<" not in shown


@given(PRINTABLE)
def test_code_comes_out_as_it_went_in(text):
    """Backticks too."""
    shown = render_inline(format_code(f"x{text}x"))
    assert html.unescape(re.fullmatch("<code>(.*)</code>", shown)[1]) == f"x{text}x"


@given(st.text(st.characters()))
def test_text_from_data_is_one_printable_line(text):
    """Else it could begin a heading, a list or code of its own, or act on a terminal that shows the page."""
    assert escape(text).isprintable()
    assert format_code(text).isprintable()


def test_html_in_markdown_is_text_and_verdicts_have_a_class():
    """Neither elements nor scripts get through; the words of verdicts are marked for the eye."""
    assert render_paragraphs('<script>alert("x")</script> & <b>') == (
        "<p>&lt;script&gt;alert(&quot;x&quot;)&lt;/script&gt; &amp; &lt;b&gt;</p>\n"
    )
    assert "javascript:" not in render_inline("[x](javascript:alert)").replace("(javascript:alert)", "")
    assert render_inline("**NOT RUN** **REPRODUCED (by calibration, no test)**") == (
        '<strong class="not-run">NOT RUN</strong> '
        '<strong class="reproduced">REPRODUCED (by calibration, no test)</strong>'
    )


@pytest.mark.parametrize(
    ("text", "there"),
    [
        ("see [a](a.csv)", "see [a](../fig5/a.csv)"),
        ("see [a](#runs) and [b](https://b.example)", "see [a](#runs) and [b](https://b.example)"),
        (r"interval \[1, 2\](x)", r"interval \[1, 2\](x)"),
    ],
)
def test_links_follow_the_files(text, there):
    """Seen from another folder, in text, captions, cells, folds and pairs alike."""
    picture = Picture("p.png", "alt", text, data="p.csv")
    seen = Picture("../fig5/p.png", "alt", there, data="../fig5/p.csv")
    assert relocate_block(text, "../fig5") == there
    assert relocate_block(picture, "../fig5") == seen
    assert relocate_block(Pair(("A", "B"), (picture, picture)), "../fig5") == Pair(("A", "B"), (seen, seen))
    table = relocate_block(
        Fold("more", [Table(pd.DataFrame({"n": [1], "t": [text]}), data="t.csv")]), "../fig5"
    ).blocks[0]
    assert table.data == "../fig5/t.csv"
    assert table.frame.to_dict("list") == {"n": [1], "t": [there]}


def test_small_tables_travel_in_the_page_and_large_ones_beside_it(tmp_path):
    """So that the page stays small; what is not there has no link."""
    (tmp_path / "small.csv").write_text("a,b\n1,2\n")
    (tmp_path / "large.csv").write_text("1234567\n" * 10_000)
    assert link_data(tmp_path, "small.csv") == ("small.csv", "data:text/csv;base64,YSxiCjEsMgo=")
    assert link_data(tmp_path, "large.csv") == ("large.csv", "large.csv")
    assert link_data(tmp_path, "gone.csv") is None and link_data(tmp_path, "") is None


def test_markdown_has_everything(tmp_path):
    """Heads, what the paper says, pictures with data, tables, folds, and the command that redoes it."""
    table = Table(pd.DataFrame({"a": [0.12345, float("nan")], "b": ["x", "y"]}), "Numbers.", "t.csv")
    blocks = ["Text.", Picture("p.png", "What one sees", "How to read it.", "Fig. 5", "p.csv"), Fold("More", [table])]
    sections = [Section("s", "", []), Section("t", "Second", blocks, "Words.", "redo it")]
    write_markdown(Document("A * title", sections), tmp_path / "i.md")
    text = (tmp_path / "i.md").read_text()
    assert text.splitlines()[0] == r"# A \* title"
    parts = ["## Second", "> The paper: Words.", "![What one sees](p.png)", "#### More", "| 0.123 | x |", "| - | y |"]
    parts += ["*Fig. 5.* How to read it. Data: [p.csv](p.csv).", "Numbers. Data: [t.csv](t.csv).", "Redo: `redo it`"]
    for part in parts:
        assert part in text


def test_what_is_folded_and_long_is_cut(tmp_path):
    """In Markdown, where nothing is folded; short tables and what stands open stay whole."""
    long, short = (pd.DataFrame({"a": range(count)}) for count in (100, 10))
    listed = format_list([f"line {number}" for number in range(100)])
    folded = Fold("More", [Table(long), Table(short), listed])
    write_markdown(Document("T", [Section("s", "S", [folded, Table(long)])]), tmp_path / "index.md")
    before, after = (tmp_path / "index.md").read_text().split("line 0")
    assert before.count("| 5 |") == 2 and before.count("| 99 |") == 0 and "The first of 102 lines" in before
    assert "line 19" in after and "line 20" not in after and "| 99 |" in after


def test_a_long_report_is_a_short_page_and_linked_parts(tmp_path):
    """The first page has the summary and, for each part, a link and what the part begins with; long text is cut."""
    long = "; ".join(["a finding"] * 60)
    sections = [
        Section("summary", "Summary", ["All is well."]),
        Section("fig5", "Figure 5", ["**Six runs.**", Table(pd.DataFrame({"a": [1]}))]),
        Section("fig6", "Figure 6", ["**Not run.** `snowrepro run experiment=fig6` makes it."]),
        Section("laws", "Laws", [f"**{long}**"]),
        Section("cost", "Cost", [Table(pd.DataFrame({"b": [2]}))]),
    ]
    write_markdown_parts(Document("A report", sections), tmp_path)
    first = (tmp_path / "index.md").read_text()
    assert "All is well." in first and "| a |" not in first
    assert "- [Figure 5](fig5.md): Six runs.\n" in first
    assert "- [Figure 6](fig6.md): **Not run.** `snowrepro run experiment=fig6` makes it.\n" in first
    assert first.endswith("- [Cost](cost.md)\n")
    (quoted,) = [line for line in first.splitlines() if "laws.md" in line]
    assert quoted.endswith("a finding ...") and len(quoted) < MOST_QUOTED + 30
    assert {path.name for path in tmp_path.iterdir()} == {"index.md", "fig5.md", "fig6.md", "laws.md", "cost.md"}
    part = (tmp_path / "fig5.md").read_text()
    assert part.startswith("[A report](index.md)\n\n## Figure 5\n\n**Six runs.**") and "| a |" in part
