"""What is found in one run, kept beside it: one row of numbers, and what its bonds saw."""

import functools
import hashlib
import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from ..config import Analysis, Config
from ..errors import StoreError
from ..mpm.diagnostics import unclosed_share
from ..store import cf, runs
from . import hardness
from .classify import Classified, bond_variables, broken_variables, classify
from .definitions import DEFINITIONS
from .fragments import fragments_of

FOUND_BY = ("bonds", "classify", "definitions", "fragments", "hardness", "motion", "summary", "tree")  # modules


def summarise(dataset: xr.Dataset, analysis: Analysis | None = None) -> dict[str, Any]:
    """The summary row of a run: what it was, what broke, what had to be bounded, what it cost."""
    dataset = cf.run_as_read(dataset)
    return _row(dataset, _classified(dataset, analysis))


def _classified(dataset: xr.Dataset, analysis: Analysis | None) -> Classified:
    """A run's fragments at release and at the end."""
    ends = [int(dataset.attrs["release_frame"]), int(dataset["snapshot"][-1])]
    return classify(dataset, analysis, frames=ends)


def _row(dataset: xr.Dataset, found: Classified) -> dict[str, Any]:
    config = json.loads(dataset.attrs["config"])
    first = found.fragments[0]
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
        **(hardness.indentation(dataset) if hardness.is_indented(dataset) else _fall(dataset, found)),
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


def _fall(dataset: xr.Dataset, found: Classified) -> dict[str, Any]:
    """What the fall did to the snow."""
    falling = dataset.isel(frame=slice(found.motion.release, None))
    return {
        **found.measures(),
        **_by_other_definitions(found),
        "impact_speed": float(falling["top_speed"].max()),
        **hardness.impact(dataset),
    }


def _by_other_definitions(found: Classified) -> dict[str, float]:
    """The lump fraction of the last frame if something else held particles together."""
    motion, analysis = found.motion, found.analysis
    index, least = motion.index(found.last.frame), motion.least_lump(analysis)
    fractions = {}
    for name, rule in DEFINITIONS.items():
        component = rule(motion, index, found.bonds, found.history, analysis)
        fractions[f"lumps_by_{name}"] = fragments_of(found.last.frame, component, motion, least).lump_fraction
    return fractions


def row_of(config: Config) -> dict[str, Any]:
    """The summary row of a finished run, kept beside its result as long as the analysis stays the same."""
    row = runs.summary(config, _key(config.analysis))
    return _find(config)[0] if row is None else row


def bonds_of(config: Config) -> xr.Dataset:
    """What the bonds of a finished run saw, kept likewise, so that any threshold is decided without simulating again.

    Bonds with their length at release and their extreme strains (``bond``), the part that is broken at every
    stored frame (``state``), the fragments' masses at the end (``fragment``) and the particles' (``particle``).
    """
    kept = runs.analysis(config, _key(config.analysis))
    return _find(config)[1] if kept is None else kept


def _find(config: Config) -> tuple[dict[str, Any], xr.Dataset]:
    """Analyse a finished run and keep what was found."""
    key = _key(config.analysis)
    with runs.open_run(runs.result_path(config)) as dataset:
        found = _classified(dataset, config.analysis)
        row = _row(dataset, found)
    seen = _seen(found)
    with suppress(StoreError):  # a store that cannot be written to can still be read
        runs.save_analysis(config, key, seen)
        runs.save_summary(config, key, row)
    return row, seen


def _seen(found: Classified) -> xr.Dataset:
    """See ``bonds_of``."""
    return xr.Dataset(
        {
            **bond_variables(found.bonds, found.history, found.motion.unit),
            **broken_variables(found.broken),
            "fragment_mass": ("fragment", found.last.mass, {"long_name": "mass of each fragment, falling"}),
            "mass": ("particle", found.motion.mass, {"long_name": "mass of each particle"}),
        },
        {"state": found.broken.index.to_numpy()},
        {"least_lump": found.motion.least_lump(found.analysis), "cell_mass": found.motion.cell_mass},
    )


def of_runs(configs: Sequence[Config]) -> pd.DataFrame:
    """One row a finished run: scene by scene as they come, sintered runs first, then by pressure and seed."""
    scenes = list(dict.fromkeys((c.shape.name, c.floor.name) for c in configs))

    def place(c: Config) -> tuple:
        scene = scenes.index((c.shape.name, c.floor.name))
        return scene, not c.sintering.enabled, c.sintering.name, c.pressure, c.seed, c.indenter is not None

    return pd.DataFrame([row_of(config) for config in sorted(configs, key=place)])


@functools.cache
def _key(analysis: Analysis) -> str:
    """What a row depends on beside the run: the settings, and the code that makes it."""
    digest = hashlib.sha256(analysis.model_dump_json().encode())
    for name in FOUND_BY:
        digest.update((Path(__file__).parent / f"{name}.py").read_bytes())
    return digest.hexdigest()[:16]
