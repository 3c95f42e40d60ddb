"""Run one configuration and describe its result as a Dataset that explains itself."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr

from . import units
from .config import Config
from .mpm import diagnostics, solver
from .mpm.state import PARTICLE_STATE
from .scene.build import build_scene

MODEL_VERSION = 2  # goes up when the same config gives another result


@dataclass(frozen=True)
class Progress:
    """How far a run is: frames done and in all, substeps of the last frame."""

    frame: int
    frames: int
    substeps: int


def simulate(config: Config, on_frame: Callable[[Progress], None] | None = None) -> xr.Dataset:
    """Simulate one run.

    ``on_frame`` is called after each frame.  Returns a Dataset with dimensions ``frame`` (0 to the
    last, for the diagnostics), ``snapshot`` (the stored frames), ``particle`` and ``axis``.
    Raises ConfigError where the scene does not fit, Diverged where the run stops being one.
    """
    scene = build_scene(config)
    total = config.loading.frames
    rows: list[dict[str, float]] = []
    numbers: list[int] = []
    stored: dict[str, list[np.ndarray]] = {q.name: [] for q in PARTICLE_STATE if q.stored}
    constants: dict[str, np.ndarray] = {}
    for frame in solver.frames(config, scene):
        rows.append(diagnostics.measure(frame, config))
        if config.is_stored(frame.number):
            numbers.append(frame.number)
            for name, values in stored.items():
                values.append(frame.read(name).astype(np.float32))
        if frame.number == 0:
            constants = {name: frame.read(name) for name in ("mass", "volume")}
        if on_frame:
            on_frame(Progress(frame.number, total, frame.substeps))
    return _describe(config, rows, numbers, stored, constants)


def _describe(
    config: Config,
    rows: list[dict[str, float]],
    numbers: list[int],
    stored: dict[str, list[np.ndarray]],
    constants: dict[str, np.ndarray],
) -> xr.Dataset:
    """Put the arrays of a run into a Dataset with names and units."""

    def attrs(long_name: str, powers: str) -> dict[str, str]:
        return {"long_name": long_name, "units": units.text(powers, config.reading.length_unit)}

    table = {q.name: q for q in PARTICLE_STATE}
    frame_time = config.loading.frame_time
    coords = {
        "frame": ("frame", np.arange(len(rows), dtype=np.int32), attrs("frame number", "1")),
        "time": ("frame", np.arange(len(rows)) * frame_time, attrs("time since pressing began", "T")),
        "snapshot": ("snapshot", np.array(numbers, dtype=np.int32), attrs("frame number of a stored state", "1")),
        "snapshot_time": ("snapshot", np.array(numbers) * frame_time, attrs("time of a stored state", "T")),
        "axis": ("axis", np.array(["x", "y"]), {"long_name": "horizontal and upward axis", "units": "1"}),
    }
    variables = {}
    for name, values in stored.items():
        quantity = table[name]
        dims = ("snapshot", "particle", "axis")[: 2 + len(quantity.shape)]
        variables[name] = (dims, np.stack(values), attrs(quantity.long_name, quantity.unit))
    for name, values in constants.items():
        variables[name] = ("particle", values, attrs(table[name].long_name, table[name].unit))
    for name, (long_name, powers) in diagnostics.MEANING.items():
        values = np.array([row[name] for row in rows])
        variables[name] = ("frame", values, attrs(long_name, powers))
    dataset = xr.Dataset(variables, coords)
    dataset.attrs = {
        "title": f"{config.shape.name} snow on {config.floor.name} floor, pressure {config.pressure:g}, "
        f"sintering {config.sintering.name}",
        "model_version": MODEL_VERSION,
        "config": config.model_dump_json(),
        "release_frame": config.loading.press_frames,
        "grid_spacing": config.dx,
        "cell_mass": config.material.rho * config.reading.cell**2,
        "length_unit": config.reading.length_unit,
        "comment": "Lengths are in the unit 'length_unit'; grid_spacing is one cell of this run's grid; "
        "cell_mass the mass of unpressed snow in one cell of the paper's grid.",
    }
    return dataset
