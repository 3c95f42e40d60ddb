"""One row of numbers for one run."""

import json

import numpy as np
import pandas as pd
import xarray as xr

from ..config import Analysis
from .fragments import analysis_of, classify_frames


def summarise(dataset: xr.Dataset, analysis: Analysis | None = None) -> dict[str, float | int | str | bool]:
    """The summary row of a run: what it was, what broke, what had to be bounded, what it cost."""
    config = json.loads(dataset.attrs["config"])
    analysis = analysis or analysis_of(dataset)
    release, end = int(dataset.attrs["release_frame"]), int(dataset["snapshot"][-1])
    before_end = _stored_frame(dataset, end - analysis.settled_frames)
    first, earlier, last = classify_frames(dataset, [release, before_end, end], analysis)
    at_release = dataset.isel(frame=release)
    falling = dataset.isel(frame=slice(release, None))
    return {
        "run_id": str(dataset.attrs.get("run_id", "")),
        "shape": config["shape"]["name"],
        "floor": config["floor"]["name"],
        "sintering": config["sintering"]["name"],
        "pressure": config["pressure"],
        "reading": config["reading"]["name"],
        "fidelity": config["fidelity"]["name"],
        "seed": config["seed"],
        "particles": dataset.sizes["particle"],
        "lump_fraction": last.lump_fraction,
        "powder_fraction": 1.0 - last.lump_fraction,
        "lumps": last.lumps,
        "largest_fragment": last.largest,
        "joined_chance": last.joined,
        "broken_bonds": last.broken,
        "settled": bool(last.broken - earlier.broken < analysis.settled_change),
        "whole_at_release": bool(first.largest > 0.999),
        "impact_speed": float(falling["top_speed"].max()),
        "density_at_release": float(at_release["mean_density"]),
        "young_at_release": float(at_release["mean_young"]),
        "hardening_at_release": float(at_release["mean_hardening"]),
        "factor_at_release": float(at_release["mean_factor"]),
        "poisson_capped": int(dataset["poisson_capped"].max()),
        "density_capped": int(dataset["density_capped"].max()),
        "hardening_capped": int(dataset["hardening_capped"].max()),
        "hardening_floored": int(dataset["hardening_floored"].max()),
        "volume_bounded": int(dataset["volume_bounded"].max()),
        "substeps": int(dataset["substeps"].sum()),
        "seconds": float(dataset.attrs.get("wall_seconds", np.nan)),
    }


def tidy(datasets: list[xr.Dataset], analysis: Analysis | None = None) -> pd.DataFrame:
    """One row a run, sintered runs first, then by pressure and seed."""
    table = pd.DataFrame([summarise(dataset, analysis) for dataset in datasets])
    if table.empty:
        return table
    arm = table["sintering"].map(lambda name: {"paper": 0, "none": 2}.get(name, 1))
    ordered = table.assign(arm=arm).sort_values(["arm", "sintering", "pressure", "seed"])
    return ordered.drop(columns="arm").reset_index(drop=True)


def _stored_frame(dataset: xr.Dataset, frame: int) -> int:
    """The last stored frame at or before ``frame``, but not before release."""
    snapshots = dataset["snapshot"].values
    release = int(dataset.attrs["release_frame"])
    return int(max(release, snapshots[snapshots <= max(frame, release)].max()))
