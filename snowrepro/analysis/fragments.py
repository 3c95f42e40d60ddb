"""Fragments: connected components of the particles that surviving bonds hold together."""

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..config import Analysis
from .bonds import BondHistory, Bonds, extend, lay_bonds, unstrained


@dataclass(frozen=True)
class Fragments:
    """What a body broke into at one frame.

    ``label`` (n,): fragment of each particle, 0 the heaviest; ``mass`` (k,) of each fragment, falling;
    ``is_lump`` (k,): heavy enough to be a lump, the rest is powder; ``broken``: part of the bonds that broke.
    """

    frame: int
    label: np.ndarray
    mass: np.ndarray
    is_lump: np.ndarray
    broken: float

    @property
    def lump_fraction(self) -> float:
        """Part of the mass that is in lumps."""
        return float(self.mass[self.is_lump].sum() / self.mass.sum())

    @property
    def lumps(self) -> int:
        """Number of lumps."""
        return int(self.is_lump.sum())

    @property
    def largest(self) -> float:
        """Part of the mass that is in the heaviest fragment."""
        return float(self.mass[0] / self.mass.sum())

    @property
    def joined(self) -> float:
        """Chance that two random bits of snow are still joined: the sum of squared mass parts."""
        return float(((self.mass / self.mass.sum()) ** 2).sum())


def classify(dataset: xr.Dataset, analysis: Analysis | None = None) -> Fragments:
    """Fragments of a run at its last frame.

    ``dataset`` as ``simulate`` returns it; ``analysis`` defaults to the run's own.
    """
    return classify_frames(dataset, [int(dataset["snapshot"][-1])], analysis)[0]


def classify_frames(dataset: xr.Dataset, frames: Sequence[int], analysis: Analysis | None = None) -> list[Fragments]:
    """Fragments at each of ``frames`` (stored frames, none before release), in rising order.

    Raises ValueError where a frame is not stored or lies before release.
    """
    analysis = analysis or analysis_of(dataset)
    bonds, histories = bond_histories(dataset, frames, analysis.link_length)
    return [fragments_of(dataset, frame, bonds, history, analysis) for frame, history in histories.items()]


def analysis_of(dataset: xr.Dataset) -> Analysis:
    """The settings that a run was asked to be classified with."""
    return Analysis.model_validate(json.loads(dataset.attrs["config"])["analysis"])


def bond_histories(
    dataset: xr.Dataset, frames: Sequence[int], link_length: float
) -> tuple[Bonds, dict[int, BondHistory]]:
    """Bonds laid at release, and what they have seen up to each of ``frames``.

    Strains are taken at every stored frame in between, so a bond that broke stays broken.
    ``link_length`` in grid spacings.  Raises ValueError as ``classify_frames``.
    """
    release = int(dataset.attrs["release_frame"])
    snapshots = dataset["snapshot"].values
    missing = sorted(set(frames) - set(snapshots[snapshots >= release].tolist()))
    if missing:
        raise ValueError(f"frames {missing} are not stored at or after the release in frame {release}")
    used = snapshots[(snapshots >= release) & (snapshots <= max(frames))]
    positions = dataset["position"].sel(snapshot=used).values.astype(float)
    bonds = lay_bonds(positions[0], link_length * float(dataset.attrs["grid_spacing"]))
    history = unstrained(bonds)
    seen = {}
    for frame, places in zip(used.tolist(), positions, strict=True):
        history = extend(history, bonds, places)
        if frame in frames:
            seen[frame] = history
    return bonds, seen


def fragments_of(dataset: xr.Dataset, frame: int, bonds: Bonds, history: BondHistory, analysis: Analysis) -> Fragments:
    """Components of the bonds that survive, connected through core particles only.

    A core particle has lost less than ``core_fraction`` of its bonds.  Others join the core they are
    still bonded to (by the least strained bond), so a bridge of damaged particles joins nothing.
    """
    mass = dataset["mass"].values
    # In cells of the paper's grid, so that a lump is the same at every fidelity.
    least = max(analysis.lump_mass * float(mass.sum()), analysis.lump_cells * float(dataset.attrs["cell_mass"]))
    count = len(mass)
    broken = history.broken(analysis.break_strain, analysis.break_by)
    degree = np.bincount(bonds.pairs.ravel(), minlength=count)
    lost = np.bincount(bonds.pairs[broken].ravel(), minlength=count)
    core = lost < analysis.core_fraction * degree

    alive = bonds.pairs[~broken]
    both = alive[core[alive].all(axis=1)]
    graph = coo_matrix((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(count, count))
    _, component = connected_components(graph, directed=False)

    strain = np.maximum(history.stretch, -history.crush)[~broken]
    one = core[alive].sum(axis=1) == 1
    order = np.argsort(-strain[one], kind="stable")  # the least strained bond is assigned last and wins
    border = alive[one][order]
    core_first = np.where(core[border[:, :1]], border, border[:, ::-1])
    component[core_first[:, 1]] = component[core_first[:, 0]]

    label, fragment_mass = _by_falling_mass(component, mass)
    part_broken = float(broken.mean()) if len(broken) else 0.0
    return Fragments(frame, label, fragment_mass, fragment_mass >= least * (1 - 1e-12), part_broken)


def _by_falling_mass(component: np.ndarray, mass: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Relabel components so that 0 is the heaviest; equal masses keep the order of their first particle."""
    _, first, inverse = np.unique(component, return_index=True, return_inverse=True)
    total = np.bincount(inverse, weights=mass)
    order = np.lexsort((first, -total))
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return rank[inverse], total[order]
