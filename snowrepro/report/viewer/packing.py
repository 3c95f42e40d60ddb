"""Whole numbers as short text that a browser unpacks: zigzag, byte planes, deflate, base64.

Numbers that change little, in time or along the particles, are best given as ``differences``.
"""

import base64
import zlib

import numpy as np


def pack(values: np.ndarray) -> str:
    """Pack whole numbers of any shape as text; bytes (uint8) as they are, others as signed numbers of 32 bits.

    Of the latter all lowest bytes come first, then all second ones: those above the first are mostly zero.
    """
    if values.dtype != np.uint8:
        signed = values.astype(np.int64)
        zigzag = ((signed << 1) ^ (signed >> 63)).astype("<u4")  # small numbers of either sign become small
        values = zigzag.ravel().view(np.uint8).reshape(-1, 4).T
    return base64.b64encode(zlib.compress(np.ascontiguousarray(values).tobytes(), 9)).decode("ascii")


def take_differences(values: np.ndarray) -> np.ndarray:
    """Subtract from each number the one before along the first axis; the first stays, and bytes (uint8) wrap around."""
    return np.concatenate([values[:1], np.diff(values, axis=0)])


def round_to_levels(values: np.ndarray, low: float, high: float, count: int) -> np.ndarray:
    """Round to the nearest of ``count`` even levels from ``low`` to ``high``; returns their numbers, uint8."""
    part = (values - low) / (high - low) if high > low else np.zeros_like(values)
    return np.rint(np.clip(part, 0.0, 1.0) * (count - 1)).astype(np.uint8)
