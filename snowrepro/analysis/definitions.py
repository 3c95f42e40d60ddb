"""What holds particles together: bonds and their history, or one of three rules to compare it with.

The rules see one frame alone, or forget which bond it was that broke; each is known to fail (see the tests):
``proximity`` and ``grid`` take a settled heap of powder for a lump.
"""

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from ..config import Analysis
from .bonds import BondHistory, Bonds
from .motion import Motion
from .tree import components, core_strain, half_bonds, holding_strain


def by_bonds(motion: Motion, index: int, bonds: Bonds, history: BondHistory, analysis: Analysis) -> np.ndarray:
    """Bonds that never broke, connected through core particles: ``tree``."""
    strain = history.strain(analysis.break_by)
    count = motion.position.shape[1]
    halves = half_bonds(bonds.pairs, strain, count)
    weight = holding_strain(halves, core_strain(halves, analysis.core_fraction))
    return components(bonds.pairs[weight <= analysis.break_strain], count)


def by_proximity(motion: Motion, index: int, bonds: Bonds, history: BondHistory, analysis: Analysis) -> np.ndarray:
    """All pairs nearer than ``analysis.proximity`` now, as cluster tools do (friends of friends)."""
    return _near(motion, index, ~motion.vanished[index], analysis.proximity)


def by_grid(motion: Motion, index: int, bonds: Bonds, history: BondHistory, analysis: Analysis) -> np.ndarray:
    """Particles in grid cells that touch, over edges or corners: what the solver itself cannot pull apart."""
    there = ~motion.vanished[index]
    cell = np.floor(motion.position[index][there].astype(float) / motion.grid_spacing).astype(np.int64)
    occupied, own = np.unique(cell, axis=0, return_inverse=True)
    touching = cKDTree(occupied).query_pairs(1.5, p=np.inf, output_type="ndarray")
    component = np.full(len(there), -1)
    component[there] = components(touching, len(occupied))[own.ravel()]
    return component


def by_damage(motion: Motion, index: int, bonds: Bonds, history: BondHistory, analysis: Analysis) -> np.ndarray:
    """Particles that lost less than ``analysis.damage`` of their bonds and are nearer than a bond may be long now.

    The gate of peridynamics: damage of a particle is the part of its bonds that broke.
    """
    laid, lost = bonds_lost(bonds, history, analysis, motion.position.shape[1])
    sound = (lost < analysis.damage * laid) & ~motion.vanished[index]
    return _near(motion, index, sound, analysis.link_length)


def bonds_lost(bonds: Bonds, history: BondHistory, analysis: Analysis, count: int) -> tuple[np.ndarray, np.ndarray]:
    """How many bonds each of ``count`` particles had at release, and how many of them broke, each (count,)."""
    broken = history.strain(analysis.break_by) > analysis.break_strain
    laid = np.bincount(bonds.pairs.ravel(), minlength=count)
    return laid, np.bincount(bonds.pairs[broken].ravel(), minlength=count)


DEFINITIONS: dict[str, Callable[[Motion, int, Bonds, BondHistory, Analysis], np.ndarray]] = {
    "bonds": by_bonds,
    "proximity": by_proximity,
    "grid": by_grid,
    "damage": by_damage,
}


def _near(motion: Motion, index: int, which: np.ndarray, spacings: float) -> np.ndarray:
    """Components of the particles ``which`` (n,) that lie within ``spacings`` grid spacings; the others are alone."""
    chosen = np.flatnonzero(which)
    places = motion.position[index][chosen].astype(float)
    pairs = cKDTree(places).query_pairs(spacings * motion.grid_spacing, output_type="ndarray")
    return components(chosen[pairs], len(which))
