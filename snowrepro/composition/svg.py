"""The area that an SVG file paints, as a viewer shows it on white paper, or the reason why that cannot be told.

svgelements' own reading of a whole document is not used: it lets attributes of groups pass to shapes, follows <use>
without bound, and skips in silence what it does not know.
"""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
import shapely
from shapely import Geometry

from .regions import Effort, Pen, edges_of, fill, stroke, unite
from .svg_document import INHERITED, MOST_DEPTH, MOST_ELEMENTS, Style, read_document, style_of, tag_of
from .svg_values import (
    Curve,
    fit_box,
    read_aspect,
    read_box,
    read_colour,
    read_length,
    read_path,
    read_shape,
    read_share,
    read_transform,
)

MOST_NUMBERS = 400_000  # in all path data
LINK = re.compile(r"url\(\s*['\"]?([^'\")]*)['\"]?\s*\)\s*(.*)")
HREFS = ("href", "{http://www.w3.org/1999/xlink}href")
FRAME = ("x", "y", "width", "height")
SHAPES = ("path", "rect", "circle", "ellipse", "line", "polyline", "polygon")
MARKED = ("path", "line", "polyline", "polygon")
UNREADABLE = {
    "text": "text is no outline: turn it into paths",
    "image": "a picture in a drawing is not read: save it as a file and use kind: image",
    "foreignObject": "it is not read: remove it",
}
ANIMATIONS = ("animate", "animateTransform", "animateMotion", "set")
DEFAULTS: Style = {
    "color": "black",
    "visibility": "visible",
    "fill": "black",
    "fill-rule": "nonzero",
    "fill-opacity": "1",
    "clip-rule": "nonzero",
    "stroke": "none",
    "stroke-opacity": "1",
    "stroke-width": "1",
    "stroke-linecap": "butt",
    "stroke-linejoin": "miter",
    "stroke-miterlimit": "4",
    "stroke-dasharray": "none",
    "marker-start": "none",
    "marker-mid": "none",
    "marker-end": "none",
}


@dataclass(frozen=True)
class Paint:
    """An area that is painted, whether in white, and how much it covers of what is below it, from 0 to 1."""

    area: Geometry
    is_white: bool
    opacity: float


@dataclass(frozen=True)
class Place:
    """Where in a drawing an element is: what it inherits, and what is done to all that is painted there."""

    style: Style
    matrix: np.ndarray  # (3, 3), from its coordinates to those of the drawing
    viewport: tuple[float, float]  # that percentages are of [px]
    opacity: float = 1.0
    clips: tuple[Geometry, ...] = ()
    unread: str | None = None  # an effect that what is painted here would have
    is_clip: bool = False  # in a clipPath, where all shapes are filled
    depth: int = 0
    used: tuple[str, ...] = ()  # links that led here

    def mapped(self, points: np.ndarray) -> np.ndarray:
        """Points (n, 2) in coordinates of the drawing."""
        return points @ self.matrix[:2, :2].T + self.matrix[:2, 2]

    def moved(self, matrix: np.ndarray) -> "Place":
        """The place whose coordinates ``matrix`` maps to those of this one."""
        return replace(self, matrix=self.matrix @ matrix)


class Unread(ValueError):
    """What cannot be read, with the element named."""


def painted_area(path: Path) -> Geometry:
    """The area that an SVG file paints.  Raises ValueError with the element that cannot be read, and the remedy.

    White covers what is below it, as paper does; where all is white, that is the area.
    """
    try:
        drawing = _Drawing(read_document(path))
        paints = [*drawing.paints(drawing.root, Place(DEFAULTS, np.eye(3), (0.0, 0.0)))]
        return _on_paper(paints, drawing.effort)
    except ValueError:
        raise
    except Exception as error:  # whatever svgelements and shapely raise on what they cannot read
        raise ValueError(f"it cannot be read: {error or type(error).__name__}") from error


def path_area(data: str, rule: str) -> Geometry:
    """The area in the closed curves of path data.  Raises ValueError if it is none, or a curve is open."""
    effort = Effort()
    curves = read_path(data, effort)
    for points, is_closed in curves:
        if not is_closed and len(points) > 1 and not np.allclose(points[0], points[-1]):
            raise ValueError("the path is open: it does not end with Z")
    return fill([points for points, _ in curves], rule, effort)


def _on_paper(paints: list[Paint], effort: Effort) -> Geometry:
    """What is seen of paints on white paper, the later over the earlier; all of them where all are white."""
    if not paints:
        raise ValueError("nothing is painted in it")
    if all(paint.is_white for paint in paints):
        return unite([paint.area for paint in paints], effort)
    effort.use_meetings(edges_of([paint.area for paint in paints]))
    seen = np.array([paint.area for paint in paints if not paint.is_white])
    order = np.array([i for i, paint in enumerate(paints) if not paint.is_white])
    for i, paint in enumerate(paints):
        if not paint.is_white:
            continue
        below = np.flatnonzero((order < i) & shapely.intersects(seen, paint.area))
        if paint.opacity < 1.0 and shapely.area(shapely.intersection(seen[below], paint.area)).any():
            raise ValueError("white that one sees through lies over other colours: make it opaque, or remove it")
        seen[below] = shapely.difference(seen[below], paint.area)
    return seen[0] if len(seen) == 1 else shapely.union_all(seen)


@dataclass
class _Drawing:
    """A document, and how much of it has been read."""

    root: Element
    ids: dict[str, Element] = field(init=False)
    visited: int = 0
    numbers: int = 0
    effort: Effort = field(default_factory=Effort)

    def __post_init__(self) -> None:
        self.ids = {key: element for element in reversed([*self.root.iter()]) if (key := element.get("id"))}

    def paints(self, element: Element, place: Place) -> Iterator[Paint]:
        """What an element and those in it paint, in this order."""
        tag = tag_of(element)
        self.visited += 1
        if self.visited > MOST_ELEMENTS:
            raise Unread(f"it uses more than {MOST_ELEMENTS:,} elements: simplify it")
        if place.depth > MOST_DEPTH:
            raise Unread(f"its elements are nested more than {MOST_DEPTH} deep: simplify it")
        if tag not in ("svg", "g", "a", "switch", "use", *SHAPES, *UNREADABLE):
            return  # not painted, or only where it is used
        with _naming(element):
            place, is_seen = self._inside(element, place)
            if is_seen:
                yield from self._content(element, tag, place)

    def _content(self, element: Element, tag: str, place: Place) -> Iterator[Paint]:
        """What an element paints at a place in it."""
        is_visible = place.style["visibility"] == "visible"
        if tag in ("g", "a"):
            yield from self._children(element, place)
        elif tag == "svg":
            inner = self._viewport(element, element.attrib, place)
            yield from self._children(element, inner)
        elif tag == "switch":
            plain = (e for e in element if tag_of(e) and not (e.get("requiredExtensions") or e.get("systemLanguage")))
            for first in plain:
                yield from self.paints(first, place)
                break
        elif tag == "use":
            yield from self._used(element, place)
        elif tag in SHAPES and is_visible:
            yield from self._shape(element, tag, place)
        elif tag in UNREADABLE and is_visible and (tag != "text" or "".join(element.itertext()).strip()):
            raise ValueError(UNREADABLE[tag])

    def _children(self, element: Element, place: Place) -> Iterator[Paint]:
        _refuse_animations(element)
        for child in element:
            yield from self.paints(child, place)

    def _inside(self, element: Element, place: Place) -> tuple[Place, bool]:
        """The place in an element, where what it inherits is replaced by what it has, and whether it is seen."""
        style = style_of(element)
        if style.get("display") == "none":
            return place, False
        for name, value in style.items():
            if value.lower() in ("initial", "unset", "revert", "revert-layer"):
                raise ValueError(f"{name}='{value}' is not read: write the value")
        own = {name: value for name, value in style.items() if name in INHERITED and value.lower() != "inherit"}
        if own.get("color", "").lower() == "currentcolor":
            del own["color"]
        opacity = place.opacity * read_share(style.get("opacity", "1"))
        place = replace(place, style={**place.style, **own}, opacity=opacity, depth=place.depth + 1)
        if element.get("transform"):
            if element.get("transform-origin"):
                raise ValueError("its transform-origin is not read: apply the transform to the paths")
            place = place.moved(read_transform(element.get("transform", "")))
        if tag_of(element) == "use":
            place = place.moved(_shift(*(read_length(name, element.get(name, "0"), place.viewport) for name in "xy")))
        return self._clipped(element, style, place), opacity > 0.0

    def _clipped(self, element: Element, style: Style, place: Place) -> Place:
        """The place in an element that may be clipped; other effects are kept in mind for what is painted there."""
        effects = [name for name in ("mask", "filter") if style.get(name, "none") != "none"]
        clip = style.get("clip-path", "none")
        if clip != "none":
            try:
                place = replace(place, clips=(*place.clips, self._clip(clip, place)))
            except ValueError:
                effects.append("clip-path")
        if effects:
            unread = f"{_name(element)}: its {effects[0]} is not read: apply it to the paths, or remove it"
            place = replace(place, unread=unread)
        return place

    def _clip(self, value: str, place: Place) -> Geometry:
        """The area that a clip-path leaves.  Raises ValueError if it is not of shapes in the drawing's units."""
        target = self._linked(value)
        if target is None or tag_of(target) != "clipPath" or value in place.used:
            raise ValueError("it is no clipPath of the file")
        if target.get("clipPathUnits", "userSpaceOnUse") != "userSpaceOnUse":
            raise ValueError("it is in units of the element")
        plain = replace(place, style=DEFAULTS, opacity=1.0, clips=(), unread=None, is_clip=True)
        inner, _ = self._inside(target, replace(plain, used=(*place.used, value)))
        return unite([paint.area for paint in self._children(target, inner)], self.effort)

    def _used(self, element: Element, place: Place) -> Iterator[Paint]:
        """What a <use> refers to paints there."""
        link = next((link for name in HREFS if (link := element.get(name))), "")
        target = self._target(link)
        if target is None:
            return  # as in a viewer
        if link in place.used:
            raise ValueError("it refers to itself")
        place = replace(place, used=(*place.used, link))
        if tag_of(target) not in ("symbol", "svg"):
            yield from self.paints(target, place)
            return
        inner, is_seen = self._inside(target, place)
        if is_seen:
            sizes = {name: size for name in ("width", "height") if (size := element.get(name))}
            yield from self._children(target, self._viewport(target, {**target.attrib, **sizes}, inner))

    def _viewport(self, element: Element, attributes: Mapping[str, str], place: Place) -> Place:
        """The place in an <svg> or a used <symbol>: fitted by its viewBox and clipped to its frame.

        The root is not clipped, and only what its viewBox does to proportions counts, as the drawing gets its size
        later.
        """
        box = read_box(attributes["viewBox"]) if attributes.get("viewBox") else None
        aspect = read_aspect(attributes.get("preserveAspectRatio"))
        if element is self.root and place.depth == 1:
            whole = _root_size(attributes) or (box[2:] if box else (100.0, 100.0))
            if box and aspect.startswith("none"):
                place = place.moved(np.diag([whole[0] / box[2] * box[3] / whole[1], 1.0, 1.0]))
            return replace(place, viewport=box[2:] if box else whole)
        at = {"x": "0", "y": "0", "width": "100%", "height": "100%", **attributes}
        left, top, width, height = (
            read_length(name, at[name], place.viewport) for name in ("x", "y", "width", "height")
        )
        frame = shapely.box(left, top, left + max(width, 0.0), top + max(height, 0.0))
        if style_of(element).get("overflow") != "visible" or frame.area == 0:
            place = replace(place, clips=(*place.clips, shapely.transform(frame, place.mapped)))
        if box is None or frame.area == 0:
            return replace(place, viewport=(width, height)).moved(_shift(left, top))
        return replace(place, viewport=box[2:]).moved(fit_box(box, (left, top, width, height), aspect))

    def _shape(self, element: Element, tag: str, place: Place) -> Iterator[Paint]:
        """What the inside and the line of a shape paint."""
        style = place.style
        filled = self._colour("fill", place) if tag != "line" else None
        drawn = None if place.is_clip else self._colour("stroke", place)
        if not (filled or drawn):
            return
        _refuse_animations(element)
        if tag in MARKED and any(style[f"marker-{where}"] != "none" for where in ("start", "mid", "end")):
            raise ValueError("its markers are not read: turn them into paths, or remove them")
        curves = self._curves(element, tag, place)
        if filled:
            rule = style["clip-rule" if place.is_clip else "fill-rule"].lower()
            if rule not in ("nonzero", "evenodd"):
                raise ValueError(f"'{rule[:40]}' is no fill-rule")
            inside = fill([place.mapped(points) for points, _ in curves], rule, self.effort)
            yield from self._seen(inside, filled, place)
        if drawn:
            line = shapely.transform(self._line(element, curves, place), place.mapped)
            yield from self._seen(line if line.is_valid else shapely.make_valid(line), drawn, place)

    def _seen(self, area: Geometry, colour: tuple[bool, float], place: Place) -> Iterator[Paint]:
        """What is left of a painted area where it is clipped.  Raises Unread if it has an effect that is not read."""
        for clip in place.clips:
            self.effort.use_meetings(edges_of([area, clip]))
            area = shapely.intersection(area, clip)
        if area.area > 0.0:
            if place.unread:
                raise Unread(place.unread)
            yield Paint(area, *colour)

    def _curves(self, element: Element, tag: str, place: Place) -> list[Curve]:
        """The curves of a shape in its own coordinates."""
        data = element.get("d" if tag == "path" else "points", "")
        self.numbers += len(re.findall(r"\d+", data))
        if self.numbers > MOST_NUMBERS:
            raise Unread(f"it has more than {MOST_NUMBERS:,} numbers in its paths: simplify it")
        if tag == "path":
            return read_path(data, self.effort)
        return read_shape(tag, element.attrib, place.viewport, self.effort)

    def _line(self, element: Element, curves: list[Curve], place: Place) -> Geometry:
        """The area of a shape's line, in the shape's own coordinates."""
        style = place.style
        if style["stroke-dasharray"].strip("0, ") not in ("none", ""):
            raise ValueError("its line is dashed, which is not read: turn the line into a path")
        if style_of(element).get("vector-effect", "none") != "none":
            raise ValueError("its vector-effect is not read: turn the line into a path")
        width = read_length("stroke-width", style["stroke-width"], place.viewport)
        limit = read_length("stroke-miterlimit", style["stroke-miterlimit"], place.viewport)
        cap, join = style["stroke-linecap"].lower(), style["stroke-linejoin"].lower()
        if cap not in ("butt", "round", "square") or join not in ("miter", "round", "bevel"):
            raise ValueError(f"its line has ends '{cap[:20]}' and corners '{join[:20]}', which are not read")
        if width <= 0:
            return shapely.Polygon()
        pen = Pen(width, cap, join, limit)
        return unite([stroke(points, is_closed, pen, self.effort) for points, is_closed in curves], self.effort)

    def _colour(self, name: str, place: Place) -> tuple[bool, float] | None:
        """Whether a shape's fill or stroke is white, and how opaque it is; None if nothing is painted."""
        if place.is_clip:
            return False, 1.0
        value, opacity = place.style[name], place.opacity * read_share(place.style[f"{name}-opacity"])
        link = LINK.fullmatch(value)
        target = self._linked(value) if link else None
        if target is not None:
            return (self._gradient(target), opacity) if opacity > 0 else None
        value = (link[2] or "none") if link else value
        if value.lower() == "none":
            return None
        is_white, alpha = read_colour(place.style["color"] if value.lower() == "currentcolor" else value)
        return (is_white, opacity * alpha) if opacity * alpha > 0 else None

    def _gradient(self, element: Element) -> bool:
        """False, as a gradient is not white.  Raises ValueError for a pattern, and for a gradient that is in parts."""
        for _ in range(MOST_DEPTH):
            if tag_of(element) not in ("linearGradient", "radialGradient"):
                raise ValueError(f"it is painted by <{tag_of(element)}>, which is not read: give it one colour")
            stops = [stop for stop in element if tag_of(stop) == "stop"]
            for stop in stops:
                colour = stop.get("stop-color", "black")
                is_white, alpha = read_colour("black" if colour.lower() == "currentcolor" else colour)
                if is_white or alpha * read_share(stop.get("stop-opacity", "1")) == 0.0:
                    raise ValueError("its gradient fades to white or to nothing, so it has no edge: give it one colour")
            link = next((link for name in HREFS if (link := element.get(name))), "")
            following = None if stops else self._target(link)
            if following is None:
                return False
            element = following
        raise ValueError("its gradient refers to itself")

    def _linked(self, value: str) -> Element | None:
        """The element that url(#...) refers to, if there is one.  Raises ValueError for another file."""
        link = LINK.fullmatch(value)
        if link is None:
            raise ValueError(f"'{value[:40]}' refers to no element")
        return self._target(link[1])

    def _target(self, link: str) -> Element | None:
        """The element that a link refers to, if there is one.  Raises ValueError for another file."""
        if link and not link.startswith("#"):
            raise ValueError(f"it refers to '{link[:60]}', and other files are not read: put its content here")
        return self.ids.get(link[1:])


def _root_size(attributes: Mapping[str, str]) -> tuple[float, float] | None:
    """Width and height of the drawing; None where they are those of the window."""
    given = [attributes.get(name) or "100%" for name in ("width", "height")]
    if any(size.strip() == "auto" or size.strip().endswith("%") for size in given):
        return None
    width, height = (read_length("width", size, (1.0, 1.0)) for size in given)
    if width <= 0 or height <= 0:
        raise ValueError("its width and height must be above zero")
    return width, height


def _refuse_animations(element: Element) -> None:
    if any(tag_of(child) in ANIMATIONS for child in element):
        raise ValueError("it is animated: save the drawing without animations")


def _shift(x: float, y: float) -> np.ndarray:
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]])


def _name(element: Element) -> str:
    """What a message calls an element."""
    key = element.get("id")
    return f"<{tag_of(element)} id='{key[:40]}'>" if key else f"<{tag_of(element)}>"


@contextmanager
def _naming(element: Element) -> Iterator[None]:
    """A block in which a ValueError becomes one that names an element."""
    try:
        yield
    except Unread:
        raise
    except ValueError as error:
        raise Unread(f"{_name(element)}: {error}") from error
