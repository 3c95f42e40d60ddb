"""A report as Markdown, to be read where the code is kept."""

import itertools
import re
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from ...store.files import published
from ..document import Block, Document, Fold, Heading, Pair, Picture, Section, Table, escape, format_cell, format_code

LEAST_QUOTED, MOST_QUOTED = 100, 300  # letters of a section's result in a list of contents
MOST_FOLDED, FIRST_FOLDED = 60, 20  # lines of a table or list that HTML hides until asked for; of more the first ones


def write_markdown(document: Document, path: Path) -> None:
    """Write the report to ``path``; its pictures lie beside it."""
    lines = [f"# {escape(document.title)}", ""]
    for number, section in enumerate(document.sections):
        lines += _format_section(section, headed=number > 0)
    _write_lines(lines, path)


def write_markdown_parts(document: Document, folder: Path) -> None:
    """Write a long report as a short ``index.md``, its summary and a list of contents, and a file for each section.

    The files lie in ``folder`` and are named by the sections' anchors; pictures lie beside it, as for one file.
    """
    summary, *parts = document.sections
    title = escape(document.title)
    contents = [f"- [{part.title}]({part.anchor}.md){_quote_result(part)}" for part in parts]
    _write_lines(
        [f"# {title}", "", *_format_section(summary, headed=False), "## Contents", "", *contents], folder / "index.md"
    )
    for part in parts:
        _write_lines([f"[{title}](index.md)", "", *_format_section(part, headed=True)], folder / f"{part.anchor}.md")


def _quote_result(section: Section) -> str:
    """Quote what a section begins with, behind its title in a list; cut where it is long, empty if it is no text."""
    first = section.blocks[0] if section.blocks else ""
    if not isinstance(first, str) or not first or "\n" in first:
        return ""
    text = re.sub(r"^\*\*((?:(?!\*\*).)+)\*\*$", r"\1", first)  # all of it bold
    if len(text) <= MOST_QUOTED or re.search(r"\*\*|`", text):  # a cut could leave bold or code open
        return f": {text}"
    end = max(text.rfind(sign, LEAST_QUOTED, MOST_QUOTED) for sign in ("; ", ". "))
    return f": {text[: end if end > 0 else text.rfind(' ', 0, MOST_QUOTED)]} ..."


def _write_lines(lines: Sequence[str], path: Path) -> None:
    """Write lines of Markdown into a file."""
    with published(path) as partial:
        partial.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")


def format_table(frame: pd.DataFrame) -> list[str]:
    """Format a table as lines of Markdown."""
    header = [str(column) for column in frame.columns]
    rows = [[format_cell(value) for value in row] for row in frame.itertuples(index=False)]
    return ["| " + " | ".join(cells) + " |" for cells in (header, ["---"] * len(header), *rows)]


def _format_section(section: Section, headed: bool) -> list[str]:
    """Format a section as lines of Markdown.  ``headed``: with its title."""
    lines = [f"## {section.title}", ""] if headed else []
    if section.paper_text:
        lines += [f"> The paper: {section.paper_text}", ""]
    lines += _format_blocks(section.blocks)
    if section.command:
        lines += [f"Redo: {format_code(section.command)}", ""]
    return lines


def _format_blocks(blocks: Sequence[Block]) -> list[str]:
    """Format several blocks as lines of Markdown."""
    return [line for block in blocks for line in _format_block(block)]


def _format_block(block: Block) -> list[str]:
    """Format a block as lines of Markdown, with an empty one behind."""
    if isinstance(block, Heading):
        return [f"### {block.text}", ""]
    if isinstance(block, Fold):
        return [f"#### {block.summary}", "", *_cut_long(_format_blocks(block.blocks))]
    if isinstance(block, Picture):
        source = f"*{block.source}.* " if block.source else ""
        return [f"![{block.alt}]({block.file})", "", f"{source}{block.caption}{_format_data_link(block.data)}", ""]
    if isinstance(block, Pair):
        pairs = zip(block.names, block.pictures, strict=True)
        return [line for name, picture in pairs for line in (f"**{name}**", "", *_format_block(picture))]
    if isinstance(block, Table):
        caption = f"{block.caption}{_format_data_link(block.data)}".strip()
        return [*format_table(block.frame), "", *([caption, ""] if caption else [])]
    return [block, ""]


def _cut_long(lines: Sequence[str]) -> list[str]:
    """Cut long tables and lists to their first lines: nobody reads the others here, and the HTML page has them."""
    single = [line for text in lines for line in text.split("\n")]
    kept: list[str] = []
    for mark, group in itertools.groupby(single, key=lambda line: line[:1]):
        rows = list(group)
        if mark not in ("|", "-") or len(rows) <= MOST_FOLDED:
            kept += rows
        else:
            kept += [*rows[:FIRST_FOLDED], "", f"The first of {len(rows)} lines; `index.html` has all.", ""]
    return kept


def _format_data_link(file: str) -> str:
    """Format the link to a file with data; empty without a file."""
    return f" Data: [{Path(file).name}]({file})." if file else ""
