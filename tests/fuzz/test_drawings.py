"""Many drawings and images, made up from a seed: the right area, or one line that says why not; never a traceback.

Areas are compared with shapely, which knows nothing of SVG.
"""

import random
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import shapely
from PIL import Image
from shapely import affinity

from snowrepro.composition.drawings import with_outline_read
from snowrepro.errors import ConfigError
from snowrepro.scene import outline as geometry
from snowrepro.settings.case import Outline

WIDTH = 60.0
LONGEST = 10.0  # [s]
MOST_MEMORY = 1e9  # [bytes]
HEAD = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">'
SHARDS = (
    *("</g>", "<g>", "<use href='#a'/>", "NaN", "1e999", "-", "url(#a)", "&#0;", "&x;", "<!--", "]]>", "\0", "é", "%"),
    *("<svg viewBox='0 0 1 1'>", "transform='scale(0)'", "M", "Z", "a0 0 0 0 0 0 0", "style='fill:", "!important", '"'),
    "9" * 400,
)


def read(kind: str, file: Path) -> Outline | None:
    """What a drawing becomes; None where it is refused, in one line and in time."""
    started = time.monotonic()
    tracemalloc.start()
    try:
        given = {"kind": kind, "file": str(file), "width": WIDTH}
        return Outline.model_validate(with_outline_read("shape", {"outline": given})["outline"])
    except ConfigError as error:
        assert "\n" not in str(error)
        assert str(error).startswith("shape.outline")
        return None
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert time.monotonic() - started < LONGEST
        assert peak < MOST_MEMORY


def cells(area: shapely.Geometry) -> float:
    """Area in cells^2 of what is drawn ``WIDTH`` cells wide."""
    left, _, right, _ = area.bounds
    return area.area * (WIDTH / (right - left)) ** 2


def make_shape(rng: random.Random) -> tuple[str, shapely.Geometry]:
    """An element, and its area."""
    x, y, width, height = (round(rng.uniform(a, b), 3) for a, b in ((0, 60), (0, 60), (8, 40), (8, 40)))
    kind = rng.choice(("rect", "round", "circle", "ellipse", "polygon", "ring", "line"))
    if kind == "rect":
        return f'<rect x="{x}" y="{y}mm" width="{width}" height="{height}px"', shapely.box(
            x, y * 96 / 25.4, x + width, y * 96 / 25.4 + height
        )
    if kind == "round":
        r = min(width, height) / 4
        return f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="{r}"', shapely.box(
            x + r, y + r, x + width - r, y + height - r
        ).buffer(r, quad_segs=32)
    if kind == "circle":
        return f'<circle cx="{x}" cy="{y}" r="{width}"', shapely.Point(x, y).buffer(width, quad_segs=64)
    if kind == "ellipse":
        disc = shapely.Point(x, y).buffer(1, quad_segs=64)
        return f'<ellipse cx="{x}" cy="{y}" rx="{width}" ry="{height}"', affinity.scale(disc, width, height)
    if kind == "ring":
        hole = shapely.box(x + width / 4, y + height / 4, x + width / 2, y + height / 2)
        data = f"M{x} {y}h{width}v{height}h-{width}zm{width / 4} {height / 4}h{width / 4}v{height / 4}h-{width / 4}z"
        return f'<path fill-rule="evenodd" d="{data}"', shapely.box(x, y, x + width, y + height) - hole
    if kind == "line":
        return f'<path fill="none" stroke="#000" stroke-width="6" d="M{x} {y}h{width}"', shapely.box(
            x, y - 3, x + width, y + 3
        )
    corners = [(round(rng.uniform(0, 100), 2), round(rng.uniform(0, 100), 2)) for _ in range(3)]
    return f'<polygon points="{" ".join(f"{a},{b}" for a, b in corners)}"', shapely.Polygon(corners)


def make_node(rng: random.Random, depth: int) -> tuple[str, shapely.Geometry]:
    """A shape or a group of some, with a transform, and their area; some are not seen."""
    a, b, c, d, e, f = (
        round(rng.uniform(low, high), 3)
        for low, high in ((0.5, 1.5), (-0.5, 0.5), (-0.5, 0.5), (0.5, 1.5), (-20, 20), (-20, 20))
    )
    transform = f'transform="matrix({a} {b},{c} {d} {e},{f})"'
    hidden = rng.choice(("", "", "", 'opacity="0"', 'style="display:none"', 'visibility="hidden"'))
    if depth and rng.random() < 0.4:
        children = [make_node(rng, depth - 1) for _ in range(rng.randint(1, 3))]
        text = f"<g {transform} {hidden}>{''.join(child for child, _ in children)}</g>"
        area = shapely.union_all([child for _, child in children])
    else:
        shape, area = make_shape(rng)
        text = f"{shape} {transform} {hidden}/>"
    return text, shapely.Polygon() if hidden else affinity.affine_transform(area, [a, c, b, d, e, f])


def make_svg(seed: int) -> tuple[str, shapely.Geometry]:
    """A document, and the area that it paints."""
    rng = random.Random(seed)
    nodes = [make_node(rng, 3) for _ in range(rng.randint(1, 4))]
    return HEAD + "".join(text for text, _ in nodes) + "</svg>", shapely.union_all([area for _, area in nodes])


def damage(text: bytes, rng: random.Random) -> bytes:
    """Text with something cut, doubled, changed or put in."""
    for _ in range(rng.randint(1, 6)):
        at, to = sorted(rng.randrange(len(text) + 1) for _ in range(2))
        damaged = (
            text[:at] + text[at + rng.randint(1, 30) :],
            text[:to] + text[at:],
            text[:at] + rng.choice(SHARDS).encode() + text[at:],
            text[:at] + bytes([rng.randrange(256)]) + text[at + 1 :],
            text[:at],
        )
        text = rng.choice(damaged)[:200_000]
    return text


def check_svg(seed: int, folder: Path) -> None:
    text, area = make_svg(seed)
    file = folder / "drawing.svg"
    file.write_text(text)
    outline = read("svg", file)
    assert (outline is None) == (area.area == 0.0), text
    if outline is not None and geometry.flaw(outline) is None:
        assert geometry.area(outline) == pytest.approx(cells(area), rel=5e-3, abs=0.5), text
    rng = random.Random(seed)
    file.write_bytes(damage(text.encode(), rng))
    read("svg", file)


def check_image(seed: int, folder: Path) -> None:
    """Blobs with holes, of a random size and mode; then the same file damaged."""
    rng = random.Random(seed)
    blobs = [
        shapely.Point(rng.uniform(35, 65), rng.uniform(35, 65)).buffer(rng.uniform(6, 25))
        for _ in range(rng.randint(1, 4))
    ]
    area = shapely.union_all(blobs) - shapely.Point(50, 50).buffer(rng.uniform(0, 9))
    size = rng.randint(150, 400)
    x, y = np.meshgrid(*[(np.arange(size) + 0.5) * 100 / size] * 2)
    dark = shapely.contains_xy(area, x, y)
    kind = rng.choice(("png", "png", "bmp", "tiff", "webp", "gif"))
    if kind in ("png", "tiff") and rng.random() < 0.4:
        image = Image.fromarray(np.where(dark, rng.randint(0, 30000), rng.randint(35000, 65535)).astype(np.uint16))
    else:
        grey = np.where(dark, rng.randint(0, 100), rng.randint(160, 255)).astype(np.uint8)
        image = Image.fromarray(grey).convert(rng.choice(("L", "RGB", "P")))
    file = folder / f"drawing.{kind}"
    image.save(file)
    outline = read("image", file)
    assert outline is not None
    parts = [ring for part in shapely.get_parts(area) for ring in (part.exterior, *part.interiors)]
    if min(shapely.Polygon(ring).area for ring in parts) > 0.02 * area.area:  # what is smaller may be taken for dirt
        pixels = (area.bounds[2] - area.bounds[0]) * size / 100  # each end may be half a pixel off
        assert geometry.area(outline) == pytest.approx(cells(area), rel=4.0 / pixels), seed
    file.write_bytes(damage(file.read_bytes(), rng))
    read("image", file)


@pytest.mark.parametrize("first", range(0, 100, 25))
def test_drawings(first, tmp_path):
    for seed in range(first, first + 25):
        check_svg(seed, tmp_path)


@pytest.mark.parametrize("first", range(0, 60, 20))
def test_images(first, tmp_path):
    for seed in range(first, first + 20):
        check_image(seed, tmp_path)


@pytest.mark.nightly
@pytest.mark.parametrize("first", range(1000, 2000, 100))
def test_more_drawings_and_images(first, tmp_path):
    for seed in range(first, first + 100):
        check_svg(seed, tmp_path)
        check_image(seed, tmp_path)
