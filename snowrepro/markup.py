"""Pieces of HTML as notebooks show them; all text in them is escaped."""

import base64
import html
from collections.abc import Iterable, Sequence

from .text import make_printable


def escape(text: object) -> str:
    """Return text from data as it can stand in HTML, in an attribute too."""
    return html.escape(make_printable(text))


def make_paragraph(text: object, is_bold: bool = False) -> str:
    """Return a paragraph of a text."""
    return f"<p><strong>{escape(text)}</strong></p>" if is_bold else f"<p>{escape(text)}</p>"


def make_table(header: Sequence[object], rows: Iterable[Sequence[object]]) -> str:
    """Return a table of texts with a line of names above it; without names where ``header`` is empty."""
    head = f"<thead><tr>{_make_cells('th', header)}</tr></thead>" if header else ""
    lines = "".join(f"<tr>{_make_cells('td', row)}</tr>" for row in rows)
    return f"<table>{head}<tbody>{lines}</tbody></table>"


def _make_cells(kind: str, texts: Sequence[object]) -> str:
    """Return the cells of a line; ``kind``: th or td."""
    return "".join(f'<{kind} style="text-align: left">{escape(text)}</{kind}>' for text in texts)


def make_image(content: bytes, kind: str, description: str) -> str:
    """Return a picture that is part of the page.  ``kind``: png or gif; ``description``: for who does not see it."""
    data = base64.b64encode(content).decode("ascii")
    return f'<img src="data:image/{kind};base64,{data}" alt="{escape(description)}" style="max-width: 100%">'


def make_video(content: bytes, description: str) -> str:
    """Return an mp4 that is part of the page, and can be stopped."""
    data = base64.b64encode(content).decode("ascii")
    return (
        f'<video src="data:video/mp4;base64,{data}" controls loop aria-label="{escape(description)}" '
        'style="max-width: 100%"></video>'
    )
