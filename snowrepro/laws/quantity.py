"""What the solver keeps of each particle, described: one entry of the table of state."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..scene.build import Scene
from ..settings.case import Material


def zero(scene: Scene, material: Material) -> float:
    """Return 0, the first value of most quantities."""
    return 0.0


@dataclass(frozen=True)
class Quantity:
    """One particle quantity.

    ``shape``: () scalar, (2,) vector, (2, 2) matrix.  ``unit``: in powers of length L, mass M and
    time T, as ``units.text`` writes it.  ``first``: its value at the start, one for all particles or one
    each.  ``stored``: kept in each snapshot of a run.
    """

    name: str
    shape: tuple[int, ...]
    long_name: str
    unit: str
    first: Callable[[Scene, Material], float | np.ndarray] = zero
    stored: bool = False
