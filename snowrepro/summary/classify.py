"""Classify a run, or anyone's particles over time, into lumps, crushed and loose snow."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr
from pydantic import ValidationError

from ..analysis.layout import Names
from ..analysis.lumps import Classification, classify_motion
from ..analysis.motion import read_motion
from ..composition.compose import compose
from ..composition.messages import explain
from ..errors import ConfigError, DataError
from ..foreign import parse_json
from ..settings.analysis import Analysis
from ..store import cf
from ..store.files import published
from ..store.netcdf import write_netcdf
from ..text import make_printable, quote
from .measure import NEEDED

LONGEST_CONFIG = 1_000_000  # letters
SECTIONS = frozenset(("shape", "floor", "material", "sintering", "loading", "reading", "fidelity"))  # of a case


def classify(
    data: xr.Dataset | np.ndarray,
    analysis: Analysis | None = None,
    *,
    frames: Sequence[int] | int | Literal["all"] | None = None,
    mass: np.ndarray | float | str | None = None,
    release: int | None = None,
    grid_spacing: float | None = None,
    cell_mass: float | None = None,
    cell: float | None = None,
    **settings: Any,
) -> Classification:
    """Classify particles over time, ours or anyone's, into lumps, crushed snow and loose snow.

    ``data``: a Dataset (a run; or see ``read_motion`` for what it must hold) or positions (time, particle, axis).
    ``frames``: those (or the one) whose fragments are wanted, "all" stored ones since release, or by default the last.
    ``mass`` (n,), ``release`` (a frame), ``grid_spacing``, ``cell`` (over which strain is measured) and ``cell_mass``
    (of it, full of unpressed snow) win over what the data says.
    ``analysis`` and ``settings`` by name (``definition="proximity"``, ``break_strain=0.2``) define what a lump is; by
    default the run's own configuration does, or conf/analysis/strain.yaml.
    Variables and dimensions of a Dataset that have other names than the usual ones are named likewise, as in
    ``layout.Names``: ``position="coordinates"`` or ``"x,y"``, ``velocity``, ``particle_id``, ``time``,
    ``time_dimension``, ``particle_dimension``; ``mass`` may be a name too.  "none": the data has none.
    Raises DataError for data that cannot be classified and ConfigError for wrong settings.
    """
    if isinstance(data, xr.Dataset):
        data = cf.run_as_read(data)
    names = Names(
        mass=mass if isinstance(mass, str) else None,
        **{name: settings.pop(name) for name in Names.list_fields() if name in settings},
    )
    motion = read_motion(
        data,
        names=names,
        mass=None if isinstance(mass, str) else mass,
        release=release,
        grid_spacing=grid_spacing,
        cell_mass=cell_mass,
        cell=cell,
    )
    if analysis is None:
        analysis = read_analysis(data) if isinstance(data, xr.Dataset) else compose_analysis()
    elif not isinstance(analysis, Analysis):
        raise ConfigError(f"analysis should be an Analysis, not {analysis!r}; a definition is named so: definition=...")
    analysis = change_settings(analysis, settings)
    if frames is None:
        frames = [int(motion.frames[-1])]
    if isinstance(frames, int):
        frames = [frames]
    if isinstance(frames, str) and frames != "all":
        raise DataError(f'frames is {quote(frames)}: give a list of frames, or "all"')
    return classify_motion(motion, analysis, motion.frames.tolist() if isinstance(frames, str) else list(frames))


def read_analysis(dataset: xr.Dataset) -> Analysis:
    """Read from a run of ours the settings that it is to be classified by; for other data return the usual ones."""
    config = read_run_config(dataset) or {}
    if "analysis" not in config:
        return compose_analysis()
    try:
        return Analysis.model_validate(config["analysis"])
    except ValidationError as error:
        wrong = make_printable(error.errors()[0]["msg"])
        raise DataError(f"its attribute config does not say how the run is to be analysed: {wrong}") from error


def read_length_unit(dataset: xr.Dataset) -> str:
    """Read the unit of length of a run of ours, as files have it; "length" where it is not said."""
    reading = (read_run_config(dataset) or {}).get("reading")
    unit = reading.get("length_unit") if isinstance(reading, dict) else None
    return unit if unit in ("cell", "m") else "length"


def read_run_config(dataset: xr.Dataset) -> dict[str, Any] | None:
    """Read the configuration of a run of ours; None where a Dataset is of another code, whatever its 'config' is."""
    text = dataset.attrs.get("config")
    if not isinstance(text, str) or len(text) > LONGEST_CONFIG:
        return None
    try:
        config = parse_json(text)
    except (ValueError, RecursionError):
        return None
    return config if isinstance(config, dict) and SECTIONS <= config.keys() else None


def is_whole_run(dataset: xr.Dataset) -> bool:
    """Whether a Dataset is a run of ours with all that its row of numbers is computed from."""
    return read_run_config(dataset) is not None and NEEDED <= {*dataset.variables} and "release_frame" in dataset.attrs


def compose_analysis() -> Analysis:
    """Compose the settings that runs have by default."""
    return compose().question.analysis


def write_classification(classification: Classification, folder: Path) -> None:
    """Write measures.json, fragments.csv (a row a fragment) and fragments.nc (ids by particle, and the bonds).

    Raises StoreError where it cannot be written.
    """
    content = {
        **classification.measures(),
        "units": {"length": classification.motion.unit or "unknown", "time": classification.motion.time_unit},
        "assumed": classification.assumed,
        "analysis": classification.analysis.model_dump(),
    }
    with published(folder / "measures.json") as partial:
        partial.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    with published(folder / "fragments.csv") as partial:
        classification.table().to_csv(partial, index=False, float_format="%.6g", lineterminator="\n")
    with published(folder / "fragments.nc") as partial:
        write_netcdf(cf.as_file(classification.to_dataset(), "classified by snowrepro"), partial)


def change_settings(analysis: Analysis, settings: dict[str, Any]) -> Analysis:
    """Return the analysis with some settings changed.  Raises ConfigError that names a wrong one and the right ones."""
    names = list(Analysis.model_fields)
    for name in settings:
        if name not in names:
            hint = "; a definition is named by definition=..." if name == "analysis" else ""
            raise ConfigError(f"there is no setting '{name}' of the analysis{hint}; there are: {', '.join(names)}")
    try:
        return Analysis.model_validate({**analysis.model_dump(), **settings})
    except ValidationError as error:
        raise ConfigError("; ".join(explain(item) for item in error.errors())) from error
