"""Outlines out of SVG and images: the right curve, or the reason why not."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from snowrepro.composition.drawings import read_drawings, with_outline_read
from snowrepro.errors import ConfigError
from snowrepro.scene import outline as geometry
from snowrepro.settings.case import Outline


def drawn(**given) -> Outline:
    """What a drawing becomes in a configuration."""
    return Outline.model_validate(with_outline_read("shape", {"outline": given})["outline"])


def picture(path, dark, size=200) -> str:
    """A grey image, dark where ``dark`` of (x to the right, y up), both from 0 to 1, holds."""
    x, y = np.meshgrid((np.arange(size) + 0.5) / size, 1 - (np.arange(size) + 0.5) / size)
    plt.imsave(path, np.where(dark(x, y), 0.1, 0.9), cmap="gray", vmin=0, vmax=1)
    return str(path)


def test_an_svg_path_is_turned_upright_and_scaled():
    """A triangle with its point down in SVG's y stands on its point; the corner lies at the origin."""
    outline = drawn(kind="svg", path="M 10 10 L 30 10 L 20 50 Z", width=40)
    assert outline.kind == "polygon"
    assert set(outline.points) == {(0, 80), (40, 80), (20, 0)}


def test_svg_curves_and_arcs():
    """A disc of two arcs and one of four Bezier curves have the disc's area and extent."""
    k = 4 / 3 * (np.sqrt(2) - 1)
    bezier = f"M 1 0 C 1 {k} {k} 1 0 1 C {-k} 1 -1 {k} -1 0 C -1 {-k} {-k} -1 0 -1 C {k} -1 1 {-k} 1 0 Z"
    for path in ("M 0 5 A 5 5 0 0 1 10 5 A 5 5 0 0 1 0 5 Z", bezier):
        outline = drawn(kind="svg", path=path, width=60)
        assert geometry.area(outline) == pytest.approx(np.pi * 900, rel=2e-3)
        np.testing.assert_allclose(geometry.extent(outline), [[0, 0], [60, 60]], atol=0.05)
        assert geometry.flaw(outline) is None


def test_an_svg_file_gives_what_its_path_gives(tmp_path):
    file = tmp_path / "house.svg"
    path = "M 0 0 h 30 v -25 l -15 -15 l -15 15 z"
    file.write_text(f'<svg xmlns="http://www.w3.org/2000/svg"><path d="{path}"/></svg>')
    assert drawn(kind="svg", file=str(file), width=30) == drawn(kind="svg", path=path, width=30)


def test_an_image_gives_its_dark_region(tmp_path):
    """A dark disc, low on the left, with dirt; the outline does not depend on where it is."""
    disc = picture(tmp_path / "disc.png", lambda x, y: ((x - 0.4) ** 2 + (y - 0.3) ** 2 < 0.04) | (x + y > 1.98))
    outline = drawn(kind="image", file=disc, width=60)
    assert geometry.area(outline) == pytest.approx(np.pi * 900, rel=0.01)
    assert geometry.flaw(outline) is None
    assert 20 < len(outline.points) < 300
    wedge = picture(tmp_path / "wedge.png", lambda x, y: (y > 0.2) & (y < 0.5 * x) & (x < 0.9))
    outline = drawn(kind="image", file=wedge, width=50)
    points = np.array([[45.0, 5.0], [5.0, 20.0]])  # low on the right is snow, high on the left is not
    assert (np.sign(geometry.signed_distance(outline, points)[0]) == [-1, 1]).all()


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"kind": "svg", "path": "M 0 0 L 10 0 L 10 10", "width": 9}, "the path is open"),
        ({"kind": "svg", "path": "hello", "width": 9}, "this is no path data: 'hello'"),
        ({"kind": "svg", "path": "M 0 0 L 10 0 L 1e400 10 Z", "width": 9}, "the number inf"),
        ({"kind": "svg", "path": "M 0 0 L 10 0 L 10 1_0 Z", "width": 9}, "this is no path data"),
        ({"kind": "svg", "path": "M 0 0 L 10 0 L 10 10 Z e5", "width": 9}, "this is no path data"),
        ({"kind": "svg", "path": "", "width": 9}, "has no width"),
        ({"kind": "svg", "path": "M 0 0 L 10 0 L 10 10 Z", "width": 9, "region": "light"}, "region is of an image"),
        ({"kind": "svg", "file": "nowhere.svg", "width": 9, "fill_rule": "evenodd"}, "a file says its own"),
        ({"kind": "svg", "path": "M 0 0 L 0 10 L 0 5 Z", "width": 9}, "has no width"),
        ({"kind": "svg", "file": "nowhere.svg", "width": 9}, "there is no file 'nowhere.svg'"),
        ({"kind": "svg", "width": 9}, "either a path or a file"),
        ({"kind": "svg", "path": "M 0 0 L 10 0 L 10 10 Z"}, "width"),
        ({"kind": "image", "file": "nowhere.png", "width": 9}, "there is no file 'nowhere.png'"),
        ({"kind": "image", "path": "M 0 0", "width": 9}, "an image needs a file"),
    ],
)
def test_bad_drawings_are_refused(given, reason):
    with pytest.raises(ConfigError, match=reason):
        drawn(**given)


@pytest.mark.parametrize(
    ("dark", "reason"),
    [
        (lambda x, y: x > 2, r"no dark region \(if the drawing is light, set region: light\)"),
        (lambda x, y: x < 0.5, "meets the image's edge"),
        (lambda x, y: abs(x - 0.5) > 0.2, "meets the image's edge.*set region: light"),
        (lambda x, y: (x - 0.5) ** 2 + (y - 0.5) ** 2 > 0.04, "meets the image's edge.*set region: light"),
    ],
)
def test_images_without_a_whole_dark_region_are_refused(tmp_path, dark, reason):
    with pytest.raises(ConfigError, match=reason):
        drawn(kind="image", file=picture(tmp_path / "image.png", dark), width=50)


def test_images_have_holes_and_several_bodies(tmp_path):
    """A ring with a disc in its hole, and a square beside it."""

    def dark(x, y):
        r = np.hypot(x - 0.35, y - 0.5)
        return (r < 0.3) & (r > 0.2) | (r < 0.1) | (abs(x - 0.85) < 0.1) & (abs(y - 0.5) < 0.1)

    outline = drawn(kind="image", file=picture(tmp_path / "ring.png", dark, size=400), width=90)
    assert len(outline.curves) == 4
    assert geometry.area(outline) == pytest.approx(1e4 * (np.pi * (0.09 - 0.04 + 0.01) + 0.04), rel=0.01)
    assert geometry.flaw(outline) is None


def test_what_is_no_image_is_refused(tmp_path):
    (tmp_path / "text.png").write_text("no image")
    with pytest.raises(ConfigError, match="cannot be read as an image"):
        drawn(kind="image", file=str(tmp_path / "text.png"), width=50)


def test_several_curves_of_a_path():
    """A hole by the direction of its curve, or by the even-odd rule, and a body beside."""
    square, clockwise, around = "M0 0H40V40H0Z", "M10 10V30H30V10Z", "M10 10H30V30H10Z"
    beside = "M60 0H70V10H60Z"
    for path, rule, area in [
        (square + clockwise, "nonzero", 1200),
        (square + around, "nonzero", 1600),
        (square + around, "evenodd", 1200),
        (square + beside, "nonzero", 1700),
        (square + clockwise + beside, "nonzero", 1300),
    ]:
        outline = drawn(kind="svg", path=path, fill_rule=rule, width=70 if beside in path else 40)
        assert geometry.area(outline) == pytest.approx(area)
        assert geometry.flaw(outline) is None
    star = "M50 5L79 95L5 40L95 40L21 95Z"  # crosses itself: its middle is filled or not
    filled, open_ = (drawn(kind="svg", path=star, fill_rule=rule, width=90) for rule in ("nonzero", "evenodd"))
    assert len(filled.curves) == 1
    assert len(open_.curves) == 5
    assert geometry.area(filled) > geometry.area(open_) + 500


def test_needles_are_cut():
    """Corners that a scene would refuse end where they are too thin to matter; others stay."""
    needle = drawn(kind="svg", path="M0 0L100 2L0 4Z", width=100)
    assert geometry.flaw(needle) is None
    assert geometry.area(needle) == pytest.approx(200, rel=1e-3)
    assert set(drawn(kind="svg", path="M0 0L100 10L0 20Z", width=100).points) == {(0, 20), (100, 10), (0, 0)}


def test_one_closed_path_is_read_as_ever():
    """To the same corners: a run's id is a hash of them."""
    path = "M 50 0 C 60 30 90 50 90 80 A 40 40 0 0 1 10 80 C 10 50 40 30 50 0 Z"
    outline = drawn(kind="svg", path=path, width=50)
    assert outline.rings is None
    assert len(outline.points) == 116
    assert outline.points[:4] == ((25.0, 75.0), (25.8441, 72.6879), (26.3107, 71.5546), (27.3247, 69.3299))
    assert "rings" not in outline.model_dump()


def test_only_outlines_that_are_drawings_are_touched():
    """A circle, a polygon, other sections, and what is no section at all stay as they are; a floor is read too."""
    plain = {
        "shape": {"name": "disc", "outline": {"kind": "circle", "radius": 9}},
        "floor": {"name": "drawn", "outline": {"kind": "svg", "path": "M 0 0 L 10 0 L 5 9 Z", "width": 50}},
        "material": {"outline": {"kind": "svg"}},
        "pressure": 7,
    }
    read = read_drawings(plain)
    assert read["floor"]["outline"]["kind"] == "polygon"
    assert {**read, "floor": plain["floor"]} == plain


def test_what_is_wrong_is_said_of_the_key():
    """By the section, as one would type it."""
    with pytest.raises(ConfigError, match=r"^floor\.outline\.width: "):
        read_drawings({"floor": {"outline": {"kind": "svg", "path": "M 0 0 L 10 0 L 5 9 Z", "width": -1}}})
    with pytest.raises(ConfigError, match=r"^shape\.outline: the path is open"):
        read_drawings({"shape": {"outline": {"kind": "svg", "path": "M 0 0 L 10 0 L 5 9", "width": 9}}})
    with pytest.raises(ConfigError, match=r"^shape\.outline\.kind: should be .*'image' \(got 'drawing'\)"):
        read_drawings({"shape": {"outline": {"kind": "drawing"}}})
