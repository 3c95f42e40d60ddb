"""Runs for the viewer: the small run, and others made of it by shaking part of its particles apart."""

from pathlib import Path

import numpy as np
import xarray as xr

from snowrepro.composition.compose import compose
from snowrepro.store.run import Run
from tests.configs import carrying
from tests.conftest import SMALL

SHAKEN_FROM = 48  # frame
# sintering, pressure: part of the particles that is shaken apart
SHAKEN = {("paper", 500): 0.6, ("paper", 3000): 0.0, ("none", 500): 0.7, ("none", 3000): 0.8}


def shaken(run: xr.Dataset, part: float, seed: int) -> xr.Dataset:
    """``run`` whose leftmost ``part`` of the particles moves at random in the last frames, by up to several cells."""
    position = run["position"].copy(deep=True)
    x = position.sel(snapshot=SHAKEN_FROM).values[:, 0]
    left = np.flatnonzero(x <= np.quantile(x, part)) if part else []
    rng = np.random.default_rng(seed)
    reach = rng.lognormal(-1.0, 1.5, (len(left), 1))  # some hardly, some far
    for index in np.flatnonzero(run["snapshot"].values >= SHAKEN_FROM):
        position.values[index, left] += (reach * rng.normal(size=(len(left), 2))).clip(-5, 5).astype(np.float32)
    return run.assign(position=position, cluster_position=_move_clusters(run, position.values - run["position"].values))


def _move_clusters(run: xr.Dataset, moved: np.ndarray) -> xr.DataArray:
    """Where the clusters of ``run`` are whose particles ``moved`` (snapshot, particle, axis): as in the last stored."""
    member, track = run["cluster"].values, run["cluster_position"].copy(deep=True)
    latest = np.searchsorted(run["snapshot"].values, run["tracked"].values, side="right") - 1
    count = np.bincount(member)[:, None]
    mean = [np.stack([np.bincount(member, along) for along in state.T], axis=1) / count for state in moved]
    track.values += np.stack(mean)[latest].astype(np.float32)
    return track


def vanishing(run: xr.Dataset) -> xr.Dataset:
    """``run`` whose particles have unequal masses, and some of which vanish at the end."""
    position, mass = run["position"].copy(deep=True), run["mass"].copy(deep=True)
    position.values[-3:, ::17] = np.nan
    mass.values[:] *= np.linspace(0.5, 1.5, len(mass))
    return run.assign(position=position, mass=mass)


def saved(run: xr.Dataset, folder: Path, vanish: bool = True) -> list[Run]:
    """Four finished runs in a store, in the paper's order; the last has unequal masses and loses particles if asked."""
    runs = []
    for seed, ((sintering, pressure), part) in enumerate(SHAKEN.items()):
        options = ["experiment=fig5", "experiment.frames=[0,20,60]", f"store={folder}", f"reports={folder}/reports"]
        stored = Run(compose([*SMALL, *options, f"sintering={sintering}", f"pressure={pressure}"]))
        made = carrying(shaken(run, part, seed), stored.config)
        stored.save(
            vanishing(made) if vanish and seed == len(SHAKEN) - 1 else made, wall_seconds=2.0, seconds_per_frame=0.1
        )
        runs.append(stored)
    return runs
