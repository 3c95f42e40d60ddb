"""Images as other programs write them: turned, deep, light on dark, see-through, damaged, huge."""

import struct
import zlib

import numpy as np
import pytest
from PIL import Image, ImageDraw

from snowrepro.composition.drawings import with_outline_read
from snowrepro.errors import ConfigError
from snowrepro.scene import outline as geometry
from snowrepro.settings.case import Outline


def read(file, region: str | None = None) -> Outline:
    given = {"kind": "image", "file": str(file), "width": 40, **({"region": region} if region else {})}
    return Outline.model_validate(with_outline_read("shape", {"outline": given})["outline"])


@pytest.fixture
def wedge() -> Image.Image:
    """A black triangle on white, its point down and to the left: no turn of it is the same."""
    image = Image.new("L", (120, 90), 255)
    ImageDraw.Draw(image).polygon([(20, 20), (100, 20), (35, 70)], fill=0)
    return image


def is_wedge(outline: Outline) -> bool:
    """Whether the outline is that triangle, upright."""
    wide = geometry.extent(outline)[1]
    inside, _ = geometry.signed_distance(outline, np.array([[8.0, 3.0], [35.0, 23.0], [30.0, 3.0]]))
    return bool(np.allclose(wide, [40, 25], atol=0.6) and (np.sign(inside) == [-1, -1, 1]).all())


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_camera_that_was_turned(tmp_path, wedge, orientation):
    """The pixels lie otherwise, and a viewer turns them back."""
    undo = {2: 0, 3: 3, 4: 1, 5: 5, 6: 2, 7: 6, 8: 4}  # Pillow's turns that bring the pixels there
    lying = wedge.transpose(undo[orientation]) if orientation > 1 else wedge
    exif = Image.Exif()
    exif[0x0112] = orientation
    lying.save(tmp_path / "camera.jpg", exif=exif, quality=95)
    assert is_wedge(read(tmp_path / "camera.jpg"))


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA", "CMYK", "YCbCr"])
@pytest.mark.parametrize("kind", ["png", "tiff", "bmp", "webp", "gif", "jpg"])
def test_every_kind_of_pixels(tmp_path, wedge, mode, kind):
    try:
        wedge.convert(mode).save(tmp_path / f"drawing.{kind}")
    except (OSError, ValueError):
        pytest.skip("this kind of file has no such pixels")
    assert is_wedge(read(tmp_path / f"drawing.{kind}"))


@pytest.mark.parametrize("kind", ["png", "tiff", "pgm"])
@pytest.mark.parametrize(("dark", "light"), [(20000, 60000), (0, 65535), (300, 40000)])
def test_sixteen_bits(tmp_path, wedge, kind, dark, light):
    grey = np.where(np.asarray(wedge) > 0, light, dark).astype(np.uint16)
    Image.fromarray(grey).save(tmp_path / f"deep.{kind}")
    assert is_wedge(read(tmp_path / f"deep.{kind}"))


def test_light_on_dark(tmp_path, wedge):
    """Is refused with the remedy, and read when it is told to."""
    file = tmp_path / "light.png"
    Image.eval(wedge, lambda value: 255 - value).save(file)
    with pytest.raises(ConfigError, match=r"light\.png: its dark region meets the image's edge.*set region: light$"):
        read(file)
    assert is_wedge(read(file, "light"))
    clear = Image.new("RGBA", wedge.size, (255, 255, 255, 0))
    clear.paste((255, 255, 255, 255), mask=Image.eval(wedge, lambda value: 255 - value))
    clear.save(file)
    with pytest.raises(ConfigError, match=r"has no dark region .*set region: light"):
        read(file)
    assert is_wedge(read(file, "light"))


def write_png_head(file, width: int, height: int) -> None:
    """A small PNG that says that it is of this size."""
    head = struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0)
    parts = ((b"IHDR", head), (b"IDAT", zlib.compress(b"\0" * 1000)), (b"IEND", b""))
    body = (struct.pack(">I", len(c)) + t + c + struct.pack(">I", zlib.crc32(t + c)) for t, c in parts)
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(body))


@pytest.mark.parametrize(
    ("size", "reason"),
    [
        ((60_000, 60_000), r"too many pixels; at most 25,000,000 can be read: shrink it \(.*3600000000"),
        ((9_000, 9_000), "9,000 x 9,000 = 81,000,000 pixels; at most 25,000,000 can be read"),
        ((11_000, 11_000), "121,000,000 pixels; at most"),
        ((1, 1), "1 x 1 pixels; at least 3 x 3 are needed"),
        ((2, 500), "2 x 500 pixels; at least 3 x 3"),
        ((1000, 1000), "cannot be read as an image"),
    ],
)
def test_sizes_are_refused_by_the_head(tmp_path, size, reason):
    write_png_head(tmp_path / "head.png", *size)
    with pytest.raises(ConfigError, match=reason) as caught:
        read(tmp_path / "head.png")
    assert "\n" not in str(caught.value)


def test_what_would_be_misread_is_refused(tmp_path, wedge):
    frames = [wedge, wedge.rotate(90)]
    frames[0].save(tmp_path / "moving.gif", save_all=True, append_images=frames[1:])
    Image.fromarray(np.asarray(wedge, dtype=np.float32)).save(tmp_path / "float.tiff")
    Image.fromarray(np.asarray(wedge, dtype=np.int32) * 70000).save(tmp_path / "int.tiff")
    (tmp_path / "program.png").write_text("%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\nshowpage\n")
    noise = np.random.default_rng(0).integers(0, 256, (1200, 1200), dtype=np.uint8)
    Image.fromarray(np.pad(noise, 9, constant_values=255)).save(tmp_path / "noise.png")
    for file, reason in [
        ("moving.gif", "has several pictures"),
        ("float.tiff", "more than 16 bits"),
        ("int.tiff", "more than 16 bits"),
        ("program.png", "cannot be read as an image"),
        ("noise.png", "is dark beside light at 1,[0-9,]* places; at most 1,000,000"),
    ]:
        with pytest.raises(ConfigError, match=reason):
            read(tmp_path / file)
    with pytest.raises(ConfigError, match="has no dark region"):
        Image.new("L", (50, 50), 255).save(tmp_path / "white.png")
        read(tmp_path / "white.png")


@pytest.mark.parametrize("bits", [8, 16])
def test_a_tiff_whose_zero_is_white(tmp_path, wedge, bits):
    """As scanners and fax write them."""
    grey = (np.asarray(wedge, dtype=np.uint16) * (257 if bits == 16 else 1)).astype(f"<u{bits // 8}")
    rows = (~grey).astype(grey.dtype).tobytes()
    entries = [
        (256, 3, 120),
        (257, 3, 90),
        (258, 3, bits),
        (259, 3, 1),
        (262, 3, 0),
        (273, 4, 200),
        (278, 3, 90),
        (279, 4, len(rows)),
    ]
    head = struct.pack("<2sHIH", b"II", 42, 8, len(entries))
    head += b"".join(struct.pack("<HHII", tag, kind, 1, value) for tag, kind, value in entries)
    (tmp_path / "scan.tiff").write_bytes(head.ljust(200, b"\0") + rows)
    assert is_wedge(read(tmp_path / "scan.tiff"))
