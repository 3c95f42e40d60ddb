"""SVG files: the area that a viewer shows, or one line that names the element and the remedy."""

import time
from pathlib import Path

import pytest
import shapely
from shapely import affinity

from snowrepro.composition.drawings import with_outline_read
from snowrepro.composition.svg import painted_area
from snowrepro.errors import ConfigError

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 100 100"'
BOX, DISC = shapely.box, shapely.Point(50, 50).buffer(40, quad_segs=64)
SQUARE = "M10 10H30V30H10Z"  # 400 square units


@pytest.fixture
def painted(tmp_path: Path):
    """The area of a document with this content, or of this whole document."""

    def read(content: str, attributes: str = "") -> shapely.Geometry:
        file = tmp_path / "drawing.svg"
        file.write_text(
            content if content.startswith(("<svg xmlns", "<?xml", "<!")) else f"{HEAD} {attributes}>{content}</svg>"
        )
        return painted_area(file)

    return read


def is_same(area: shapely.Geometry, expected: shapely.Geometry) -> bool:
    return shapely.symmetric_difference(area, expected).area <= 2e-3 * expected.area


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ('<rect x="10" y="20" width="30" height="5"/>', BOX(10, 20, 40, 25)),
        ('<rect x="10%" y="1in" width="10mm" height="1.5pc"/>', BOX(10, 96, 10 + 96 / 2.54, 120)),
        ('<rect width="6pt" height="1cm"/>', BOX(0, 0, 8, 96 / 2.54)),
        ('<rect x="0.0012" y="0.0013" width="0.0057" height="0.0014"/>', BOX(0.0012, 0.0013, 0.0069, 0.0027)),
        ('<rect width="80" height="20" rx="10"/>', BOX(10, 10, 70, 10.001).buffer(10, quad_segs=64)),
        (
            '<rect x="10" y="40" width="80" height="20" rx="90" ry="90"/>',
            affinity.scale(DISC, 1, 0.25, origin=(50, 50)),
        ),
        ('<circle cx="50px" cy="50px" r="40px"/>', DISC),
        ('<ellipse cx="50" cy="50" rx="40" ry="10"/>', affinity.scale(DISC, 1, 0.25, origin=(50, 50))),
        ('<polygon points="0,0 40,0 40 40"/>', shapely.Polygon([(0, 0), (40, 0), (40, 40)])),
        ('<polyline points="0,0 40,0 40 40"/>', shapely.Polygon([(0, 0), (40, 0), (40, 40)])),
        ('<line x1="10" y1="10" x2="50" y2="10" stroke="black" stroke-width="4"/>', BOX(10, 8, 50, 12)),
        ('<path d="M10 10 90 10 90 10 50 80 50 80Z"/>', shapely.Polygon([(10, 10), (90, 10), (50, 80)])),
        ('<path d="m10 10h20v20h-20zm30 0h5v5h-5z"/>', BOX(10, 10, 30, 30) | BOX(40, 10, 45, 15)),
        ('<path d="M10 50A40 40 0 0190 50A40 40 0 0110 50"/>', DISC),
        ('<path d="M0 0h9C9 3 9 6 9 9T0 9z"/>', BOX(0, 0, 9, 9)),  # T after C goes straight
        (
            '<path d="M0 0H100V100H0Z" fill="none"/><path d="M10 10L90 10L50 80Z"/>',
            shapely.Polygon([(10, 10), (90, 10), (50, 80)]),
        ),
        ('<path d="M0 0H40V40H0ZM10 10H30V30H10Z" fill-rule="evenodd"/>', BOX(0, 0, 40, 40) - BOX(10, 10, 30, 30)),
        ('<path d="M0 0H40V40H0ZM10 10H30V30H10Z"/>', BOX(0, 0, 40, 40)),
    ],
)
def test_shapes(painted, content, expected):
    assert is_same(painted(content), expected)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        # Transforms, of groups and of the element itself.
        (f'<path transform="rotate(90)" d="{SQUARE}"/>', BOX(-30, 10, -10, 30)),
        (
            '<g transform="translate(0,100) scale(0.1,-0.1)"><path d="M100 900h800l-400-700z"/></g>',
            shapely.Polygon([(10, 10), (90, 10), (50, 80)]),
        ),
        (f'<g transform="scale(2)"><g transform="translate(5)"><path d="{SQUARE}"/></g></g>', BOX(30, 20, 70, 60)),
        (f'<path transform="matrix(1 0 0 2 3 4) skewX(0)" d="{SQUARE}"/>', BOX(13, 24, 33, 64)),
        # Use, symbols and nested drawings.
        (
            f'<defs><path id="a" d="{SQUARE}"/></defs><use href="#a" x="5"/><use xlink:href="#a" y="50"/>',
            BOX(15, 10, 35, 30) | BOX(10, 60, 30, 80),
        ),
        (
            f'<symbol id="s" viewBox="0 0 50 50"><path d="{SQUARE}"/></symbol>'
            '<use href="#s" width="100" height="100"/>',
            BOX(20, 20, 60, 60),
        ),
        (
            f'<svg x="50" width="20" height="20" viewBox="0 0 40 20" preserveAspectRatio="xMinYMin">'
            f'<path d="{SQUARE}"/></svg>',
            BOX(55, 5, 65, 10 + 5),
        ),
        (f'<svg width="20" height="20"><path d="{SQUARE}"/></svg>', BOX(10, 10, 20, 20)),  # clipped to its frame
        (
            '<rect width="50" height="9"/><defs><rect width="99" height="99"/></defs>'
            '<symbol><rect width="99" height="99"/></symbol>',
            BOX(0, 0, 50, 9),
        ),
        (
            '<switch><g requiredExtensions="http://x.org"/><rect width="9" height="9"/>'
            '<!-- --><rect width="99" height="9"/></switch>',
            BOX(0, 0, 9, 9),
        ),
        # Clipped.
        (
            f'<clipPath id="c"><rect width="20" height="99"/></clipPath><path clip-path="url(#c)" d="{SQUARE}"/>',
            BOX(10, 10, 20, 30),
        ),
        # What is not seen.
        (f'<path d="{SQUARE}"/><rect width="99" height="99" style="display:none"/>', BOX(10, 10, 30, 30)),
        (f'<path d="{SQUARE}"/><g opacity="0"><rect width="99" height="99" opacity="1"/></g>', BOX(10, 10, 30, 30)),
        (
            f'<g visibility="hidden"><path visibility="visible" d="{SQUARE}"/><rect width="99" height="99"/></g>',
            BOX(10, 10, 30, 30),
        ),
        (
            f'<path d="{SQUARE}"/><rect width="99" height="99" fill="transparent"/><text visibility="hidden">x</text>',
            BOX(10, 10, 30, 30),
        ),
        (
            f'<g width="90" height="90"><rect x="5"/><path d="{SQUARE}"/></g>',
            BOX(10, 10, 30, 30),
        ),  # a rectangle without size
        # White is paper, unless all is white.
        (f'<rect width="100%" height="100%" fill="white"/><path d="{SQUARE}"/>', BOX(10, 10, 30, 30)),
        (
            f'<path d="{SQUARE}"/><rect x="20" y="0" width="9" height="99" fill="#fff"/>',
            BOX(10, 10, 30, 30) - BOX(20, 0, 29, 99),
        ),
        (f'<path fill="#fff" d="{SQUARE}"/>', BOX(10, 10, 30, 30)),
        # Style sheets: the more special rule, then the later one, then the important one.
        (f'<style>.a{{fill:none}} .b{{fill:red}}</style><path class="b a" d="{SQUARE}"/>', BOX(10, 10, 30, 30)),
        (
            f'<style>#i{{fill:red}} path.a{{fill:none}}</style><path id="i" class="a" d="{SQUARE}"/>',
            BOX(10, 10, 30, 30),
        ),
        (f'<style>path,g{{fill:red!important}}</style><path style="fill:none" d="{SQUARE}"/>', BOX(10, 10, 30, 30)),
        (
            f'<style><![CDATA[.st0 {{ fill : none ; stroke : #000 }}]]></style><path d="{SQUARE}"/>'
            '<rect class="st0" x="60" width="9" height="9" style="stroke-width:0"/>',
            BOX(10, 10, 30, 30),
        ),
        (f'<g fill="none"><path fill="currentColor" d="{SQUARE}"/><path d="M0 0H99V99Z"/></g>', BOX(10, 10, 30, 30)),
        # Lines.
        (
            '<path d="M20 50H80" fill="none" stroke="#000" stroke-width="10" stroke-linecap="round"/>',
            shapely.LineString([(20, 50), (80, 50)]).buffer(5, quad_segs=64),
        ),
        ('<path d="M20 50H80" stroke="#000" stroke-width="10" stroke-linecap="square"/>', BOX(15, 45, 85, 55)),
        (
            '<rect x="20" y="20" width="40" height="40" fill="none" stroke="black" stroke-width="10"/>',
            BOX(15, 15, 65, 65) - BOX(25, 25, 55, 55),
        ),
        ('<g transform="scale(1,2)"><path d="M20 20H80" stroke="#000" stroke-width="2"/></g>', BOX(20, 38, 80, 42)),
        ('<path d="M50 50h0" stroke="black" stroke-width="80" stroke-linecap="round"/>', DISC),
    ],
)
def test_what_a_viewer_shows(painted, content, expected):
    assert is_same(painted(content), expected)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "iso-8859-1"])
def test_encodings_and_what_editors_add(tmp_path, encoding):
    """A document type, comments, and elements of other namespaces."""
    name = {"utf-8-sig": "utf-8"}.get(encoding, encoding)
    text = (
        f'<?xml version="1.0" encoding="{name}"?><!-- Ü --><!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" '
        '"http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd"><svg xmlns="http://www.w3.org/2000/svg" xmlns:i="urn:i">'
        f'<i:view i:width="9"/><metadata><i:text>Ü</i:text></metadata><title>Ü</title><path d="{SQUARE}"/></svg>'
    )
    (tmp_path / "a.svg").write_bytes(text.encode(encoding))
    assert painted_area(tmp_path / "a.svg").area == 400


def test_proportions_of_the_whole(painted):
    """A view box stretches only where it is told to."""
    rect = '<rect width="100" height="100"/>'
    for attributes, ratio in [
        ('width="200" height="100"', 1.0),
        ('width="200" height="100" preserveAspectRatio="none"', 2.0),
        ('width="100%" height="50" preserveAspectRatio="none"', 1.0),
        ('width="2in" height="1in" preserveAspectRatio="none"', 2.0),
    ]:
        left, top, right, bottom = painted(rect, attributes).bounds
        assert (right - left) / (bottom - top) == pytest.approx(ratio, rel=1e-12)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ('<path style="display:none" d="M0 0H100V100H0Z"/>', "nothing is painted"),
        ("", "nothing is painted"),
        ('<text id="t">snow</text>', "<text id='t'>: text is no outline: turn it into paths"),
        (
            '<image href="data:image/png;base64,AAAA" width="9" height="9"/>',
            "<image>: a picture in a drawing is not read",
        ),
        ('<image href="file:///etc/passwd"/>', "<image>: a picture"),
        (f'<mask id="m"/><path id="p" mask="url(#m)" d="{SQUARE}"/>', "<path id='p'>: its mask is not read"),
        (f'<g id="g" filter="blur(3px)"><path d="{SQUARE}"/></g>', "<g id='g'>: its filter is not read"),
        (f'<path clip-path="circle(4px)" d="{SQUARE}"/>', "<path>: its clip-path is not read"),
        (f'<pattern id="p"/><path fill="url(#p)" d="{SQUARE}"/>', "painted by <pattern>, which is not read"),
        (
            f'<linearGradient id="p"><stop stop-opacity="0"/></linearGradient><path fill="url(#p)" d="{SQUARE}"/>',
            "fades",
        ),
        (f'<path fill="var(--ink)" d="{SQUARE}"/>', r"the colour 'var\(--ink\)' is not read"),
        (f'<path fill="url(other.svg#p)" d="{SQUARE}"/>', "refers to 'other.svg#p', and other files are not read"),
        ('<use href="http://example.org/a.svg#p"/>', "other files are not read"),
        ('<g id="a"><use href="#a"/></g>', "<use>: it refers to itself"),
        (f'<path stroke="#000" stroke-dasharray="2 1" d="{SQUARE}"/>', "its line is dashed"),
        (f'<path marker-end="url(#a)" d="{SQUARE}"/>', "its markers are not read"),
        (f'<path transform="turn(90)" d="{SQUARE}"/>', r"transform='turn\(90\)' cannot be read"),
        (f'<path transform="scale(2" d="{SQUARE}"/>', r"transform='scale\(2' cannot be read"),
        (f'<path transform="rotate(9)" transform-origin="5 5" d="{SQUARE}"/>', "transform-origin is not read"),
        (f'<path style="transform:rotate(9deg)" d="{SQUARE}"/>', "a style sets 'transform' of <path>"),
        (f'<style>g > path{{fill:none}}</style><path d="{SQUARE}"/>', "selects 'g > path', which is not read"),
        (f'<style>@media print{{path{{fill:none}}}}</style><path d="{SQUARE}"/>', "@media, which is not read"),
        (f'<path d="{SQUARE}"><animate attributeName="d"/></path>', "<path>: it is animated"),
        ('<rect width="2em" height="9"/>', "<rect>: width='2em' is no length that is read"),
        ('<circle r="9m"/>', "<circle>: r='9m' is no length"),
        ('<circle id="c" r="1e300"/>', "<circle id='c'>: it has the number 1e\\+300; at most 1e\\+09"),
        ('<path id="p" d="M0 0L1 1 L 5"/>', "<path id='p'>: this is no path data"),
        ('<path d="M0 0A5 5 0 2 1 9 9Z"/>', "<path>: this is no path data"),
        ('<polygon points="0 0 9 9 3"/>', "its points are not all of two numbers"),
        ("<path d='M0 0", "this is no SVG: .*line 1, column"),
        ('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 0 9"/>', "viewBox='0 0 0 9' is no box"),
        ("<?xml version='1.0'?><html/>", "its root is <html>"),
        ("<?xml version='1.0'?><?xml-stylesheet href='a.css'?><svg/>", "a style sheet outside of the file"),
        ("<style>@import url(http://example.org/a.css);</style>", "has @import, which is not read"),
        (
            '<!DOCTYPE svg [<!ENTITY x SYSTEM "file:///etc/passwd">]><svg><path d="&x;"/></svg>',
            "declares the entity 'x'",
        ),
        ('<!DOCTYPE svg [<!ENTITY a "1"><!ENTITY b "&a;&a;">]><svg><path d="&b;"/></svg>', "declares the entity 'a'"),
        (
            f'<path d="{SQUARE}"/><rect fill="white" opacity=".5" width="99" height="99"/>',
            "white that one sees through",
        ),
    ],
)
def test_what_cannot_be_read_rightly_is_refused(painted, content, reason):
    with pytest.raises(ValueError, match=reason):
        painted(content)


def test_the_message_names_section_file_and_element(tmp_path):
    file = tmp_path / "flake.svg"
    file.write_text(f'{HEAD}><text id="t1">snow</text></svg>')
    with pytest.raises(
        ConfigError, match=r"^floor\.outline: .*flake\.svg: <text id='t1'>: text is no outline"
    ) as caught:
        with_outline_read("floor", {"outline": {"kind": "svg", "file": str(file), "width": 50}})
    assert "\n" not in str(caught.value)


TANGLE = "".join(f"L{(i * 7919) % 1000} {(i * 104729) % 1000}" for i in range(20_000))


def nested_uses(levels: int) -> str:
    """A shape that is used ten times on each of some levels."""
    groups = [f"<g id='l{n}'>" + f"<use href='#l{n - 1}'/>" * 10 + "</g>" for n in range(1, levels + 1)]
    return f"<defs><path id='l0' d='{SQUARE}'/>{''.join(groups)}</defs><use href='#l{levels}'/>"


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (nested_uses(10), "more than 5,000 elements"),
        ("<g>" * 5000 + "</g>" * 5000, "nested more than 100 deep"),
        ("<g/>" * 30000, "more than 5,000 elements"),
        (f"<path d='M0 0{' L 5 6' * 300_000}Z'/>", "numbers in its paths"),
        (f"<path d='M0 0{' q 1 2 3 4' * 9_000}Z'/>", "more than 200,000 points along its curves"),
        (f"<path d='M0 0{TANGLE}Z'/>", "may cross or touch each other"),
        ("<path d='" + "M0 0" * 1_200_000 + "'/>", "bytes; at most 4,000,000"),
        ("<style>" + ".a{fill:red}" * 3000 + "</style>" + "<g/>" * 3000, "rules for"),
        ("<style>" + "(" * 100_000 + "</style><path d='M0 0H9V9Z'/>", "not read|cannot be read"),
    ],
)
def test_bombs_are_refused_in_time(painted, content, reason):
    started = time.monotonic()
    with pytest.raises(ValueError, match=reason):
        painted(content)
    assert time.monotonic() - started < 10
