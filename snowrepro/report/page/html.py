"""A report as one HTML file that needs no other file: pictures, style and viewer are inside."""

import base64
import io
import re
from pathlib import Path

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup
from PIL import Image

from ...store.files import published
from ..document import Document, Table, format_cell
from ..drawing.palette import reduce_colours
from ..viewer.scripts import join_scripts
from ..viewer.viewer import Viewer

COLOURS = 64  # of an embedded picture
PROSE = 60  # letters from which a cell is to be read as text
MOST_EMBEDDED = 12_000  # bytes of a table that travels inside the page
WORDS = re.compile(r"<strong>(REPRODUCED|CONTRADICTED|INCONCLUSIVE|NOT RUN|missing)")

_markdown = MarkdownIt("commonmark", {"html": False})


def write_html(document: Document, path: Path, viewer: Viewer | None = None) -> None:
    """Write the page to ``path``.  The pictures and tables that it shows must lie in or beside the same folder."""
    loader, folder = PackageLoader("snowrepro.report"), path.parent
    environment = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"paragraphs": render_paragraphs, "inline": render_inline}
    environment.globals |= {
        "kind": lambda block: type(block).__name__ if not isinstance(block, str) else "str",
        "source_of": lambda name: _trust(loader.get_source(environment, name)[0]),
        "viewer_script": lambda: _trust(join_scripts()),
        "embedded": lambda file: embed_picture(folder / file),
        "size": lambda file: read_size(folder / file),
        "data_of": lambda block: link_data(folder, block.data),
        "cells": render_cells,
        "zip": zip,
    }
    page = environment.get_template("report.html.j2").render(document=document, viewer=viewer)
    with published(path) as partial:
        partial.write_text(page, encoding="utf-8")


def render_paragraphs(text: str) -> Markup:
    """Render Markdown as HTML; HTML inside the Markdown is shown as text."""
    return _mark_verdicts(_markdown.render(text))


def render_inline(text: str) -> Markup:
    """Render one line of Markdown as HTML without a paragraph around it."""
    return _mark_verdicts(_markdown.renderInline(text))


def _trust(html: str) -> Markup:
    """Mark HTML as safe, so that a template does not escape it.

    Only for the package's own files, and for what was rendered from Markdown with HTML switched off.
    """
    return Markup(html)  # noqa: S704 - never called with text from outside


def _mark_verdicts(html: str) -> Markup:
    """Give the words of verdicts a CSS class."""
    return _trust(WORDS.sub(lambda m: f'<strong class="{m[1].lower().replace(" ", "-")}">{m[1]}', html))


def render_cells(table: Table) -> list[list[tuple[Markup, str]]]:
    """Render a table as rows of (HTML, CSS class); the class is number, prose or empty."""
    return [
        [(render_inline(format_cell(value)), _choose_class(value)) for value in row]
        for row in table.frame.itertuples(index=False)
    ]


def _choose_class(value: object) -> str:
    """Choose the CSS class of a cell by its value."""
    if isinstance(value, (int, float, np.number)):
        return "number"
    return "prose" if isinstance(value, str) and len(value) > PROSE else ""


def embed_picture(path: Path) -> str:
    """Make a data URL of a picture, in fewer colours than the file has, so that the page is small."""
    with Image.open(path) as picture:
        small = reduce_colours(picture.convert("RGB"), COLOURS)
    png = io.BytesIO()
    small.save(png, "png", optimize=True)
    return _make_data_url("image/png", min(png.getvalue(), path.read_bytes(), key=len))


def read_size(path: Path) -> tuple[int, int]:
    """Read width and height of a picture [pixels]."""
    with Image.open(path) as picture:
        return picture.size


def link_data(folder: Path, file: str) -> tuple[str, str] | None:
    """Return name and URL of the file that a picture or table shows; None without a file.

    A small file goes into the page as a data URL; of a larger one the URL is its path.
    """
    path = folder / file
    if not file or not path.is_file():
        return None
    content = path.read_bytes()
    return path.name, _make_data_url("text/csv", content) if len(content) <= MOST_EMBEDDED else file


def _make_data_url(kind: str, content: bytes) -> str:
    """Make a data URL.  ``kind``: the MIME type."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
