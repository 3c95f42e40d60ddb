"""What a report consists of, before it becomes Markdown, HTML or JSON: sections of text, tables and pictures.

Text is Markdown (CommonMark), in one paragraph or list a string; what comes from data goes through ``plain``.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

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
class Heading:
    """The head of what follows inside a section."""

    text: str


@dataclass(frozen=True)
class Fold:
    """What stands behind a line and is opened by those who want it."""

    summary: str
    blocks: "Sequence[Block]"


Block = str | Picture | Table | Heading | Fold


@dataclass(frozen=True)
class Findings:
    """What a picture module contributes: the body of a section, and its verdict in a sentence, for the screen too."""

    blocks: Sequence[Block]
    verdict: str


def plain(text: object) -> str:
    """Text from data, so that no letter of it means anything in Markdown."""
    return re.sub(r"([\\`*_{}\[\]()#+!|<>~&])", r"\\\1", str(text))
