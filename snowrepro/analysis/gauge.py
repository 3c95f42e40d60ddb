"""The strain gauge on a body of snow: its clusters, followed from state to state, and what became of its particles."""

from collections.abc import Iterator

import numpy as np

from ..settings.analysis import Analysis
from .clusters import group_particles, locate_clusters
from .motion import Motion
from .states import Bodies, attach_particles, divide_mass, join_clusters
from .strain import Maps, Partings, find_maps, find_neighbours


class Gauge:
    """The clusters of a motion, and which of them have come apart up to the frame that was followed last."""

    def __init__(self, motion: Motion, analysis: Analysis) -> None:
        self.motion, self.analysis = motion, analysis
        self.start = motion.position[0].astype(float)
        self.clusters = group_particles(self.start, motion.mass, motion.cell)
        self.neighbours = find_neighbours(self.clusters, analysis.strain_radius * motion.cell)
        self.partings = Partings(self.neighbours, analysis.part_stretch)

    @property
    def joined_part(self) -> float:
        """Which part of the pairs of neighbours still hold together."""
        return float(self.partings.is_joined.mean()) if len(self.partings.is_joined) else 1.0

    def follow(self, last: int) -> Iterator[tuple[int, np.ndarray]]:
        """Give each stored frame from the release to ``last``, and the places of the clusters (k, d) in it."""
        for frame, positions in zip(self.motion.frames.tolist(), self.motion.position, strict=True):
            if frame > last:
                return
            centre = locate_clusters(self.clusters, positions)
            self.partings.extend(centre)
            yield frame, centre

    def judge_clusters(self, centre: np.ndarray) -> tuple[Bodies, Maps]:
        """Find what became of each cluster, at ``centre`` (k, d) now, and the maps of their neighbourhoods."""
        maps = find_maps(self.neighbours, self.partings.is_joined, centre)
        reach = self.analysis.join_reach * self.motion.cell
        return join_clusters(self.neighbours, self.partings, maps, reach, self.analysis), maps

    def judge_particles(self, centre: np.ndarray, index: int) -> Bodies:
        """Find what became of each particle in the stored state at ``index``, where the clusters are at ``centre``."""
        bodies, maps = self.judge_clusters(centre)
        now, stray = self.motion.position[index].astype(float), self.analysis.stray * self.motion.cell
        return attach_particles(self.clusters, bodies, maps, centre, self.start, now, stray)

    def divide_clusters(self, centre: np.ndarray) -> np.ndarray:
        """Divide the mass of each cluster (k, d) into lump, crushed and loose, as parts of the body's mass, (k, 3)."""
        bodies, mass = self.judge_clusters(centre)[0], self.clusters.mass
        return mass[:, None] * divide_mass(bodies, mass, self.motion.least_lump(self.analysis)) / mass.sum()
