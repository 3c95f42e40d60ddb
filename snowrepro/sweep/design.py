"""Designs: which places of the unit cube of the sampled settings are run.

Those of Sobol, Morris and Saltelli grow: the first places of a larger design are those of a smaller one, so their runs
are there already.  A Latin hypercube of another size is another design.
"""

import warnings
from collections.abc import Callable

import numpy as np
from scipy.stats import qmc

from ..settings.design import Design

LEVELS = 4  # of a Morris path in each setting: 0, 1/3, 2/3, 1
STEP = LEVELS / (2 * (LEVELS - 1))


def count_places(design: Design, dims: int) -> int:
    """Count the places of a design in ``dims`` settings."""
    return design.points * get_block(design, dims)


def get_block(design: Design, dims: int) -> int:
    """Return how many places belong together: a path of Morris, a point of Saltelli, else 1."""
    return {"morris": dims + 1, "saltelli": dims + 2}.get(design.name, 1)


def make_places(design: Design, dims: int) -> np.ndarray:
    """Make the places of a design, (count_places, dims), each from 0 to 1; the same for the same design."""
    return _DESIGNS[design.name](dims, design.points, design.seed)


def _make_sobol(dims: int, points: int, seed: int) -> np.ndarray:
    """Make the first points of a scrambled Sobol sequence."""
    with warnings.catch_warnings():  # that the number is no power of 2
        warnings.simplefilter("ignore", UserWarning)
        return qmc.Sobol(dims, seed=np.random.default_rng(seed)).random(points)


def _make_latin(dims: int, points: int, seed: int) -> np.ndarray:
    """Make a Latin hypercube."""
    return qmc.LatinHypercube(dims, seed=np.random.default_rng(seed)).random(points)


def _make_morris(dims: int, paths: int, seed: int) -> np.ndarray:
    """Make paths that move one setting at a time by STEP, each once (Morris 1991); a path of its own seed each."""
    places = []
    for path in range(paths):
        rng = np.random.default_rng([seed, path])
        start = rng.integers(LEVELS, size=dims) / (LEVELS - 1)
        order = rng.permutation(dims)
        moved = np.argsort(order)[None, :] < np.arange(dims + 1)[:, None]  # (place on the path, setting)
        places.append(start + moved * np.where(start < 0.5, STEP, -STEP))
    return np.clip(np.concatenate(places), 0.0, 1.0)  # rounding aside


def _make_saltelli(dims: int, points: int, seed: int) -> np.ndarray:
    """Make for each point A and B of a Sobol sequence: A, A with one setting of B for each setting, and B."""
    both = _make_sobol(2 * dims, points, seed)
    a, b = both[:, None, :dims], both[:, None, dims:]
    mixed = np.where(np.eye(dims, dtype=bool), b, a)  # (point, setting taken of B, setting)
    return np.concatenate([a, mixed, b], axis=1).reshape(-1, dims)


_DESIGNS: dict[str, Callable[[int, int, int], np.ndarray]] = {
    "sobol": _make_sobol,
    "latin": _make_latin,
    "morris": _make_morris,
    "saltelli": _make_saltelli,
}
