"""What a notebook shows below a cell: each has its HTML, and a text for where there is no notebook."""

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure

from ..errors import ConfigError
from ..markup import make_image, make_video
from ..report.drawing.common import DPI
from ..store.files import published


@dataclass(frozen=True, repr=False)
class View:
    """A run, a sweep or fragments at a glance, as ``html`` and as ``text``."""

    html: str
    text: str

    def __repr__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        return self.html


@dataclass(frozen=True, repr=False, eq=False)
class Plot:
    """A picture.  ``figure``: Matplotlib's, to change or to add to; ``description``: what it shows, in words."""

    figure: Figure
    description: str

    def __repr__(self) -> str:
        return f"<Plot: {self.description}; a notebook shows it, save(path) writes it>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        return make_image(self.to_png(), "png", self.description)

    def to_png(self) -> bytes:
        """Return the picture as a PNG."""
        content = BytesIO()
        self.figure.savefig(content, format="png", dpi=DPI, bbox_inches="tight", metadata={"Software": None})
        return content.getvalue()

    def save(self, path: str | Path) -> None:
        """Write the picture, in the format that the ending of ``path`` says: .png, .svg or .pdf.

        Raises ConfigError for another ending, StoreError if it cannot be written.
        """
        ending = Path(path).suffix
        if ending not in (".png", ".svg", ".pdf"):
            raise ConfigError(f"'{path}' should end in .png, .svg or .pdf")
        with published(Path(path)) as partial:
            self.figure.savefig(partial, format=ending[1:], dpi=DPI, bbox_inches="tight")


@dataclass(frozen=True, repr=False)
class Film:
    """A moving picture.  ``content``: of a file with this ``ending``, .gif or .mp4; ``description``: in words."""

    content: bytes
    ending: str
    description: str

    def __repr__(self) -> str:
        size = len(self.content) / 1e6
        return (
            f"<Film: {self.description}, {self.ending[1:]}, {size:.1f} MB; a notebook shows it, save(path) writes it>"
        )

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        if self.ending == ".mp4":
            return make_video(self.content, self.description)
        return make_image(self.content, "gif", self.description)

    def save(self, path: str | Path) -> None:
        """Write the film to a file with the same ending.  Raises ConfigError for another, StoreError."""
        if Path(path).suffix != self.ending:
            raise ConfigError(f"'{path}' should end in {self.ending}")
        with published(Path(path)) as partial:
            partial.write_bytes(self.content)
