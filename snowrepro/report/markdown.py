"""A report as Markdown, for those who read it beside the code."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from ..store.files import published
from .document import Block, Document, Fold, Heading, Pair, Picture, Section, Table, plain, shown


def write(document: Document, path: Path) -> None:
    """Write the report's text; its pictures lie beside."""
    lines = [f"# {plain(document.title)}", ""]
    for number, section in enumerate(document.sections):
        lines += _section(section, headed=number > 0)
    with published(path) as partial:
        partial.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")


def table(frame: pd.DataFrame) -> list[str]:
    """The lines of a table."""
    header = [str(column) for column in frame.columns]
    rows = [[shown(value) for value in row] for row in frame.itertuples(index=False)]
    return ["| " + " | ".join(cells) + " |" for cells in (header, ["---"] * len(header), *rows)]


def _section(section: Section, headed: bool) -> list[str]:
    lines = [f"## {section.title}", ""] if headed else []
    if section.says:
        lines += [f"> The paper: {section.says}", ""]
    lines += _blocks(section.blocks)
    if section.redo:
        lines += [f"Redo: `{section.redo}`", ""]
    return lines


def _blocks(blocks: Sequence[Block]) -> list[str]:
    return [line for block in blocks for line in _block(block)]


def _block(block: Block) -> list[str]:
    """The lines of a block and an empty one behind."""
    if isinstance(block, Heading):
        return [f"### {block.text}", ""]
    if isinstance(block, Fold):
        return [f"#### {block.summary}", "", *_blocks(block.blocks)]
    if isinstance(block, Picture):
        source = f"*{block.source}.* " if block.source else ""
        return [f"![{block.alt}]({block.file})", "", f"{source}{block.caption}{_data(block.data)}", ""]
    if isinstance(block, Pair):
        named = zip(block.names, block.pictures, strict=True)
        return [line for name, picture in named for line in (f"**{name}**", "", *_block(picture))]
    if isinstance(block, Table):
        caption = f"{block.caption}{_data(block.data)}".strip()
        return [*table(block.frame), "", *([caption, ""] if caption else [])]
    return [block, ""]


def _data(file: str) -> str:
    return f" Data: [{Path(file).name}]({file})." if file else ""
