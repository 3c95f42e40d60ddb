"""Plain text as Markdown."""

import re

SPECIAL = re.compile(r"([\\`*_{}\[\]<>#|~$])")


def plain(text: str) -> str:
    """Text in which no character has a meaning of its own."""
    return SPECIAL.sub(r"\\\1", " ".join(text.split()))
