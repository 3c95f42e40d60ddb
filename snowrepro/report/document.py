"""What a report consists of, before it becomes Markdown, HTML or JSON: sections of text, tables and pictures.

Text is Markdown (CommonMark), a paragraph or a list a string; what comes from data goes through ``plain``.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import pandas as pd


@dataclass(frozen=True)
class Picture:
    """A picture beside the report.

    ``file``: its name in the report's folder; ``alt``: what one would see, in words; ``caption``: how to read it, in
    Markdown; ``source``: the figure or equations of the paper that it belongs to; ``data``: the file in the folder
    that holds what is drawn.
    """

    file: str
    alt: str
    caption: str
    source: str = ""
    data: str = ""


@dataclass(frozen=True)
class Table:
    """Numbers or words in rows; text cells are Markdown.  ``data``: the file in the folder that holds them all."""

    frame: pd.DataFrame
    caption: str = ""
    data: str = ""


@dataclass(frozen=True)
class Pair:
    """Two pictures side by side, each with its name."""

    names: tuple[str, str]
    pictures: tuple[Picture, Picture]


@dataclass(frozen=True)
class Heading:
    """The head of what follows inside a section."""

    text: str


@dataclass(frozen=True)
class Fold:
    """What stands behind a line and is opened by those who want it."""

    summary: str
    blocks: "Sequence[Block]"


Block = str | Picture | Pair | Table | Heading | Fold


@dataclass(frozen=True)
class Findings:
    """What a picture module contributes: the body of a section, and its verdict in a sentence, for the screen too."""

    blocks: Sequence[Block]
    verdict: str


NOTHING = Findings((), "No run has a result.")


@dataclass(frozen=True)
class Section:
    """A part of a report.

    ``anchor``: its name in links; ``says``: what the paper says of it; ``redo``: the command that makes it again;
    ``runs``: the anchor of the list of runs that it was drawn from.
    """

    anchor: str
    title: str
    blocks: Sequence[Block]
    says: str = ""
    redo: str = ""
    runs: str = ""


@dataclass(frozen=True)
class Document:
    """A whole report; ``title`` is no Markdown; the first section is what one sees first."""

    title: str
    sections: Sequence[Section]


def plain(text: object) -> str:
    """Text from data, so that no letter of it means anything in Markdown."""
    return re.sub(r"([\\`*_{}\[\]()#+!|<>~&])", r"\\\1", str(text))


def code(text: object) -> str:
    """Text as code, whatever backticks it has."""
    longest = max(map(len, re.findall("`+", str(text))), default=0)
    fence = "`" * (longest + 1)
    return f"{fence} {text} {fence}" if longest else f"`{text}`"


def listed(lines: Sequence[str]) -> str:
    """A list, an item a line."""
    return "\n".join(f"- {line}" for line in lines)


def flat(blocks: Sequence[Block]) -> Iterator[Block]:
    """All blocks, those inside folds too."""
    for block in blocks:
        yield block
        if isinstance(block, Fold):
            yield from flat(block.blocks)


def moved(block: Block, folder: str) -> Block:
    """The same block where its files lie in ``folder``, as seen from the report."""
    if isinstance(block, str):
        return _links_moved(block, folder)
    if isinstance(block, Picture):
        data = block.data and f"{folder}/{block.data}"
        return replace(block, file=f"{folder}/{block.file}", data=data, caption=_links_moved(block.caption, folder))
    if isinstance(block, Pair):
        return replace(block, pictures=tuple(moved(picture, folder) for picture in block.pictures))
    if isinstance(block, Table):
        frame = block.frame.map(lambda cell: _links_moved(cell, folder) if isinstance(cell, str) else cell)
        return replace(block, frame=frame, data=block.data and f"{folder}/{block.data}")
    if isinstance(block, Fold):
        return replace(block, blocks=[moved(inner, folder) for inner in block.blocks])
    return block


def _links_moved(text: str, folder: str) -> str:
    """Markdown whose links to files beside it lead into ``folder``; other links and code stay."""
    return re.sub(r"(?<!\\)\]\((?![a-z]+:|[#/])", f"]({folder}/", text)


def shown(value: object) -> str:
    """A cell: floats with three significant digits, or whole from 1000 on; a dash for what is not there."""
    if not isinstance(value, float):
        return str(value)
    if value != value:
        return "-"
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"
