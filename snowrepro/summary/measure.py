"""The row of numbers of one run and the strains of its bonds, computed from its Dataset alone.

``summary.row`` stores both beside a result, under a digest of this module and of all that it imports.
"""

import json
from typing import Any

import numpy as np
import xarray as xr

from ..analysis import hardness
from ..analysis.definitions import DEFINITIONS, find_fragments
from ..analysis.eye import look_at
from ..analysis.lumps import (
    Classification,
    classify_motion,
    make_bond_variables,
    make_broken_variables,
    make_course_variables,
)
from ..analysis.motion import read_motion
from ..mpm.ledger import unclosed_share
from ..settings.analysis import Analysis

NEEDED = {  # variables of a run's Dataset
    "position", "velocity", "mass", "snapshot", "snapshot_time", "frame", "substeps", "mean_density", "mean_young",
    "mean_hardening", "mean_factor", "poisson_capped", "density_capped", "hardening_capped", "hardening_floored",
    "volume_bounded", "ended_inside", "momentum_y", "total_mass", "top_speed", "body_height",
}  # fmt: skip


def classify_ends(dataset: xr.Dataset, analysis: Analysis) -> Classification:
    """Classify a run at its release and at its end."""
    ends = [int(dataset.attrs["release_frame"]), int(dataset["snapshot"][-1])]
    return classify_motion(read_motion(dataset), analysis, ends, follows_all=True)


def measure_run(dataset: xr.Dataset, classification: Classification) -> dict[str, Any]:
    """Return the row of a run, by column name, from its Dataset and its fragments at release and at the end."""
    config = json.loads(dataset.attrs["config"])
    first = classification.fragments[0]
    at_release = dataset.isel(frame=first.frame)
    falling = dataset.isel(frame=slice(first.frame, None))
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
        **(measure_test(dataset) if "indenter_force" in dataset else _measure_fall(dataset, classification)),
        "fragments_at_release": len(first.mass),
        "whole_at_release": bool(first.largest > 0.999),
        "density_at_release": float(at_release["mean_density"]),
        "young_at_release": float(at_release["mean_young"]),
        "hardening_at_release": float(at_release["mean_hardening"]),
        "factor_at_release": float(at_release["mean_factor"]),
        "poisson_capped": int(dataset["poisson_capped"].max()),
        "density_capped": int(dataset["density_capped"].max()),
        "hardening_capped": int(dataset["hardening_capped"].max()),
        "hardening_floored": int(dataset["hardening_floored"].max()),
        "volume_bounded": int(dataset["volume_bounded"].max()),
        "ended_inside": int(dataset["ended_inside"].sum()),
        "energy_unclosed": unclosed_share(falling),
        "substeps": int(dataset["substeps"].sum()),
        "seconds": float(dataset.attrs.get("wall_seconds", np.nan)),
        "seconds_per_frame": float(dataset.attrs.get("seconds_per_frame", np.nan)),
    }


def read_curve(dataset: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Read depth below first touch and force on the indenter of a hardness test, both (k,)."""
    return hardness.cut_curve(dataset["indenter_depth"].values, dataset["indenter_force"].values)


def measure_hardness(dataset: xr.Dataset, end: float) -> float:
    """Return the hardness in the last tenth of the way from first touch to the depth ``end`` [cells]."""
    config = json.loads(dataset.attrs["config"])
    return hardness.measure_hardness(*read_curve(dataset), end, config["indenter"]["radius"], config["reading"]["cell"])


def measure_test(dataset: xr.Dataset) -> dict[str, float | str]:
    """Return the columns of a run's hardness test, TEST_COLUMNS, by name."""
    test = json.loads(dataset.attrs["config"])["indenter"]
    return {
        "indenter": test["name"],
        "hardness": measure_hardness(dataset, test["depth"]),
        "hardness_depth": float(test["depth"]),
        "indentation_work": hardness.measure_work(*read_curve(dataset)),
    }


def _measure_fall(dataset: xr.Dataset, classification: Classification) -> dict[str, Any]:
    """Return the columns of a run's fall, FALL_COLUMNS, by name."""
    release = classification.motion.release
    falling = dataset.isel(frame=slice(release, None))
    speeds = (falling["momentum_y"] / falling["total_mass"]).values
    return {
        **classification.measures(),
        "strain_at_gauge": classification.strain,
        **_measure_other_definitions(classification),
        **_look_at_end(dataset, classification),
        "end_frame": int(dataset["frame"][-1]),
        "impact_speed": float(falling["top_speed"].max()),
        **hardness.measure_impact(falling["body_height"].values, speeds),
    }


def _measure_other_definitions(classification: Classification) -> dict[str, float]:
    """Return the lump fraction of the last frame by each definition of a lump, by column name."""
    state, analysis = classification.state, classification.analysis
    return {
        f"lumps_by_{name}": find_fragments(state, analysis.model_copy(update={"definition": name})).lump_fraction
        for name in DEFINITIONS
    }


def _look_at_end(dataset: xr.Dataset, classification: Classification) -> dict[str, float]:
    """Return what an eye sees of the last frame, by column name: see ``analysis.eye``."""
    motion = classification.motion
    per_cell = json.loads(dataset.attrs["config"])["fidelity"]["particles_per_cell"]
    least = motion.least_lump(classification.analysis) / motion.cell_mass if motion.cell_mass else 0.0
    seen = look_at(motion.position[-1], motion.grid_spacing / np.sqrt(per_cell), motion.cell, least)
    return {"bodies_seen": seen.bodies, "largest_seen": seen.largest, "raggedness": seen.raggedness}


def make_bond_dataset(classification: Classification) -> xr.Dataset:
    """Make a Dataset of the bonds of a run and their strains, from which any other threshold can be tried.

    Along ``bond``: pairs, lengths at release and extreme strains; along ``state``: in every stored frame the part of
    them that is broken, and the part of the mass that is lump, crushed and loose; along ``fragment``: masses at the
    end; along ``particle``: masses.
    """
    return xr.Dataset(
        {
            **make_bond_variables(classification.state.bonds, classification.state.history, classification.motion.unit),
            **make_broken_variables(classification.broken),
            **make_course_variables(classification.course),
            "fragment_mass": ("fragment", classification.last.mass, {"long_name": "mass of each fragment, falling"}),
            "mass": ("particle", classification.motion.mass, {"long_name": "mass of each particle"}),
        },
        {"state": classification.broken.index.to_numpy()},
        {
            "least_lump": classification.motion.least_lump(classification.analysis),
            "cell_mass": classification.motion.cell_mass,
        },
    )
