"""Pictures in few colours."""

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from snowrepro.report.drawing.common import COLOURS, save_figure
from snowrepro.report.drawing.palette import reduce_colours

NEAR = 8  # levels of 255 that nobody sees


def test_small_marks_of_similar_colours_stay_apart():
    """Beside a picture that has all shades, eight small marks in dark colours, as in a legend."""
    generator = np.random.default_rng(1)
    pixels = generator.integers(0, 256, size=(300, 300, 3), dtype=np.uint8)
    pixels[:200] = 255
    marks = [(68 + 3 * i, 1 + 8 * i, 84 + 4 * i) for i in range(8)]
    for i, colour in enumerate(marks):
        pixels[10:16, 20 * i : 20 * i + 6] = colour
    reduced = reduce_colours(Image.fromarray(pixels), 64)
    assert len(reduced.getcolors()) <= 64
    shown = np.asarray(reduced.convert("RGB")).astype(int)
    for i, colour in enumerate(marks):
        assert abs(shown[12, 20 * i + 2] - colour).max() <= NEAR, colour


def test_a_legend_has_the_colours_of_its_points(tmp_path):
    """Drawn points and their legend's marks are the same colour in the file."""
    figure = Figure(figsize=(5, 4))
    ax = figure.subplots()
    shades = [(0.2 + 0.02 * i, 0.05 * i, 0.4) for i in range(8)]
    for i, shade in enumerate(shades):
        ax.plot([i], [i], "s", ms=8, color=shade, label=f"{i}")
    ax.imshow(np.random.default_rng(2).random((40, 40, 3)), extent=(0, 7, 8, 15))
    ax.legend(fontsize=6)
    save_figure(figure, tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as image:
        colours = image.convert("RGB").getcolors(10**6)
    assert len(colours) <= COLOURS
    for shade in shades:
        wanted = np.round(255 * np.array(shade))
        assert min(abs(np.array(colour) - wanted).max() for count, colour in colours if count > 30) <= NEAR, shade
