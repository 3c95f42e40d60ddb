"""Four definitions of what holds particles together: bonds and their history, and three rules to compare that with.

The other rules use one frame alone, or do not know which of the bonds broke; each fails in a case that a test shows:
``proximity`` and ``grid`` take a settled heap of powder for a lump.
"""

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from ..settings.analysis import Analysis
from .bonds import BondHistory, Bonds
from .motion import Motion
from .near import find_near_pairs
from .tree import find_components, find_core_strain, find_holding_strain, sort_by_particle


def connect_by_bonds(count: int, bonds: Bonds, history: BondHistory, analysis: Analysis) -> np.ndarray:
    """Number the components (count,) of particles that unbroken bonds join through core particles: see ``tree``."""
    halves = sort_by_particle(bonds.pairs, history.strain(analysis.break_by), count)
    weight = find_holding_strain(halves, find_core_strain(halves, analysis.core_fraction))
    return find_components(bonds.pairs[weight <= analysis.break_strain], count)


def connect_by_proximity(motion: Motion, index: int, analysis: Analysis) -> np.ndarray:
    """Number the components (n,) of particles nearer than ``analysis.proximity`` in the state at ``index``.

    Cluster tools do the same: friends of friends.
    """
    return _connect_near(motion, index, ~motion.vanished[index], analysis.proximity)


def connect_by_grid(motion: Motion, index: int) -> np.ndarray:
    """Number the components (n,) of particles in grid cells that touch, over edges or corners.

    The solver itself cannot pull such particles apart.
    """
    is_there = ~motion.vanished[index]
    cell = np.floor(motion.position[index][is_there].astype(float) / motion.grid_spacing).astype(np.int64)
    occupied, own = np.unique(cell, axis=0, return_inverse=True)
    touching = cKDTree(occupied).query_pairs(1.5, p=np.inf, output_type="ndarray")
    component = np.full(len(is_there), -1)
    component[is_there] = find_components(touching, len(occupied))[own.ravel()]
    return component


def connect_by_damage(motion: Motion, index: int, bonds: Bonds, history: BondHistory, analysis: Analysis) -> np.ndarray:
    """Number the components (n,) of particles that are nearer than a bond may be long, and hardly damaged.

    As in peridynamics, the damage of a particle is the part of its bonds that broke; it must be less than
    ``analysis.damage``.
    """
    at_release, broken = count_bonds(bonds, history, analysis, motion.position.shape[1])
    is_solid = (broken < analysis.damage * at_release) & ~motion.vanished[index]
    return _connect_near(motion, index, is_solid, analysis.link_length)


def count_bonds(bonds: Bonds, history: BondHistory, analysis: Analysis, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Count the bonds that each of ``count`` particles had at release, and those of them that broke, each (count,)."""
    broken = history.strain(analysis.break_by) > analysis.break_strain
    at_release = np.bincount(bonds.pairs.ravel(), minlength=count)
    return at_release, np.bincount(bonds.pairs[broken].ravel(), minlength=count)


# By the name of a definition in the settings: component of each particle (n,), any whole numbers, in the state at an
# index of a motion.
DEFINITIONS: dict[str, Callable[[Motion, int, Bonds, BondHistory, Analysis], np.ndarray]] = {
    "bonds": lambda motion, _, bonds, history, analysis: connect_by_bonds(
        motion.position.shape[1], bonds, history, analysis
    ),
    "proximity": lambda motion, index, _bonds, _history, analysis: connect_by_proximity(motion, index, analysis),
    "grid": lambda motion, index, *_: connect_by_grid(motion, index),
    "damage": connect_by_damage,
}


def _connect_near(motion: Motion, index: int, is_solid: np.ndarray, spacings: float) -> np.ndarray:
    """Number the components (n,) of solid particles nearer than ``spacings`` grid spacings; the others are alone."""
    solid = np.flatnonzero(is_solid)
    places = motion.position[index][solid].astype(float)
    pairs = find_near_pairs(places, spacings * motion.grid_spacing)
    return find_components(solid[pairs], len(is_solid))
