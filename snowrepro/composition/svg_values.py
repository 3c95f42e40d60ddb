"""What the attributes of SVG say: lengths, transforms, colours, and shapes as curves.

svgelements reads path data, shapes, transforms and view boxes.  It passes over what it cannot read, so the grammar is
checked here before.  All functions raise ValueError for what is not of it.
"""

import math
import re
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import svgelements
from tinycss2 import color4

from .regions import Effort

CURVE_POINTS = 48  # on a Bezier curve, before what is straight is thinned out
FARTHEST = 1e9  # coordinate of a drawing [px]
WHITE = 0.98  # of each colour
UNITS = {"": 1.0, "px": 1.0, "in": 96.0, "cm": 96.0 / 2.54, "mm": 96.0 / 25.4, "pt": 4.0 / 3.0, "pc": 16.0}
NUMBER = r"[+-]?(?:\d+\.\d+|\d+|\.\d+)(?:[eE][+-]?\d+)?"
LENGTH = re.compile(rf"({NUMBER})([a-zA-Z]*|%)")
COMMANDS = re.compile(r"[\s,MmZzLlHhVvCcSsQqTtAa]*")
TRANSFORM = re.compile(r"[\s,]*(matrix|translate|scale|rotate|skewX|skewY)\s*\(([^()]*)\)[\s,]*")
TERMS = {"matrix": (6,), "translate": (1, 2), "scale": (1, 2), "rotate": (1, 3), "skewX": (1,), "skewY": (1,)}
ASPECT = re.compile(r"(none|x(?:Min|Mid|Max)Y(?:Min|Mid|Max))(?:\s+(?:meet|slice))?")
AXES = {"x": 0, "cx": 0, "rx": 0, "x1": 0, "x2": 0, "width": 0, "y": 1, "cy": 1, "ry": 1, "y1": 1, "y2": 1, "height": 1}
SIZES = {
    "rect": ("x", "y", "width", "height", "rx", "ry"),
    "circle": ("cx", "cy", "r"),
    "ellipse": ("cx", "cy", "rx", "ry"),
    "line": ("x1", "y1", "x2", "y2"),
}

Point = tuple[float, float]
Curve = tuple[np.ndarray, bool]  # points (n, 2), and whether it is closed
Box = tuple[float, float, float, float]


def read_length(name: str, text: str, viewport: tuple[float, float]) -> float:
    """A length in pixels; percentages are of the width, the height or the mean diagonal of the viewport."""
    match = LENGTH.fullmatch(_without_bare_points(text.strip()))
    if match is None or match[2].lower() not in (*UNITS, "%"):
        raise ValueError(f"{name}='{text[:40]}' is no length that is read: write it in px, mm, cm, in, pt or pc")
    if match[2] != "%":
        return _finite(float(match[1]) * UNITS[match[2].lower()])
    whole = viewport[AXES[name]] if name in AXES else math.hypot(*viewport) / math.sqrt(2.0)
    return _finite(float(match[1]) / 100.0 * whole)


def read_share(text: str) -> float:
    """A number or a percentage, cut to 0 to 1."""
    match = LENGTH.fullmatch(_without_bare_points(text.strip()))
    if match is None or match[2] not in ("", "%"):
        raise ValueError(f"'{text[:40]}' is no opacity")
    return min(max(float(match[1]) / (100.0 if match[2] else 1.0), 0.0), 1.0)


def read_numbers(text: str) -> list[float]:
    """Numbers with blanks or commas between them."""
    text = _without_bare_points(text)
    if not re.fullmatch(r"[\s,]*", re.sub(NUMBER, " ", text)):
        raise ValueError(f"'{text[:40]}' has something beside numbers")
    return [_finite(float(number)) for number in re.findall(NUMBER, text)]


def read_transform(text: str) -> np.ndarray:
    """A transform as a matrix (3, 3)."""
    place = 0
    while place < len(text.rstrip()):
        match = TRANSFORM.match(text, place)
        if match is None or len(read_numbers(match[2])) not in TERMS[match[1]]:
            raise ValueError(f"transform='{text[:60]}' cannot be read")
        place = match.end()
    m = svgelements.Matrix(_without_bare_points(text))
    matrix = np.array([[m.a, m.c, m.e], [m.b, m.d, m.f], [0.0, 0.0, 1.0]], dtype=float)
    _finite(float(np.abs(matrix).max()))
    return matrix


def read_box(text: str) -> Box:
    """A viewBox: left, top, width and height."""
    numbers = read_numbers(text)
    if len(numbers) != 4 or min(numbers[2:]) <= 0:
        raise ValueError(f"viewBox='{text[:60]}' is no box")
    left, top, width, height = numbers
    return left, top, width, height


def read_aspect(text: str | None) -> str:
    """A preserveAspectRatio."""
    aspect = re.sub(r"^\s*defer\s+", "", text or "xMidYMid").strip()
    if not ASPECT.fullmatch(aspect):
        raise ValueError(f"preserveAspectRatio='{aspect[:40]}' cannot be read")
    return " ".join(aspect.split())


def fit_box(box: Box, frame: Box, aspect: str) -> np.ndarray:
    """The matrix (3, 3) that puts a viewBox into a frame: left, top, width and height."""
    return read_transform(svgelements.Viewbox.viewbox_transform(*frame, *box, aspect))


def read_colour(text: str) -> tuple[bool, float]:
    """Whether a colour is white, and how opaque it is."""
    try:
        colour: Any = color4.parse_color(text)
        channels = [float(channel) for channel in colour.to("srgb").coordinates]
    except (AttributeError, NotImplementedError, TypeError, ValueError) as error:
        raise ValueError(f"the colour '{text[:40]}' is not read: write it as #rrggbb") from error
    return min(channels) >= WHITE, float(colour.alpha)


def read_path(data: str, effort: Effort) -> list[Curve]:
    """The curves of path data."""
    data = _without_bare_points("" if data.strip() == "none" else data)
    rest = re.sub(NUMBER, " ", data)
    if not COMMANDS.fullmatch(rest) or data.strip()[:1] not in ("", "M", "m"):
        raise ValueError(f"this is no path data: '{data[:40]}'")
    try:
        path = svgelements.Path(data)
    except Exception as error:  # whatever svgelements raises on what is no path
        raise ValueError(f"this is no path data: '{data[:40]}'") from error
    return _curves_of(path, effort)


def read_shape(tag: str, attributes: Mapping[str, str], viewport: tuple[float, float], effort: Effort) -> list[Curve]:
    """The curves of a shape other than a path."""
    if tag in ("polyline", "polygon"):
        numbers = read_numbers(attributes.get("points", ""))
        if len(numbers) % 2:
            raise ValueError("its points are not all of two numbers")
        points = np.array(numbers).reshape(-1, 2)
        effort.use_points(len(points))
        return [(points, tag == "polygon")] if len(points) else []
    given = {name: value for name in SIZES[tag] if (value := attributes.get(name, "auto")).strip() != "auto"}
    sizes = {name: read_length(name, value, viewport) for name, value in given.items()}
    if tag == "rect":
        sizes = {"width": 0.0, "height": 0.0, **sizes}
    if tag == "ellipse" and len(sizes.keys() & {"rx", "ry"}) == 1:  # the other is as large
        sizes = {"rx": sizes.get("ry", 0.0), "ry": sizes.get("rx", 0.0), **sizes}
    needed = {"rect": ("width", "height"), "circle": ("r",), "ellipse": ("rx", "ry"), "line": ()}[tag]
    if any(sizes.get(name, 0.0) <= 0 for name in needed):
        return []
    if tag in ("circle", "ellipse"):
        x, y, rx, ry = (
            {"cx": 0.0, "cy": 0.0, **sizes}.get(name, sizes.get("r", 0.0)) for name in ("cx", "cy", "rx", "ry")
        )
        return _curves_of(svgelements.Path(_round_path(x, y, rx, ry)), effort)
    kind = svgelements.Rect if tag == "rect" else svgelements.SimpleLine
    return _curves_of(svgelements.Path(kind(**sizes)), effort)


def _round_path(x: float, y: float, rx: float, ry: float) -> str:
    """Path data of an ellipse: two halves from the left, where drawings have always been begun."""
    return f"M{x - rx!r} {y!r}A{rx!r} {ry!r} 0 1 1 {x + rx!r} {y!r}A{rx!r} {ry!r} 0 1 1 {x - rx!r} {y!r}Z"


def _curves_of(path: svgelements.Path, effort: Effort) -> list[Curve]:
    """The curves of a path of svgelements, those that are bent as points."""
    curves: list[Curve] = []
    points: list[Point] = []
    before: list[Point] = []  # control points of the segment before, if it was a Bezier curve
    for segment in path:
        if isinstance(segment, svgelements.Move):
            if points:
                curves.append((np.array(points), False))
            points = [_point(segment.end)]
        elif isinstance(segment, svgelements.Close):
            curves.append((np.array(points), True))
            points = []
        else:
            points = points or [_point(segment.start)]
            before = _controls(segment, before)
            new = _bezier(np.array(before)) if before else list(_points_on(segment))
            points += new
            effort.use_points(len(new))
            continue
        before = []
    if points:
        curves.append((np.array(points), False))
    return curves


def _controls(segment: Any, before: list[Point]) -> list[Point]:
    """The control points of a Bezier curve; none of another segment.

    A smooth curve goes on in the direction of a curve of the same degree before it.  svgelements' own does so too
    after a curve of the other degree.
    """
    if isinstance(segment, svgelements.QuadraticBezier):
        controls = [_point(p) for p in (segment.start, segment.control, segment.end)]
    elif isinstance(segment, svgelements.CubicBezier):
        controls = [_point(p) for p in (segment.start, segment.control1, segment.control2, segment.end)]
    else:
        return []
    if segment.smooth:
        (x, y), last = controls[0], before[-2] if len(before) == len(controls) else controls[0]
        controls[1] = (x + x - last[0], y + y - last[1])
    return controls


def _points_on(segment: Any) -> Iterator[Point]:
    """The points of an arc or a line after its start."""
    if isinstance(segment, svgelements.Arc) and segment.rx * segment.ry != 0:
        for control in _quarters(segment):
            yield from _bezier(control)
    else:
        yield _point(segment.end)


def _quarters(arc: svgelements.Arc) -> Iterator[np.ndarray]:
    """Control points (4, 2) of the cubic curves that follow an arc of an ellipse, up to a quarter each.

    Not svgelements' own, which leave the ellipse by 0.2 % of its radius.
    """
    count = math.ceil(abs(arc.sweep) / (math.pi / 2.0 + 0.001))
    turn, step = float(arc.get_rotation()), arc.sweep / max(count, 1)
    axes = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]]) * [[arc.rx], [arc.ry]]
    handle = 4.0 / 3.0 * math.tan(0.25 * step)
    start = np.array(_point(arc.start))
    for i in range(count):
        a, b = arc.get_start_t() + i * step, arc.get_start_t() + (i + 1) * step
        ends = np.array([[math.cos(a), math.sin(a)], [math.cos(b), math.sin(b)]])
        tangents = np.array([[-math.sin(a), math.cos(a)], [math.sin(b), -math.cos(b)]])
        places = np.stack([ends[0], ends[0] + handle * tangents[0], ends[1] + handle * tangents[1], ends[1]])
        control = places @ axes + _point(arc.center)
        control[0] = start
        if i == count - 1:
            control[3] = _point(arc.end)
        start = control[3]
        yield control


def _bezier(control: np.ndarray) -> list[Point]:
    """Points on a Bezier curve of any degree after its start, by de Casteljau's rule."""
    t = np.linspace(0.0, 1.0, CURVE_POINTS + 1)[1:, None]
    level = [np.broadcast_to(point, (len(t), 2)) for point in control]
    while len(level) > 1:
        level = [(1.0 - t) * a + t * b for a, b in pairwise(level)]
    return [(x, y) for x, y in level[0].tolist()]


def _point(point: Any) -> Point:
    return _finite(float(point.x)), _finite(float(point.y))


def _finite(number: float) -> float:
    if not abs(number) <= FARTHEST:
        raise ValueError(f"it has the number {number:g}; at most {FARTHEST:g} can be read")
    return number


def _without_bare_points(text: str) -> str:
    """Text in which '1.' is '1', as svgelements reads only the latter."""
    return re.sub(r"(\d)\.(?![\d.])", r"\1", text)
