"""Pictures in few colours, so that they are small."""

import numpy as np
from PIL import Image

MOST_EXACT = 0.5  # part of the colours that are some of the picture's own


def reduce_colours(image: Image.Image, count: int) -> Image.Image:
    """An RGB image in at most ``count`` colours: those that are there most often as they are, the others near theirs.

    Median cuts alone would give small marks, such as those of a legend, one colour for two.
    """
    pixels = np.asarray(image).astype(np.int32)
    found, places, numbers = np.unique((pixels @ (65536, 256, 1)).ravel(), return_inverse=True, return_counts=True)
    colours = np.stack([found // 65536, found // 256 % 256, found % 256], axis=1)
    is_kept = np.zeros(len(colours), dtype=bool)
    is_kept[np.argsort(-numbers, kind="stable")[: round(MOST_EXACT * count)]] = True
    palette = colours[is_kept]
    if not is_kept.all():
        others = Image.fromarray(colours[places[~is_kept[places]]].astype(np.uint8)[None])
        cuts = others.quantize(count - len(palette), Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE).getpalette()
        palette = np.concatenate([palette, np.reshape(cuts or [], (-1, 3))])[:count]
    reduced = Image.fromarray(_find_nearest(colours, palette)[places].reshape(pixels.shape[:2]).astype(np.uint8))
    reduced.putpalette(palette.astype(np.uint8).tobytes())
    return reduced


def _find_nearest(colours: np.ndarray, palette: np.ndarray) -> np.ndarray:
    """Find for each of ``colours`` (n, 3) the number of the nearest in ``palette`` (m, 3)."""
    nearest, least = np.zeros(len(colours), dtype=int), np.full(len(colours), np.iinfo(np.int64).max)
    for number, colour in enumerate(palette.astype(np.int64)):
        distance = ((colours - colour) ** 2).sum(axis=1)
        nearest[distance < least] = number
        least = np.minimum(least, distance)
    return nearest
