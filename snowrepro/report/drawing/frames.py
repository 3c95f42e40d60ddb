"""Which stored state of a run stands for a frame: runs end at rest, each in another frame."""

from collections.abc import Sequence

import numpy as np


def hold_frames(stored: Sequence[int] | np.ndarray, frames: Sequence[int]) -> list[int]:
    """Find for each of ``frames`` the last of the ``stored`` ones, rising, that is not after it."""
    places = np.searchsorted(stored, frames, side="right") - 1
    return [int(stored[place]) for place in np.maximum(places, 0)]
