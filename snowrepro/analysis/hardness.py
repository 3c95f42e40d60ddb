"""How hard snow is: what an indenter needs, how flat the fall makes the snow, and how it rebounds."""

from collections.abc import Sequence

import numpy as np

LAST = 0.1  # part of the depth, up to the whole of it, over which the hardness is taken: the force vibrates
BODY = (0.05, 0.95)  # quantiles of mass between which the body's height is measured: grains that fly do not count


def cut_curve(depth: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cut the frames of a hardness test out of a run, and take the depth at mid-frame.

    ``depth`` (frames,): of the indenter below first touch at the end of each frame, NaN before the test; ``force``
    (frames,): upward on the indenter, mean over each frame.  Returns depth and force (k,) of the k frames of the test.
    """
    tested = np.flatnonzero(np.isfinite(depth))
    half_a_frame = 0.5 * (depth[tested[-1]] - depth[tested[0]]) / (len(tested) - 1)
    return depth[tested] - half_a_frame, force[tested]


def measure_chord(depth: np.ndarray, radius: float) -> np.ndarray:
    """Width of a disc at ``depth`` above its lowest point, zero where that is negative; the same shape."""
    inside = np.clip(depth, 0.0, radius)
    return 2.0 * np.sqrt(inside * (2.0 * radius - inside))


def measure_hardness(depth: np.ndarray, force: np.ndarray, end: float, radius: float, cell: float) -> float:
    """Mean force over mean contact chord, in the last tenth of the way from first touch to the depth ``end``.

    ``depth``, ``force`` (k,): as ``cut_curve`` gives them; ``end`` and the disc's ``radius`` [cells]; ``cell``: a cell
    in the unit of ``depth``.
    """
    last = (depth >= (1.0 - LAST) * end * cell) & (depth <= end * cell)
    return float(force[last].mean() / measure_chord(depth[last], radius * cell).mean())


def measure_work(depth: np.ndarray, force: np.ndarray) -> float:
    """Work of the indenter at unit depth out of the plane, from its curve ``depth``, ``force`` (k,)."""
    return float(((force[1:] + force[:-1]) / 2.0 * np.diff(depth)).sum())


def measure_impact(heights: np.ndarray, speeds: np.ndarray) -> dict[str, float]:
    """How flat a fall makes a body, and how it rebounds.

    ``heights`` (frames,): of the body in each frame since the release; ``speeds`` (frames,): of its centre of mass,
    upward, since the release.  Returns ``flattening_most`` and ``flattening_end``, height lost since the release, as
    part of it; and ``rebound``, largest speed upward over speed of the impact, NaN for what never fell.
    """
    lowest = int(np.argmin(speeds))
    down, up = -float(speeds[lowest]), float(speeds[lowest:].max())
    return {
        "flattening_most": 1.0 - float(heights.min() / heights[0]),
        "flattening_end": 1.0 - float(heights[-1] / heights[0]),
        "rebound": max(0.0, up) / down if down > 0.0 else float("nan"),
    }


def measure_height(places: np.ndarray, mass: np.ndarray) -> float:
    """Height of the middle nine tenths of the mass; ``places``: of the particles along the upward axis; both (n,)."""
    low, high = find_quantiles(places, mass, BODY)
    return float(high - low)


def find_quantiles(values: np.ndarray, mass: np.ndarray, parts: Sequence[float]) -> np.ndarray:
    """The values (k,) below which ``parts`` (k,) of the mass lie, linear between the middles of neighbours.

    ``values`` and ``mass``: both (n,).
    """
    order = np.argsort(values, kind="stable")
    below = np.cumsum(mass[order])
    return np.interp(np.multiply(parts, below[-1]), below - 0.5 * mass[order], values[order])
