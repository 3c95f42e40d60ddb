"""Outlines out of SVG paths and of images, as the corners of a polygon.

Both have y running down; the polygon is turned upright, scaled to a width, and put with the lower
left corner of its bounding box at the origin.  Curves are followed within TOLERANCE.
"""

from itertools import pairwise
from pathlib import Path
from typing import Any

import contourpy
import numpy as np
import shapely
from fontTools.pens.recordingPen import RecordingPen
from fontTools.svgLib import SVGPath, parse_path
from PIL import Image

TOLERANCE = 0.02  # [cells]
CURVE_POINTS = 48  # on a Bezier curve, before what is straight is thinned out
SPECK = 0.01  # dark spots and holes below this part of the largest area are dirt
DECIMALS = 4  # of the corners, so that a run's identity does not hang on round-off

Corners = tuple[tuple[float, float], ...]


def from_svg(source: str, is_file: bool, width: float) -> Corners:
    """Corners of the one closed path of an SVG file or of SVG path data, ``width`` cells wide.

    Raises ValueError with the reason if there is no such path.
    """
    pen = RecordingPen()
    try:
        if is_file:
            SVGPath(str(_existing(source))).draw(pen)
        else:
            parse_path(source, pen)
    except Exception as error:  # whatever fontTools raises on what is no SVG
        raise ValueError(f"this is no SVG path: {error or type(error).__name__}") from error
    loops = _loops(pen)
    if len(loops) != 1:
        raise ValueError(f"one closed path is needed, this has {len(loops)}")
    return _to_cells(loops[0], width)


def from_image(source: str, width: float) -> Corners:
    """Corners around the dark region of an image (below half brightness), ``width`` cells wide.

    Raises ValueError with the reason if there is not just one region, whole and without holes.
    """
    path = _existing(source)
    try:
        with Image.open(path) as image:
            drawing = image.convert("RGBA")
    except OSError as error:
        raise ValueError(f"{source} cannot be read as an image: {error}") from error
    paper = Image.new("RGBA", drawing.size, "white")  # what is transparent is light
    brightness = np.asarray(Image.alpha_composite(paper, drawing).convert("L"), dtype=float) / 255.0
    loops: list[Any] = list(contourpy.contour_generator(z=brightness).lines(0.5))
    areas = [abs(_area(loop)) for loop in loops]
    regions = [loop for loop, size in zip(loops, areas, strict=True) if size >= SPECK * max(areas)]
    if not regions:
        raise ValueError(f"{source} has no dark region")
    if any((loop[0] != loop[-1]).any() for loop in regions):
        raise ValueError(f"the dark region of {source} meets the image's edge, so its outline is open there")
    if len(regions) > 1:
        raise ValueError(f"{source} has {len(regions)} dark regions or holes; one region without holes is needed")
    return _to_cells(regions[0][:-1], width)


def _existing(source: str) -> Path:
    path = Path(source)
    if not path.is_file():
        raise ValueError(f"there is no file '{source}' (looked for from {Path.cwd()})")
    return path


def _loops(pen: RecordingPen) -> list[np.ndarray]:
    """The closed paths that a pen has recorded, curves as points.  Raises ValueError for an open one."""
    loops, points = [], []
    for command, ends in pen.value:
        if command == "moveTo":
            points = [ends[0]]
        elif command == "lineTo":
            points.append(ends[0])
        elif command in ("curveTo", "qCurveTo"):
            points += _bezier(np.array([points[-1], *ends]))
        elif command in ("closePath", "endPath"):
            returns = len(points) > 1 and np.allclose(points[0], points[-1])
            if command == "endPath" and not returns:
                raise ValueError("the path is open: it does not end with Z")
            loops.append(np.array(points[:-1] if returns else points, dtype=float))
    return [loop for loop in loops if len(loop) > 1]


def _bezier(control: np.ndarray) -> list[np.ndarray]:
    """Points on a Bezier curve of any degree after its start, by de Casteljau's rule."""
    t = np.linspace(0.0, 1.0, CURVE_POINTS + 1)[1:, None]
    level = [np.broadcast_to(point, (len(t), 2)) for point in control]
    while len(level) > 1:
        level = [(1.0 - t) * a + t * b for a, b in pairwise(level)]
    return list(level[0])


def _area(points: np.ndarray) -> float:
    x, y = points.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _to_cells(points: np.ndarray, width: float) -> Corners:
    """Upright, ``width`` cells wide, from the origin, without corners that TOLERANCE can spare."""
    upright = points * [1.0, -1.0]
    span = np.ptp(upright[:, 0])
    if span <= 0:
        raise ValueError("the outline has no width")
    cells = (upright - upright.min(axis=0)) * (width / span)
    thinned = shapely.LinearRing(cells).simplify(TOLERANCE) if len(cells) > 3 else shapely.LinearRing(cells)
    return tuple((round(x, DECIMALS), round(y, DECIMALS)) for x, y in thinned.coords[:-1])
