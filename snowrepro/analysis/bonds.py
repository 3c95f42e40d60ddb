"""Bonds between neighbours at release, and the largest stretch and crushing that each has seen since.

Distance alone cannot tell a heap of powder from a lump; a bond that broke stays broken even when its
ends meet again.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay, QhullError, cKDTree

LEAST_RATIO = 1e-12  # of lengths: ends that fell on each other


@dataclass(frozen=True)
class Bonds:
    """Pairs of particles bonded at release, ``pairs`` (m, 2), and their ``length`` (m,) then."""

    pairs: np.ndarray
    length: np.ndarray

    def chosen(self, which: np.ndarray) -> "Bonds":
        """The bonds that ``which`` (m,) marks."""
        return Bonds(self.pairs[which], self.length[which])


@dataclass(frozen=True)
class BondHistory:
    """Extremes since release: largest (``stretch`` >= 0) and smallest (``crush`` <= 0) log strain, each (m,)."""

    stretch: np.ndarray
    crush: np.ndarray

    def strain(self, by: str = "both") -> np.ndarray:
        """Largest |log strain| so far, shape (m,); ``by``: "both" signs, or "stretch" or "crush" alone."""
        return {
            "both": np.maximum(self.stretch, -self.crush),
            "stretch": self.stretch,
            "crush": -self.crush,
        }[by]

    def chosen(self, which: np.ndarray) -> "BondHistory":
        """The history of the bonds that ``which`` (m,) marks."""
        return BondHistory(self.stretch[which], self.crush[which])


def lay_bonds(positions: np.ndarray, longest: float) -> Bonds:
    """Delaunay edges of ``positions`` (n, 2 or 3) no longer than ``longest``.

    Where there is no triangulation (few particles, or all on one line) all pairs that near are bonded.
    """
    try:
        pairs = _edges(Delaunay(positions))
    except (QhullError, ValueError):
        pairs = cKDTree(positions).query_pairs(longest, output_type="ndarray").astype(np.int32)
    length = np.sqrt(_lengths2(positions, pairs))
    kept = (length <= longest) & (length > 0)
    return Bonds(pairs[kept], length[kept])


def _edges(mesh: Delaunay) -> np.ndarray:
    """Each edge of a triangulation once, (m, 2)."""
    if mesh.ndim == 2:  # an edge has two triangles, and is taken from the later one, or from the only one
        later = mesh.neighbors < np.arange(len(mesh.simplices))[:, None]
        return np.concatenate([mesh.simplices[later[:, k]][:, [k - 2, k - 1]] for k in range(3)])
    first, neighbours = mesh.vertex_neighbor_vertices
    own = np.repeat(np.arange(mesh.npoints, dtype=neighbours.dtype), np.diff(first))
    once = own < neighbours
    return np.stack([own[once], neighbours[once]], axis=1)


class Extremes:
    """Shortest and longest length of each bond so far, squared: ``extend`` it state by state."""

    def __init__(self, bonds: Bonds):
        self.bonds = bonds
        self.shortest2 = bonds.length**2
        self.longest2 = bonds.length**2

    def extend(self, positions: np.ndarray) -> None:
        """Take one more state into account, (n, 2 or 3); a bond whose end has vanished (NaN) is stretched for ever."""
        length2 = _lengths2(positions, self.bonds.pairs)
        np.minimum(self.shortest2, length2, out=self.shortest2, where=~np.isnan(length2))
        np.maximum(self.longest2, np.nan_to_num(length2, copy=False, nan=np.inf), out=self.longest2)

    def broken(self, break_strain: float) -> dict[str, float]:
        """Part of the bonds strained beyond ``break_strain``, by sign; see ``BondHistory.strain``."""
        length2 = self.bonds.length**2
        stretched = self.longest2 > length2 * np.exp(2 * break_strain)
        crushed = self.shortest2 < length2 * np.exp(-2 * break_strain)
        marks = {"both": stretched | crushed, "stretch": stretched, "crush": crushed}
        return {sign: float(mark.mean()) if len(mark) else 0.0 for sign, mark in marks.items()}

    def history(self) -> BondHistory:
        """The log strains that the lengths come to."""
        first2 = self.bonds.length**2
        return BondHistory(
            0.5 * np.log(self.longest2 / first2), 0.5 * np.log(np.maximum(self.shortest2 / first2, LEAST_RATIO**2))
        )


def history_of(bonds: Bonds, states: Iterable[np.ndarray]) -> BondHistory:
    """What bonds have seen through ``states``, each (n, 2 or 3)."""
    extremes = Extremes(bonds)
    for positions in states:
        extremes.extend(positions)
    return extremes.history()


def _lengths2(positions: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Squared distance between the two particles of each pair."""
    total = np.zeros(len(pairs))
    for axis in positions.T:
        along = np.ascontiguousarray(axis, dtype=float)
        total += (along.take(pairs[:, 0]) - along.take(pairs[:, 1])) ** 2
    return total
