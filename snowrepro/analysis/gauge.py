"""The strain gauge on a body of snow: its clusters, followed frame by frame, and what became of its particles."""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np

from ..settings.analysis import Analysis
from .clusters import locate_rest
from .motion import Motion
from .states import Bodies, attach_particles, divide_mass, find_carriers, find_near, join_clusters
from .strain import Maps, Partings, find_maps, find_neighbours
from .track import follow_clusters, make_motion_clusters


class Gauge:
    """The clusters of a motion, and which of them have come apart up to the frame that was followed last.

    ``released``: the clusters as they were at release; ``clusters``: the same without what has vanished since.
    """

    def __init__(self, motion: Motion, analysis: Analysis) -> None:
        self.motion, self.analysis = motion, analysis
        self.start = motion.position[0].astype(float)
        self.clusters = make_motion_clusters(self.start, motion.mass, motion.cell, motion.track)
        self.released = self.clusters
        self.neighbours = find_neighbours(self.clusters, analysis.strain_radius * motion.cell)
        self.is_near = find_near(self.neighbours, len(self.clusters.mass), analysis.join_reach * motion.cell)
        self.partings = Partings(self.neighbours, analysis.part_stretch)

    @property
    def frames(self) -> np.ndarray:
        """The frames that can be followed: all since the release where the run did, else those that are stored."""
        return self.motion.frames if self.motion.track is None else self.motion.track.frames

    @cached_property
    def carriers(self) -> np.ndarray:
        """The clusters that may carry each particle (n, c): the same in each frame."""
        return find_carriers(self.released, self.start)

    @property
    def joined_part(self) -> float:
        """Which part of the pairs of neighbours still hold together."""
        return float(self.partings.is_joined.mean()) if len(self.partings.is_joined) else 1.0

    def follow(self, last: int) -> Iterator[tuple[int, np.ndarray]]:
        """Give each frame from the release to ``last``, and the places of the clusters (k, d) in it."""
        motion = self.motion
        for frame, centre in follow_clusters(self.clusters, motion.frames, motion.position, motion.track):
            if frame > last:
                return
            if motion.track is None:
                self._forget_vanished(motion.index(frame))
            self.partings.extend(centre)
            yield frame, centre

    def _forget_vanished(self, index: int) -> None:
        """See clusters at release where those of their particles were that are there still, so that no other moves it.

        ``index``: of the state.  Nothing changes where nothing has vanished since the state before.
        """
        is_gone = self.motion.vanished[index]
        if index and not np.array_equal(is_gone, self.motion.vanished[index - 1]):
            self.clusters = replace(self.clusters, position=locate_rest(self.clusters, self.start, ~is_gone))
            self.neighbours = self.partings.neighbours = self.neighbours.see_from(self.clusters.position)

    def judge_clusters(self, centre: np.ndarray) -> tuple[Bodies, Maps]:
        """Find what became of each cluster, at ``centre`` (k, d) now, and the maps of their neighbourhoods."""
        maps = find_maps(self.neighbours, self.partings.is_joined, centre)
        return join_clusters(self.neighbours, self.is_near, self.partings, maps, self.analysis), maps

    def judge_particles(self, centre: np.ndarray, index: int) -> Bodies:
        """Find what became of each particle in the stored state at ``index``, where the clusters are at ``centre``."""
        bodies, maps = self.judge_clusters(centre)
        now, stray = self.motion.position[index].astype(float), self.analysis.stray * self.motion.cell
        return attach_particles(self.clusters, self.carriers, bodies, maps, centre, self.start, now, stray)

    def measure_strain(self, centre: np.ndarray) -> float:
        """Measure the mean strain over the mass that is there, of neighbourhoods as they were at release.

        ``centre`` (k, d): of the clusters now.  What has parted since counts too: a crack strains all that it runs
        through, on a length that no grid decides.  NaN where no neighbourhood is known.
        """
        is_there = np.isfinite(centre).all(axis=1)
        maps = find_maps(self.neighbours, is_there[self.neighbours.pairs].all(axis=1), centre)
        mass = self.clusters.mass * (maps.is_known & is_there)
        return float((mass * maps.strain).sum() / mass.sum()) if mass.any() else math.nan

    def divide_clusters(self, centre: np.ndarray) -> np.ndarray:
        """Divide the mass of each cluster (k, d) into lump, crushed and loose, as parts of the body's mass, (k, 3)."""
        bodies, mass = self.judge_clusters(centre)[0], self.clusters.mass
        return mass[:, None] * divide_mass(bodies, mass, self.motion.least_lump(self.analysis)) / mass.sum()
