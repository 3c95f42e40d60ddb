"""A report as one HTML file that needs nothing beside it: pictures, style and viewer are inside."""

import base64
import io
import re
from pathlib import Path

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup
from PIL import Image

from ..store.files import published
from .document import Document, Table, shown
from .viewer import Viewer

COLOURS = 64  # of an embedded picture
PROSE = 60  # letters from which a cell is to be read as text
MOST_EMBEDDED = 12_000  # bytes of a table that travels inside the page
WORDS = re.compile(r"<strong>(REPRODUCED|CONTRADICTED|INCONCLUSIVE|NOT RUN|missing)")

_markdown = MarkdownIt("commonmark", {"html": False})


def write(document: Document, path: Path, viewer: Viewer | None = None) -> None:
    """Write the page; the pictures and tables that it shows lie in its folder or beside it."""
    loader, folder = PackageLoader(__package__), path.parent
    options = {"undefined": StrictUndefined, "trim_blocks": True, "lstrip_blocks": True}
    environment = Environment(loader=loader, autoescape=True, **options)
    environment.filters |= {"paragraphs": paragraphs, "inline": inline}
    environment.globals |= {
        "kind": lambda block: type(block).__name__ if not isinstance(block, str) else "str",
        "source_of": lambda name: Markup(loader.get_source(environment, name)[0]),
        "embedded": lambda picture: embedded(folder / picture.file),
        "size": lambda picture: size(folder / picture.file),
        "data_of": lambda block: data_link(folder, block.data),
        "cells": cells,
        "zip": zip,
    }
    page = environment.get_template("report.html.j2").render(document=document, viewer=viewer)
    with published(path) as partial:
        partial.write_text(page, encoding="utf-8")


def paragraphs(text: str) -> Markup:
    """Markdown as HTML; HTML in it comes out as text."""
    return _marked(_markdown.render(text))


def inline(text: str) -> Markup:
    """Markdown of one line, without a paragraph around it."""
    return _marked(_markdown.renderInline(text))


def _marked(html: str) -> Markup:
    """With a class on the words of verdicts."""
    return Markup(WORDS.sub(lambda m: f'<strong class="{m[1].lower().replace(" ", "-")}">{m[1]}', html))


def cells(table: Table) -> list[list[tuple[Markup, str]]]:
    """Rows of cells as HTML, each with its class: number, prose, or none."""
    return [[(inline(shown(value)), _class(value)) for value in row] for row in table.frame.itertuples(index=False)]


def _class(value: object) -> str:
    if isinstance(value, (int, float, np.number)):
        return "number"
    return "prose" if isinstance(value, str) and len(value) > PROSE else ""


def embedded(path: Path) -> str:
    """A picture as a data address, in few colours so that it is small; the file keeps them all."""
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(COLOURS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    written = io.BytesIO()
    small.save(written, "png", optimize=True)
    return _address("image/png", min(written.getvalue(), path.read_bytes(), key=len))


def size(path: Path) -> tuple[int, int]:
    """Width and height of a picture [pixels]."""
    with Image.open(path) as picture:
        return picture.size


def data_link(folder: Path, file: str) -> tuple[str, str] | None:
    """Name and address of what a picture or table shows: inside the page if it is small, else beside it."""
    path = folder / file
    if not file or not path.is_file():
        return None
    content = path.read_bytes()
    return path.name, _address("text/csv", content) if len(content) <= MOST_EMBEDDED else file


def _address(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
