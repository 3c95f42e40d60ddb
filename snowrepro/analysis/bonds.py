"""Bonds between neighbours at release, and the largest stretch and crushing of each since then.

Distance alone cannot tell a heap of powder from a lump: a bond that broke stays broken even when its ends meet again.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay, QhullError

from .near import find_near_pairs, square_distances

LEAST_RATIO = 1e-12  # of lengths, where both ends came to one place


@dataclass(frozen=True)
class Bonds:
    """Pairs of particles bonded at release, ``pairs`` (m, 2), and their ``length`` (m,) then."""

    pairs: np.ndarray
    length: np.ndarray

    def select(self, is_wanted: np.ndarray) -> "Bonds":
        """Return the bonds for which ``is_wanted`` (m,) is true."""
        return Bonds(self.pairs[is_wanted], self.length[is_wanted])


@dataclass(frozen=True)
class BondHistory:
    """The extreme log strains of each bond since release: largest ``stretch`` >= 0, smallest ``crush`` <= 0; (m,)."""

    stretch: np.ndarray
    crush: np.ndarray

    def strain(self, by: str = "both") -> np.ndarray:
        """Return the largest |log strain| of each bond since release (m,).

        ``by``: the signs that count, "both", "stretch" or "crush".
        """
        return {
            "both": np.maximum(self.stretch, -self.crush),
            "stretch": self.stretch,
            "crush": -self.crush,
        }[by]

    def select(self, is_wanted: np.ndarray) -> "BondHistory":
        """Return the history of the bonds for which ``is_wanted`` (m,) is true."""
        return BondHistory(self.stretch[is_wanted], self.crush[is_wanted])


def lay_bonds(positions: np.ndarray, longest: float) -> Bonds:
    """Make bonds between neighbouring particles: Delaunay edges of ``positions`` (n, 2 or 3) up to length ``longest``.

    Where there is no triangulation (few particles, or all on one line), every pair at most ``longest`` apart is bonded.
    """
    try:
        pairs = _list_edges(Delaunay(positions))
    except (QhullError, ValueError):
        pairs = find_near_pairs(positions, longest).astype(np.int32)
    length = np.sqrt(square_distances(positions, pairs))
    is_bond = (length <= longest) & (length > 0)
    return Bonds(pairs[is_bond], length[is_bond])


def _list_edges(mesh: Delaunay) -> np.ndarray:
    """List each edge of a triangulation once, (m, 2)."""
    if mesh.ndim == 2:  # an edge has two triangles, and is taken from the later one, or from the only one
        later = mesh.neighbors < np.arange(len(mesh.simplices))[:, None]
        return np.concatenate([mesh.simplices[later[:, k]][:, [k - 2, k - 1]] for k in range(3)])
    first, neighbours = mesh.vertex_neighbor_vertices
    own = np.repeat(np.arange(mesh.npoints, dtype=neighbours.dtype), np.diff(first))
    is_first = own < neighbours  # each edge is listed from both its ends
    return np.stack([own[is_first], neighbours[is_first]], axis=1)


class Extremes:
    """The shortest and the longest length of each bond up to now, squared; ``extend`` takes one more state."""

    def __init__(self, bonds: Bonds) -> None:
        self.bonds = bonds
        self.shortest2 = bonds.length**2
        self.longest2 = bonds.length**2

    def extend(self, positions: np.ndarray) -> None:
        """Take one more state (n, 2 or 3) into account.

        A bond whose end has vanished (NaN) is stretched without limit from then on.
        """
        length2 = square_distances(positions, self.bonds.pairs)
        np.minimum(self.shortest2, length2, out=self.shortest2, where=~np.isnan(length2))
        np.maximum(self.longest2, np.nan_to_num(length2, copy=False, nan=np.inf), out=self.longest2)

    def measure_broken(self, break_strain: float) -> dict[str, float]:
        """Return which part of the bonds was strained beyond ``break_strain``, by sign as in ``BondHistory.strain``."""
        length2 = self.bonds.length**2
        by_stretch = self.longest2 > length2 * np.exp(2 * break_strain)
        by_crush = self.shortest2 < length2 * np.exp(-2 * break_strain)
        is_broken = {"both": by_stretch | by_crush, "stretch": by_stretch, "crush": by_crush}
        return {sign: float(broken.mean()) if len(broken) else 0.0 for sign, broken in is_broken.items()}

    def to_history(self) -> BondHistory:
        """Return the log strains of these lengths."""
        first2 = self.bonds.length**2
        return BondHistory(
            0.5 * np.log(self.longest2 / first2), 0.5 * np.log(np.maximum(self.shortest2 / first2, LEAST_RATIO**2))
        )


def follow_bonds(bonds: Bonds, states: Iterable[np.ndarray]) -> BondHistory:
    """Return the extreme strains of ``bonds`` over ``states``, each (n, 2 or 3)."""
    extremes = Extremes(bonds)
    for positions in states:
        extremes.extend(positions)
    return extremes.to_history()
