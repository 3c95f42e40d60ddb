"""Outlines that are given as drawings: a configuration holds the polygon, so a run's record says what was simulated."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, ValidationError, model_validator

from ..errors import ConfigError
from ..settings.base import Settings
from .messages import explain

if TYPE_CHECKING:
    from .regions import Curve

OUTLINED = ("shape", "floor")  # sections with an outline


class Drawing(Settings):
    """An outline that is read from an SVG path or an image."""

    kind: Literal["svg", "image"]
    path: str | None = Field(None, description="svg: path data, as in the attribute d")
    fill_rule: Literal["nonzero", "evenodd"] | None = Field(
        None, description="svg: with path, what its curves enclose, as in SVG; none: nonzero"
    )
    file: str | None = Field(None, description="svg or image: a file, from the working directory")
    region: Literal["dark", "light"] | None = Field(None, description="image: which part is the outline; none: dark")
    width: float = Field(gt=0, le=1e4, description="width of the outline [cells]")

    @model_validator(mode="after")
    def _has_one_source(self) -> "Drawing":
        if self.kind == "image" and (self.file is None or self.path is not None):
            raise ValueError("an image needs a file")
        if self.kind == "svg" and (self.path is None) == (self.file is None):
            raise ValueError("an svg needs either a path or a file")
        if self.region and self.kind != "image":
            raise ValueError("region is of an image")
        if self.fill_rule and self.path is None:
            raise ValueError("fill_rule is of a path; a file says its own")
        return self

    def curves(self) -> "list[Curve]":
        """The outline's curves, each as corners [cells].  Raises ValueError with what is wrong in the drawing."""
        from . import tracing  # what it draws with is not loaded where there is no drawing

        if self.path is not None:
            return tracing.from_path(self.path, self.fill_rule or "nonzero", self.width)
        if self.kind == "svg":
            return tracing.from_svg(str(self.file), self.width)
        return tracing.from_image(str(self.file), self.region or "dark", self.width)


def read_drawings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Plain settings in which each outline that is given as a drawing is the polygons that it shows.

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
        points, *rings = Drawing.model_validate(outline).curves()
    except ValidationError as error:
        raise ConfigError(
            "; ".join(explain({**item, "loc": (where, *item["loc"])}) for item in error.errors())
        ) from error
    except ValueError as error:
        text = "".join(letter if letter.isprintable() else " " for letter in str(error))  # it may quote the file
        raise ConfigError(f"{where}: {' '.join(text.split())}") from error
    return {"kind": "polygon", "points": points, **({"rings": tuple(rings)} if rings else {})}
