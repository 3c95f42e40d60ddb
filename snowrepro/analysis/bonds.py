"""Bonds between neighbours at release, and the largest stretch and crushing that each has seen since.

Distance alone cannot tell a heap of powder from a lump; a bond that broke stays broken even when its
ends meet again.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay


@dataclass(frozen=True)
class Bonds:
    """Pairs of particles bonded at release, ``pairs`` (m, 2), and their ``length`` (m,) then."""

    pairs: np.ndarray
    length: np.ndarray


@dataclass(frozen=True)
class BondHistory:
    """Extremes since release: largest (``stretch`` >= 0) and smallest (``crush`` <= 0) log strain, each (m,)."""

    stretch: np.ndarray
    crush: np.ndarray

    def broken(self, break_strain: float, by: str = "both") -> np.ndarray:
        """Bonds strained beyond ``break_strain``, shape (m,); ``by``: "both", or "stretch" or "crush" alone."""
        stretched, crushed = self.stretch > break_strain, self.crush < -break_strain
        return {"both": stretched | crushed, "stretch": stretched, "crush": crushed}[by]


def lay_bonds(positions: np.ndarray, longest: float) -> Bonds:
    """Delaunay edges of ``positions`` (n, 2) no longer than ``longest``."""
    if len(positions) < 3:
        pairs = np.zeros((0, 2), dtype=np.int64)
    else:
        triangles = Delaunay(positions).simplices
        edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        pairs = np.unique(np.sort(edges, axis=1), axis=0)
    length = _lengths(positions, pairs)
    kept = (length <= longest) & (length > 0)
    return Bonds(pairs[kept], length[kept])


def unstrained(bonds: Bonds) -> BondHistory:
    """The history at release."""
    zero = np.zeros(len(bonds.pairs))
    return BondHistory(zero, zero)


def extend(history: BondHistory, bonds: Bonds, positions: np.ndarray) -> BondHistory:
    """Take the strains of one more state into account; ``positions`` (n, 2)."""
    strain = np.log(np.maximum(_lengths(positions, bonds.pairs) / bonds.length, 1e-12))
    return BondHistory(np.maximum(history.stretch, strain), np.minimum(history.crush, strain))


def _lengths(positions: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Distance between the two particles of each pair."""
    difference = positions[pairs[:, 0]] - positions[pairs[:, 1]]
    return np.sqrt((difference**2).sum(axis=1))
