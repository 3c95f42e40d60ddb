"""Five definitions of what holds particles together: strain, see ``states``, and four rules to compare that with.

Each of the others fails in a case that a test shows: ``bonds`` hangs on how the particles lie and takes a flattened
body for powder; ``proximity`` and ``grid`` use one frame alone and take a settled heap of powder for a lump; ``damage``
does not know which of the bonds broke.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..settings.analysis import Analysis
from .bonds import BondHistory, Bonds
from .fragments import ROUND_OFF, Fragments, make_fragments
from .motion import Motion
from .near import find_near_pairs
from .states import Bodies, divide_mass
from .tree import find_components, find_core_strain, find_holding_strain, sort_by_particle


@dataclass(frozen=True)
class State:
    """What a frame of a motion, that at ``index``, is judged by.

    ``bonds`` and their ``history`` up to it, and the ``bodies`` of particles that hold together by strain.
    """

    motion: Motion
    index: int
    bonds: Bonds
    history: BondHistory
    bodies: Bodies


def connect_by_strain(bodies: Bodies) -> np.ndarray:
    """Number the components (n,) of particles that strain left together; one that hangs on none is alone."""
    is_alone = bodies.component < 0
    return np.where(is_alone, bodies.component.max() + np.cumsum(is_alone), bodies.component)


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


NEED_BONDS = ("bonds", "damage")
# By the name of a definition in the settings: component of each particle (n,), any whole numbers.
DEFINITIONS: dict[str, Callable[[State, Analysis], np.ndarray]] = {
    "strain": lambda state, _: connect_by_strain(state.bodies),
    "bonds": lambda state, analysis: connect_by_bonds(len(state.motion.mass), state.bonds, state.history, analysis),
    "proximity": lambda state, analysis: connect_by_proximity(state.motion, state.index, analysis),
    "grid": lambda state, _: connect_by_grid(state.motion, state.index),
    "damage": lambda state, analysis: connect_by_damage(
        state.motion, state.index, state.bonds, state.history, analysis
    ),
}


def find_fragments(state: State, analysis: Analysis, broken: float = float("nan")) -> Fragments:
    """Find the fragments in a state by the definition that ``analysis`` chooses; ``broken``: part of the bonds.

    What is in no lump is crushed or loose as its strain says, whatever the definition.
    """
    motion, bodies = state.motion, state.bodies
    least = motion.least_lump(analysis)
    component = DEFINITIONS[analysis.definition](state, analysis)
    whole = bodies.whole if analysis.definition == "strain" else np.ones(len(component))
    loose = divide_mass(bodies, motion.mass, least * (1 - ROUND_OFF))[:, 2]
    return make_fragments(int(motion.frames[state.index]), component, whole, loose, motion, least, broken)


def _connect_near(motion: Motion, index: int, is_solid: np.ndarray, spacings: float) -> np.ndarray:
    """Number the components (n,) of solid particles nearer than ``spacings`` grid spacings; the others are alone."""
    solid = np.flatnonzero(is_solid)
    places = motion.position[index][solid].astype(float)
    pairs = find_near_pairs(places, spacings * motion.grid_spacing)
    return find_components(solid[pairs], len(is_solid))
