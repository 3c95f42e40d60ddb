"""The colours of lumps, crushed and loose snow: who can tell them apart, and which lumps have the same."""

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread

from snowrepro.report.drawing.common import DPI, FLOOR, SINTERED, SKY, SNOW, save_figure
from snowrepro.report.drawing.states import CRUSHED, LOOSE, LUMPS, colour_fragments, find_lumps_beside
from snowrepro.summary.classify import classify
from tests.analysis.bodies import break_apart, crush_below, fill_disc

# What is left of red, green and blue in full colour blindness (Machado, Oliveira and Fernandes 2009).
SIGHTS = {
    "usual": np.eye(3),
    "without red": [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
    "without green": [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]],
    "without blue": [[1.256, -0.077, -0.179], [-0.078, 0.931, 0.148], [0.005, 0.691, 0.304]],
}
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = TO_XYZ.sum(axis=1)
APART = 20.0  # in CIELAB, where 2.3 is what an eye just sees


def see(colour: str, sight: str) -> np.ndarray:
    """Where a colour is in CIELAB, for some eyes."""
    linear = np.array([part / 12.92 if part < 0.04 else ((part + 0.055) / 1.055) ** 2.4 for part in to_rgb(colour)])
    x, y, z = np.cbrt(TO_XYZ @ (np.array(SIGHTS[sight]) @ linear).clip(0, 1) / WHITE)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("sight", SIGHTS)
def test_everybody_tells_the_colours_apart(sight):
    drawn = [*LUMPS, CRUSHED, LOOSE]
    pairs = [*combinations(drawn, 2), *((colour, behind) for colour in drawn for behind in (SKY, FLOOR))]
    close = {pair: np.linalg.norm(see(pair[0], sight) - see(pair[1], sight)) for pair in pairs}
    assert {pair: distance for pair, distance in close.items() if distance < APART} == {}


def test_lumps_beside_each_other_have_different_colours():
    """When they come apart, and at the end, where other lumps are their neighbours."""
    disc = fill_disc(1)
    pieces = break_apart(disc, 12)
    label = classify(np.stack([disc, pieces]), release=0, grid_spacing=1.0, cell_mass=1.0).last.label
    centres = np.array([pieces[label == number].mean(axis=0) for number in range(label.max() + 1)])
    together = pieces - 0.8 * centres[label]
    found = classify(np.stack([disc, pieces, together]), release=0, grid_spacing=1.0, cell_mass=1.0, frames="all")
    assert found.last.lumps > len(LUMPS)
    colours = colour_fragments(found)[-1]
    beside = find_lumps_beside(found.last, found.motion)
    assert sum(map(len, beside.values())) >= 6
    for lump, others in beside.items():
        own, theirs = (set(colours[np.isin(found.last.id[found.last.label], ids)]) for ids in ([lump], [*others]))
        assert not own & theirs - {CRUSHED, LOOSE}


def test_a_particle_has_the_colour_of_its_largest_part():
    disc = fill_disc()
    found = classify(np.stack([disc, crush_below(disc)]), release=0, grid_spacing=1.0, cell_mass=4.0)
    (colours,) = colour_fragments(found)
    for place, chosen in enumerate((LUMPS[0], CRUSHED)):
        largest = found.last.states.argmax(axis=1) == place
        assert 0.2 < largest.mean() < 0.8
        assert set(colours[largest]) == {chosen}


def test_a_picture_is_small_and_keeps_its_colours(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    figure = Figure(figsize=(6, 6))
    figure.subplots().scatter(*rng.random((2, 500)), c=rng.choice(np.array([SNOW, FLOOR, SINTERED]), 500), s=400)
    figure.savefig(tmp_path / "full.png", dpi=DPI)
    save_figure(figure, tmp_path / "kept.png")
    save_figure(figure, tmp_path / "again.png")
    full, kept = (imread(tmp_path / name)[..., :3] for name in ("full.png", "kept.png"))
    assert np.abs(full - kept).mean() < 0.002
    assert (np.abs(full - kept) > 0.1).mean() < 0.001
    assert (tmp_path / "kept.png").stat().st_size < 0.6 * (tmp_path / "full.png").stat().st_size
    assert (tmp_path / "kept.png").read_bytes() == (tmp_path / "again.png").read_bytes()
