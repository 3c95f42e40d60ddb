"""The parts of a report before it becomes Markdown, HTML or JSON: sections of text, tables and pictures.

Text is Markdown (CommonMark); one string is one paragraph or one list.  Text that comes from data must go through
``escape``.
"""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import pandas as pd

from ..text import make_printable


@dataclass(frozen=True)
class Picture:
    """A picture file in the folder of the report.

    ``file``: its name; ``alt``: a description for those who cannot see it; ``caption``: how to read it, in Markdown;
    ``source``: the figure or equations of the paper that it reproduces; ``data``: the file in the folder that holds the
    numbers drawn; ``narrow``: a picture file that a narrow screen shows before it; ``is_end_first``: whether a narrow
    screen, on which it scrolls, begins with its right end.
    """

    file: str
    alt: str
    caption: str
    source: str = ""
    data: str = ""
    narrow: str = ""
    is_end_first: bool = False


@dataclass(frozen=True)
class Table:
    """Numbers or words in rows; text cells are Markdown.  ``data``: the file in the folder with the whole table."""

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
    """A heading inside a section."""

    text: str


@dataclass(frozen=True)
class Fold:
    """Blocks that are hidden behind a line of text until the reader opens them."""

    summary: str
    blocks: "Sequence[Block]"


Block = str | Picture | Pair | Table | Heading | Fold


@dataclass(frozen=True)
class FigureContent:
    """What a figure contributes to a report.

    ``blocks``: the body of its section; ``verdict``: the result in a sentence, which is also printed on the screen.
    """

    blocks: Sequence[Block]
    verdict: str


NO_RESULT = FigureContent((), "No run has a result.")


@dataclass(frozen=True)
class Section:
    """A section of a report.

    ``anchor``: its name in links; ``paper_text``: what the paper says of the subject; ``command``: the command that
    makes the section again; ``runs``: the anchor of the list of runs that it was drawn from.
    """

    anchor: str
    title: str
    blocks: Sequence[Block]
    paper_text: str = ""
    command: str = ""
    runs: str = ""


@dataclass(frozen=True)
class Document:
    """A whole report.  ``title`` is not Markdown; the first section is the summary on top."""

    title: str
    sections: Sequence[Section]


def escape(text: object) -> str:
    """Escape text from data, so that no letter of it is taken for Markdown; it stays on its line."""
    escaped = re.sub(r"([\\`*_{}\[\]()#+!|<>~&])", r"\\\1", _put_on_one_line(text))
    return re.sub(r"^( *)(-(?=[-\s]|$)|=(?=[=\s]|$)|\d+(?=\.(\s|$)))", _escape_start, escaped)


def _escape_start(match: re.Match[str]) -> str:
    """Escape what would begin a list or underline a heading: a sign, or the point behind a number."""
    blanks, first = match[1], match[2]
    return f"{blanks}\\{first}" if first in "-=" else f"{blanks}{first}\\"


def _put_on_one_line(text: object) -> str:
    """Put text on one line, with a blank for each line break, in which every letter can be seen."""
    return make_printable(re.sub(r"\s*[\r\n]\s*", " ", str(text)))


def escape_cell(value: object) -> object:
    """Escape the value of a cell if it is text; return anything else as it is."""
    return escape(value) if isinstance(value, str) else value


def format_code(text: object) -> str:
    """Format text as inline code, also if it contains backticks."""
    code = _put_on_one_line(text)
    longest = max(map(len, re.findall("`+", code)), default=0)
    fence = "`" * (longest + 1)
    return f"{fence} {code} {fence}" if longest else f"`{code}`"


def format_list(lines: Sequence[str]) -> str:
    """Format lines as a Markdown list, one item for each line."""
    return "\n".join(f"- {line}" for line in lines)


def join_names(names: Sequence[str], last: str) -> str:
    """Join names as in a sentence: "C1, C2 and C3" with ``last`` = "and"; "none" if there are no names."""
    *first, end = names or ("none",)
    return f"{', '.join(first)} {last} {end}" if first else end


def walk_blocks(blocks: Sequence[Block]) -> Iterator[Block]:
    """Yield all blocks, those inside folds too."""
    for block in blocks:
        yield block
        if isinstance(block, Fold):
            yield from walk_blocks(block.blocks)


def relocate_block(block: Block, folder: str) -> Block:
    """Return the block with all links to files changed as if its files were in ``folder``.

    ``folder``: path from the report to the folder of the files.
    """
    if isinstance(block, str):
        return _relocate_links(block, folder)
    if isinstance(block, Picture):
        return relocate_picture(block, folder)
    if isinstance(block, Pair):
        first, second = block.pictures
        return replace(block, pictures=(relocate_picture(first, folder), relocate_picture(second, folder)))
    if isinstance(block, Table):
        frame = block.frame.map(lambda cell: _relocate_links(cell, folder) if isinstance(cell, str) else cell)
        return replace(block, frame=frame, data=block.data and f"{folder}/{block.data}")
    if isinstance(block, Fold):
        return replace(block, blocks=[relocate_block(inner, folder) for inner in block.blocks])
    return block


def relocate_picture(picture: Picture, folder: str) -> Picture:
    """Return the picture as if its files were in ``folder``; see ``relocate_block``."""
    file, data, narrow = (path and f"{folder}/{path}" for path in (picture.file, picture.data, picture.narrow))
    return replace(picture, file=file, data=data, narrow=narrow, caption=_relocate_links(picture.caption, folder))


def _relocate_links(text: str, folder: str) -> str:
    """Lead links to files beside the report into ``folder``; other links and code stay as they are."""
    return re.sub(r"(?<!\\)\]\((?![a-z]+:|[#/])", f"]({folder}/", text)


def format_cell(value: object) -> str:
    """Format the value of a cell as text.

    Floats have three significant digits, from 1000 on no decimals; NaN is a dash.
    """
    if not isinstance(value, float):
        return str(value)
    if math.isnan(value):
        return "-"
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"
