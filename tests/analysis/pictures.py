"""Built pictures: bodies of snow whose fragments are known."""

import json

import numpy as np
import xarray as xr

from snowrepro.analysis.lumps import Classification
from snowrepro.composition.compose import compose
from snowrepro.scene.build import sample
from snowrepro.summary.classify import classify


def ball(fidelity: str = "paper", seed: int = 0) -> np.ndarray:
    """The ball's particles around the origin, (n, 2)."""
    config = compose([f"fidelity={fidelity}"])
    return sample(config.case.shape.outline, config.case.dx, 4, seed)[0]


def run_of(*states: np.ndarray, fidelity: str = "paper", mass: np.ndarray | None = None) -> xr.Dataset:
    """A run whose release is the first state and whose frames 100, 101, ... are the states."""
    config = compose([f"fidelity={fidelity}"])
    mass = np.ones(len(states[0])) if mass is None else mass
    return xr.Dataset(
        {"position": (("snapshot", "particle", "axis"), np.stack(states)), "mass": ("particle", mass)},
        {"snapshot": np.arange(100, 100 + len(states))},
        {
            "config": json.dumps(config.settings()),
            "release_frame": 100,
            "grid_spacing": config.case.dx,
            "cell": config.case.reading.cell,
            "cell_mass": 0.0,
        },
    )


def classified(*states: np.ndarray, fidelity: str = "paper", frames=None, mass=None, **settings) -> Classification:
    """The states' fragments by bonds, with no least size of a lump in cells."""
    settings = {"definition": "bonds", "lump_cells": 0.0, **settings}
    return classify(run_of(*states, fidelity=fidelity, mass=mass), frames=frames, **settings)
