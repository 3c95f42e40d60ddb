"""Outlines out of SVG and of images, as closed curves: upright, of a given width, from the origin."""

import warnings
from pathlib import Path
from typing import Any

import contourpy
import numpy as np
import shapely
from PIL import Image, ImageOps, TiffImagePlugin
from shapely import Geometry

from .regions import Curve, Effort, fill, outline_of
from .svg import painted_area, path_area

SPECK = 0.01  # spots and holes below this part of the largest area are dirt
MOST_PIXELS = 25_000_000
MOST_STEPS = 1_000_000  # between dark and light from one pixel to the next
FORMATS = ("PNG", "JPEG", "GIF", "BMP", "TIFF", "WEBP", "PPM")  # none for which Pillow starts a program
DEEPEST = 65535.0  # value of 16 bits
PHOTOMETRIC, WHITE_IS_ZERO = 262, 0  # a tag of TIFF, and a value
OTHER_COLOURS = ("CMYK", "YCbCr", "LAB", "HSV")


def from_path(data: str, rule: str, width: float) -> list[Curve]:
    """Curves around what SVG path data fills, ``width`` cells wide.  Raises ValueError if it is no closed path."""
    return outline_of(path_area(data, rule), width)


def from_svg(source: str, width: float) -> list[Curve]:
    """Curves around what an SVG file paints, ``width`` cells wide.  Raises ValueError with what cannot be read."""
    path = _existing(source)
    try:
        return outline_of(painted_area(path), width)
    except (ValueError, OSError) as error:
        raise ValueError(f"{source}: {error}") from error


def from_image(source: str, region: str, width: float) -> list[Curve]:
    """Curves around the "dark" or the "light" region of an image, parted at half brightness, ``width`` cells wide.

    Raises ValueError with the reason if there is none, or if it meets the image's edge.
    """
    path = _existing(source)
    try:
        return outline_of(_trace(_read_brightness(path, region), region), width)
    except (ValueError, OSError) as error:
        raise ValueError(f"{source}: {error}") from error


def _existing(source: str) -> Path:
    path = Path(source)
    if not path.is_file():
        raise ValueError(f"there is no file '{source}' (looked for from {Path.cwd()})")
    return path


def _read_brightness(path: Path, region: str) -> np.ndarray:
    """Brightness (rows, columns) of an image's pixels, from 0 to 1, turned as a viewer does.

    Where the image is transparent it is not of the region.  Raises ValueError if it cannot be read.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Pillow's, of what it makes up for in a damaged file
            with Image.open(path, formats=FORMATS) as image:
                _check_image(image)
                grey = _deep_grey if image.mode.startswith(("I", "F")) else _grey
                return grey(image, "white" if region == "dark" else "black")
    except Image.DecompressionBombError as error:
        raise ValueError(f"it has too many pixels; at most {MOST_PIXELS:,} can be read: shrink it ({error})") from error
    except _Refused:
        raise
    except Exception as error:  # whatever Pillow raises on what is no image
        raise ValueError(f"it cannot be read as an image: {error or type(error).__name__}") from error


class _Refused(ValueError):
    """An image that could be read, but not rightly."""


def _check_image(image: Image.Image) -> None:
    """Refuse an image by what its head says, before its pixels are read."""
    width, height = image.size
    if width * height > MOST_PIXELS:
        raise _Refused(
            f"it has {width:,} x {height:,} = {width * height:,} pixels; at most {MOST_PIXELS:,} can be read: shrink it"
        )
    if min(width, height) < 3:
        raise _Refused(f"it has {width} x {height} pixels; at least 3 x 3 are needed")
    if getattr(image, "is_animated", False) and image.format != "MPO":  # a camera's, whose first is the picture
        raise _Refused("it has several pictures: save the one that is meant")


def _grey(image: Image.Image, paper: str) -> np.ndarray:
    """Brightness of an image that lies on paper."""
    upright = ImageOps.exif_transpose(image)
    drawing = (upright.convert("RGB") if upright.mode in OTHER_COLOURS else upright).convert("RGBA")
    sheet = Image.new("RGBA", drawing.size, paper)
    return np.asarray(Image.alpha_composite(sheet, drawing).convert("L"), dtype=float) / 255.0


def _deep_grey(image: Image.Image, paper: str) -> np.ndarray:
    """Brightness of an image of 16 bits a pixel, which Pillow would cut to 8.  Raises ValueError for more bits."""
    if image.mode == "F" or (image.mode == "I" and image.format not in ("PNG", "PPM")):
        raise _Refused("its greys have more than 16 bits: save it with 8 or 16")
    see_through = image.info.get("transparency")
    is_negative = isinstance(image, TiffImagePlugin.TiffImageFile) and image.tag_v2.get(PHOTOMETRIC) == WHITE_IS_ZERO
    values = np.asarray(ImageOps.exif_transpose(image), dtype=float)
    grey = 1.0 - values / DEEPEST if is_negative else values / DEEPEST
    if isinstance(see_through, int):
        grey[values == see_through] = 1.0 if paper == "white" else 0.0
    return grey


def _trace(brightness: np.ndarray, region: str) -> Geometry:
    """The area, y running down, of the region that is dark or light; what is small beside it is left out."""
    is_in = brightness < 0.5 if region == "dark" else brightness > 0.5
    if not is_in.any():
        other = "light" if region == "dark" else "dark"
        raise ValueError(f"it has no {region} region (if the drawing is {other}, set region: {other})")
    steps = sum(int(np.count_nonzero(np.diff(is_in, axis=axis))) for axis in (0, 1))
    if steps > MOST_STEPS:
        raise ValueError(f"it is dark beside light at {steps:,} places; at most {MOST_STEPS:,} can be read: smooth it")
    lines: list[Any] = list(contourpy.contour_generator(z=brightness).lines(0.5))
    sizes = np.array([shapely.Polygon(line).area if len(line) > 3 else 0.0 for line in lines])
    curves = [line for line, size in zip(lines, sizes, strict=True) if size >= SPECK * sizes.max()]
    edge = np.concatenate([is_in[0], is_in[-1], is_in[:, 0], is_in[:, -1]])
    if edge.mean() > 0.5 or any((curve[0] != curve[-1]).any() for curve in curves):
        raise ValueError(
            f"its {region} region meets the image's edge, so its outline is open there: leave a margin around it"
            + ("; if the drawing is light on dark, set region: light" if region == "dark" else "")
        )
    effort = Effort()
    effort.use_points(sum(map(len, curves)))
    return fill([curve[:-1] for curve in curves], "evenodd", effort)
