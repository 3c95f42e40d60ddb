"""Outlines that are given as drawings: a configuration holds the polygon, so a run's record says what was simulated."""

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, ValidationError, model_validator

from ..errors import ConfigError
from ..settings.base import Settings
from .messages import explain

OUTLINED = ("shape", "floor")  # sections with an outline


class Drawing(Settings):
    """An outline that is read from an SVG path or an image."""

    kind: Literal["svg", "image"]
    path: str | None = Field(None, description="svg: path data, as in the attribute d")
    file: str | None = Field(None, description="svg or image: a file, from the working directory")
    width: float = Field(gt=0, le=1e4, description="width of the outline [cells]")

    @model_validator(mode="after")
    def _has_one_source(self) -> "Drawing":
        if self.kind == "image" and (self.file is None or self.path is not None):
            raise ValueError("an image needs a file")
        if self.kind == "svg" and (self.path is None) == (self.file is None):
            raise ValueError("an svg needs either a path or a file")
        return self

    def corners(self) -> tuple[tuple[float, float], ...]:
        """The polygon's corners [cells].  Raises ValueError with what is wrong in the drawing."""
        from . import tracing  # what it draws with is not loaded where there is no drawing

        if self.kind == "image":
            return tracing.from_image(str(self.file), self.width)
        return tracing.from_svg(str(self.path or self.file), self.path is None, self.width)


def read_drawings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Plain settings in which each outline that is given as a drawing is the polygon that it shows.

    Raises ConfigError with what is wrong in a drawing.
    """
    return {name: with_outline_read(name, value) for name, value in settings.items()}


def with_outline_read(section: str, settings: Any) -> Any:
    """One section's plain settings, likewise."""
    outline = settings.get("outline") if section in OUTLINED and isinstance(settings, dict) else None
    if not isinstance(outline, dict) or outline.get("kind") in ("circle", "polygon"):
        return settings
    return {**settings, "outline": _read(f"{section}.outline", outline)}


def _read(where: str, outline: dict[str, Any]) -> dict[str, Any]:
    """The polygon of a drawing, as the settings of an outline."""
    if outline.get("kind") not in ("svg", "image"):
        raise ConfigError(
            f"{where}.kind: should be 'circle', 'polygon', 'svg' or 'image' (got {outline.get('kind')!r})"
        )
    try:
        return {"kind": "polygon", "points": Drawing.model_validate(outline).corners()}
    except ValidationError as error:
        raise ConfigError(
            "; ".join(explain({**item, "loc": (where, *item["loc"])}) for item in error.errors())
        ) from error
    except ValueError as error:
        raise ConfigError(f"{where}: {error}") from error
