"""One row of numbers for one run."""

import hashlib
import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from ..config import Analysis, Config
from ..errors import StoreError
from ..mpm.diagnostics import unclosed_share
from ..store import runs
from . import hardness
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
    row = {
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
        "ended_inside": int(dataset["ended_inside"].sum()),
        "energy_unclosed": unclosed_share(falling),
        "substeps": int(dataset["substeps"].sum()),
        "seconds": float(dataset.attrs.get("wall_seconds", np.nan)),
        "seconds_per_frame": float(dataset.attrs.get("seconds_per_frame", np.nan)),
    }
    if hardness.is_indented(dataset):
        row = {name: value for name, value in row.items() if name not in hardness.OF_A_FALL}
    return row | hardness.outcome(dataset)


def row_of(config: Config) -> dict[str, float | int | str | bool]:
    """The summary row of a finished run, kept beside its result as long as the analysis stays the same."""
    key = _key(config.analysis)
    row = runs.summary(config, key)
    if row is None:
        with runs.open_run(runs.result_path(config)) as dataset:
            row = summarise(dataset, config.analysis)
        with suppress(StoreError):  # a store that cannot be written to can still be read
            runs.save_summary(config, key, row)
    return row


def of_runs(configs: Sequence[Config]) -> pd.DataFrame:
    """One row a finished run: scene by scene as they come, sintered runs first, then by pressure and seed."""
    scenes = list(dict.fromkeys((c.shape.name, c.floor.name) for c in configs))

    def place(c: Config) -> tuple:
        scene = scenes.index((c.shape.name, c.floor.name))
        return scene, not c.sintering.enabled, c.sintering.name, c.pressure, c.seed, c.indenter is not None

    return pd.DataFrame([row_of(config) for config in sorted(configs, key=place)])


def _key(analysis: Analysis) -> str:
    """What a row depends on beside the run: the settings, and the code that makes it."""
    digest = hashlib.sha256(analysis.model_dump_json().encode())
    for name in ("bonds.py", "fragments.py", "hardness.py", "summary.py"):
        digest.update((Path(__file__).parent / name).read_bytes())
    return digest.hexdigest()[:16]


def _stored_frame(dataset: xr.Dataset, frame: int) -> int:
    """The last stored frame at or before ``frame``, but not before release."""
    snapshots = dataset["snapshot"].values
    release = int(dataset.attrs["release_frame"])
    return int(max(release, snapshots[snapshots <= max(frame, release)].max()))
