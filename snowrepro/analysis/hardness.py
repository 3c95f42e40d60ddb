"""How hard snow is: what an indenter needs, how flat the fall makes the snow, and how it rebounds."""

import json

import numpy as np
import xarray as xr

LAST = 0.1  # part of the depth, up to the whole of it, over which the hardness is taken: the force vibrates
BODY = (0.05, 0.95)  # quantiles of mass between which the body's height is measured: grains that fly do not count


def is_indented(dataset: xr.Dataset) -> bool:
    """Whether the run is a hardness test, and no fall."""
    return "indenter_force" in dataset


def curve(dataset: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Depth below first touch, at mid-frame, and upward force on the indenter, of each frame of the test."""
    depth = dataset["indenter_depth"].values
    tested = np.flatnonzero(np.isfinite(depth))
    half_a_frame = 0.5 * (depth[tested[-1]] - depth[tested[0]]) / (len(tested) - 1)
    return depth[tested] - half_a_frame, dataset["indenter_force"].values[tested]


def chord(depth: np.ndarray | float, radius: float) -> np.ndarray | float:
    """Width of a disc at ``depth`` above its lowest point, zero where that is negative."""
    inside = np.clip(depth, 0.0, radius)
    return 2.0 * np.sqrt(inside * (2.0 * radius - inside))


def indentation(dataset: xr.Dataset) -> dict[str, float | str]:
    """Hardness: mean force over mean contact chord in the last tenth of the depth; and the work of the whole test."""
    test = json.loads(dataset.attrs["config"])["indenter"]
    depth, force = curve(dataset)
    return {
        "indenter": test["name"],
        "hardness": mean_pressure(dataset, test["depth"]),
        "hardness_depth": float(test["depth"]),
        "indentation_work": float(((force[1:] + force[:-1]) / 2.0 * np.diff(depth)).sum()),
    }


def mean_pressure(dataset: xr.Dataset, cells: float) -> float:
    """Mean force over mean contact chord, in the last tenth of the way from first touch to a depth in cells."""
    config = json.loads(dataset.attrs["config"])
    cell = config["reading"]["cell"]
    depth, force = curve(dataset)
    last = (depth >= (1.0 - LAST) * cells * cell) & (depth <= cells * cell)
    return float(force[last].mean() / chord(depth[last], config["indenter"]["radius"] * cell).mean())


def impact(dataset: xr.Dataset) -> dict[str, float]:
    """Flattening: height lost from release, at most and at the end.  Rebound: speed upward over speed of impact."""
    release = int(dataset.attrs["release_frame"])
    heights = body_heights(dataset, release)
    speed = (dataset["momentum_y"] / dataset["total_mass"]).values[release:]
    lowest = int(np.argmin(speed))
    down, up = -float(speed[lowest]), float(speed[lowest:].max())
    return {
        "flattening_most": 1.0 - float(heights.min() / heights[0]),
        "flattening_end": 1.0 - float(heights[-1] / heights[0]),
        "rebound": max(0.0, up) / down if down > 0.0 else float("nan"),
    }


def body_heights(dataset: xr.Dataset, first: int) -> np.ndarray:
    """Height of the middle nine tenths of the mass in each stored frame from ``first`` on."""
    places = dataset["position"].sel(snapshot=slice(first, None), axis="y").values.astype(float)
    mass = dataset["mass"].values
    return np.array([np.subtract(*(quantile(heights, mass, q) for q in BODY[::-1])) for heights in places])


def quantile(values: np.ndarray, mass: np.ndarray, part: float) -> float:
    """The value below which ``part`` of the mass lies, linear between the middles of neighbours."""
    order = np.argsort(values, kind="stable")
    below = np.cumsum(mass[order])
    return float(np.interp(part * below[-1], below - 0.5 * mass[order], values[order]))
