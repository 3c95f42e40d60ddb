"""What an eye sees of one frame, as a witness: bodies of discs on a raster, from the places of particles alone.

It knows nothing of the past: not what came apart, nor what was crushed.  A picture in one piece is one body.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

COVER = 1.45  # diameter of a disc [spacings of unpressed snow]: discs on a square lattice just cover the snow
PIXELS = 2  # a cell
SIGHT = 500.0  # cells from the middle of the snow; what is farther away is out of the picture
TOUCHING = np.ones((3, 3))  # pixels that meet at a corner are connected
# Pixels apart and the weight of crossings along a direction, by which a perimeter is counted (Crofton): to the right,
# up and along both diagonals.
CROFTON = (((0, 1), 1.0), ((1, 0), 1.0), ((1, 1), 0.5**0.5), ((1, -1), 0.5**0.5))


@dataclass(frozen=True)
class Seen:
    """What is seen of a frame.

    ``bodies``: number of bodies of some size; ``largest``: part of the covered area in the largest; ``raggedness``: its
    perimeter squared over 4 pi times its area, without holes: 1 for a disc.
    """

    bodies: int
    largest: float
    raggedness: float


def look_at(places: np.ndarray, spacing: float, cell: float, least: float) -> Seen:
    """Look at particles at ``places`` (n, 2), drawn as discs; those that have vanished (NaN) are not seen.

    ``spacing``: of particles of unpressed snow; ``cell``: of the paper; ``least``: area of a body that counts [cells].
    """
    picture = draw_discs(places[~np.isnan(places).any(axis=1)], spacing, cell)
    label, count = ndimage.label(picture, TOUCHING)
    if not count:
        return Seen(0, 0.0, float("nan"))
    area = np.bincount(label.ravel())[1:]
    body = ndimage.binary_fill_holes(label == 1 + area.argmax())
    ragged = measure_perimeter(body) ** 2 / (4 * np.pi * body.sum())
    return Seen(int((area >= least * PIXELS**2).sum()), float(area.max() / area.sum()), float(ragged))


def draw_discs(places: np.ndarray, spacing: float, cell: float) -> np.ndarray:
    """Draw discs at ``places`` (n, 2): which pixels have their middle in one; with a free border all around."""
    if not len(places):
        return np.zeros((1, 1), dtype=bool)
    on_raster = (places.astype(float) - np.median(places, axis=0)) * (PIXELS / cell)
    on_raster = on_raster[(np.abs(on_raster) <= SIGHT * PIXELS).all(axis=1)]
    radius = COVER / 2 * spacing * PIXELS / cell
    reach = int(np.ceil(radius))
    own = np.floor(on_raster).astype(np.int64)
    corner = own.min(axis=0) - reach - 1
    picture = np.zeros(own.max(axis=0) - corner + reach + 2, dtype=bool)
    picture[tuple((own - corner).T)] = True  # however small a disc is
    for shift in np.ndindex(2 * reach + 1, 2 * reach + 1):
        pixel = own + np.array(shift) - reach
        is_in = ((pixel + 0.5 - on_raster) ** 2).sum(axis=1) <= radius**2
        picture[tuple((pixel[is_in] - corner).T)] = True
    return picture


def measure_perimeter(body: np.ndarray) -> float:
    """Measure the perimeter of a body on a raster with a free border [pixels]: right for a disc, nearly for others."""
    crossings = sum(weight * (body != np.roll(body, step, axis=(0, 1))).sum() for step, weight in CROFTON)
    return float(np.pi / 8 * crossings)
