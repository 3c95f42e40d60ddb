"""One point of a case's material led along a path of strain, as a Dataset: what a law does, without a run."""

import csv
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path as Place

import numpy as np
import pandas as pd
import xarray as xr
from scipy.linalg import expm

from . import units
from .analysis import clusters
from .errors import ConfigError
from .laws.quantity import Quantity
from .mpm import ledger
from .mpm.constants import make_constants
from .mpm.point import Points
from .mpm.solver import start_taichi
from .mpm.state import ATTRIBUTES, SHAPES
from .settings.case import Case

UPRIGHT = np.array([[0.0, 0.0], [0.0, 1.0]])
CYCLES = 3
# Of each path the direction of the strain, and how far along it one is after a part 0 to 1 of the path.
PATHS: dict[str, tuple[np.ndarray, Callable[[np.ndarray], np.ndarray]]] = {
    "compression": (-UPRIGHT, lambda part: part),
    "isotropic": (-np.eye(2), lambda part: part),
    "extension": (UPRIGHT, lambda part: part),
    "shear": (np.array([[0.0, 1.0], [0.0, 0.0]]), lambda part: part),
    "cycles": (-UPRIGHT, lambda part: np.abs((2 * CYCLES * part + 1) % 2 - 1)),
}
STRESS = "M/L/T2"
COLUMNS = ("xx", "yy", "xy")  # of a table of strains
MOST_STRAIN, MOST_STEPS = 5.0, 100_000


@dataclass(frozen=True)
class Path:
    """A path of strain.

    ``strains``: along it at its start and after each step, shape (n + 1,); ``steps``: the logarithmic strain of each
    step, in shear the gradient of the displacement, (n, 2, 2).
    """

    name: str
    strains: np.ndarray
    steps: np.ndarray


def make_path(name: str = "compression", strain: float = 0.2, steps: int = 400) -> Path:
    """Make one of PATHS with its greatest ``strain``, logarithmic, in shear the tangent of the angle.

    Raises ConfigError for a path that there is not, and out of bounds.
    """
    if name not in PATHS:
        raise ConfigError(f"there is no path '{name}'; there are: {', '.join(PATHS)}, and tables of strains (.csv)")
    if not (0 < strain <= MOST_STRAIN and 1 <= steps <= MOST_STEPS):
        raise ConfigError(f"a path has a strain above 0 and up to {MOST_STRAIN:g}, and 1 to {MOST_STEPS:,} steps")
    direction, place = PATHS[name]
    strains = strain * place(np.linspace(0.0, 1.0, steps + 1))
    return Path(name, strains, np.diff(strains)[:, None, None] * direction)


def read_path(file: Place, steps: int = 400) -> Path:
    """Read a path from a table of strains: a row for each of its corners, with columns ``xx``, ``yy`` and ``xy``.

    They are logarithmic, and those of the first row are where the point is at rest.  ``steps``: in all, at least one to
    each row.  Along the path its own length is measured, by the norm of the strain's tensor.
    Raises ConfigError where the file is no such table.
    """
    corners = _read_corners(file)
    legs = np.diff(corners, axis=0)
    lengths = np.linalg.norm(legs, axis=(1, 2))
    if not 1 <= steps <= MOST_STEPS:
        raise ConfigError(f"a path has 1 to {MOST_STEPS:,} steps")
    if not (lengths.any() and lengths.max() <= MOST_STRAIN):
        raise ConfigError(f"{file}: its strains differ from row to row by 0, or by more than {MOST_STRAIN:g}")
    counts = np.maximum(np.ceil(steps * lengths / lengths.sum()).astype(int), 1)
    parts = np.repeat(legs / counts[:, None, None], counts, axis=0)
    return Path(Place(file).stem, np.insert(np.cumsum(np.linalg.norm(parts, axis=(1, 2))), 0, 0.0), parts)


def _read_corners(file: Place) -> np.ndarray:
    """Read the strains (rows, 2, 2) of a table.  Raises ConfigError."""
    header, rows = _read_words(file)
    if misnamed := [f"{name} {header.count(name)} times" for name in COLUMNS if header.count(name) != 1]:
        raise ConfigError(f"{file}: a table of strains has columns {', '.join(COLUMNS)}; it has {', '.join(misnamed)}")
    for number, row in enumerate(rows, start=1):
        if len(row) != len(header):
            raise ConfigError(f"{file}: row {number} has {len(row)} values, for {len(header)} columns")
    table = pd.DataFrame(rows, columns=range(len(header)), dtype=str)
    places = [header.index(name) for name in COLUMNS]
    numbers = table[places].apply(pd.to_numeric, errors="coerce").to_numpy(float)
    wrong = np.flatnonzero(~np.isfinite(numbers).all(axis=1))
    if len(wrong) or not 2 <= len(numbers) <= MOST_STEPS:
        where = f"row {wrong[0] + 1} has something else" if len(wrong) else f"it has {len(numbers)} rows"
        raise ConfigError(f"{file}: a table of strains has 2 to {MOST_STEPS:,} rows of numbers; {where}")
    return numbers[:, [[0, 2], [2, 1]]]


def _read_words(file: Place) -> tuple[list[str], list[list[str]]]:
    """Read the header of a table and its rows, without those that are empty.  Raises ConfigError."""
    try:
        with Place(file).open(encoding="utf-8-sig", newline="") as lines:
            rows = [[word.strip() for word in row] for row in csv.reader(lines) if row]
    except (OSError, ValueError, csv.Error) as error:  # ValueError: no text
        raise ConfigError(f"{file} cannot be read as a table of strains: {error}") from error
    if not rows:
        raise ConfigError(f"{file} cannot be read as a table of strains: it is empty")
    return rows[0], rows[1:]


def follow_path(case: Case, path: Path) -> xr.Dataset:
    """Lead a point of unpressed snow along a path.

    Returns stress (Kirchhoff), what the material remembers, and where the work went, at the start and after each step.
    Raises ConfigError where a law that is somebody else's fails.
    """
    start_taichi(case.solver, threads=1)
    points = make_points(case, 1)
    points.deform(np.eye(2))
    rows, work = [_read_row(points)], [0.0]
    for step in path.steps:
        points.deform(expm(step))
        rows.append(_read_row(points))
        mean = 0.5 * (rows[-2]["tau"] + rows[-1]["tau"])
        work.append(work[-1] + float((mean * step).sum()))
    return _describe(case, path, rows, work, points.constants.material.STATE)


def make_points(case: Case, count: int) -> Points:
    """Points of the case's material; Taichi has been started.  Raises ConfigError for a wrong STATE of its law."""
    _require_state(case.material.law.name, make_constants(case).material.STATE)
    return Points(case, count)


def _require_state(law: str, state: Sequence[Quantity]) -> None:
    """Check the quantities that a material law keeps of each particle, before anything is built of them."""
    if not isinstance(state, tuple | list):
        raise ConfigError(f"material law '{law}': STATE is a tuple of quantities, not {type(state).__name__}")
    wrong = [repr(each) for each in state if not isinstance(each, Quantity)]
    names = [each.name for each in state if isinstance(each, Quantity)]
    flaws = {
        "what is no Quantity": wrong,
        "names that are no words of letters, digits and _": [name for name in names if not WORD.fullmatch(name)],
        "names twice": sorted({name for name in names if names.count(name) > 1}),
        "names that are taken": [name for name in names if name in TAKEN],
        "quantities that are no scalars": [each.name for each in state if each.shape != ()] if not wrong else [],
    }
    said = [f"{flaw}: {', '.join(found)}" for flaw, found in flaws.items() if found]
    if said:
        raise ConfigError(f"material law '{law}': STATE has {'; '.join(said)}")


def _read_row(points: Points) -> dict[str, np.ndarray]:
    """What is kept of the point after a step."""
    own = [quantity.name for quantity in points.constants.material.STATE]
    names = ("tau", "von_mises", "J_P", "factor", "plastic_work", "hardening_work", "wave_speed2", *own)
    return {**{name: points.read(name)[0] for name in names}, "elastic_energy": points.energies[0]}


def _add_up(steps: np.ndarray) -> np.ndarray:
    """The strain at the start of a path and after each of its steps: xx, yy and xy, shape (3, n + 1)."""
    strains = np.insert(np.cumsum(steps, axis=0), 0, 0.0, axis=0)
    return np.stack([strains[:, 0, 0], strains[:, 1, 1], 0.5 * (strains[:, 0, 1] + strains[:, 1, 0])])


def _describe(
    case: Case, path: Path, rows: list[dict[str, np.ndarray]], work: list[float], state: Sequence[Quantity]
) -> xr.Dataset:
    """Put a path into a Dataset with names and units; ``state``: what the law keeps."""
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    tau = columns.pop("tau")
    columns |= {
        **dict(zip(STRAINS, _add_up(path.steps), strict=True)),
        "tau_xx": tau[:, 0, 0], "tau_yy": tau[:, 1, 1], "tau_xy": tau[:, 0, 1],
        "pressure": -0.5 * (tau[:, 0, 0] + tau[:, 1, 1]),
        "shear": np.hypot(0.5 * (tau[:, 0, 0] - tau[:, 1, 1]), tau[:, 0, 1]),
        "work": np.array(work),
    }  # fmt: skip
    variables = {name: ("step", values) for name, values in columns.items()}
    dataset = xr.Dataset(variables, {"strain": ("step", path.strains)})
    own = {quantity.name: (quantity.long_name, quantity.unit) for quantity in state}
    for name, (long_name, powers) in {**MEANING, **own}.items():
        unit = units.text(powers, case.reading.length_unit)
        dataset[name].attrs = {"long_name": long_name, "units": unit}
    return dataset.assign_attrs(title=f"{case.material.law.name}, {path.name}", path=path.name)


STRAINS = ("strain_xx", "strain_yy", "strain_xy")
MEANING = {
    "strain": ("strain along the path", "1"),
    **dict(zip(STRAINS, ((f"strain, {way}", "1") for way in ("horizontal", "upright", "shear")), strict=True)),
    "tau_xx": ("Kirchhoff stress, horizontal", STRESS),
    "tau_yy": ("Kirchhoff stress, upright", STRESS),
    "tau_xy": ("Kirchhoff stress, shear", STRESS),
    "pressure": ("mean pressure in the plane", STRESS),
    "shear": ("largest shear stress in the plane", STRESS),
    "von_mises": ("von Mises stress of Eqs. 3 to 5", STRESS),
    "J_P": ("plastic volume ratio", "1"),
    "factor": ("factor of Eq. 1 on the moduli", "1"),
    "work": ("work of the strain since the start", STRESS),
    "elastic_energy": ("elastic energy", STRESS),
    "plastic_work": ("energy by plastic flow since the start", STRESS),
    "hardening_work": ("energy by the change of Eq. 1's factor since the start", STRESS),
    "wave_speed2": ("square of the speed that the time step rests on", "L2/T2"),
}
WORD = re.compile(r"[A-Za-z]\w*", re.ASCII)
# Names that particles, runs, checkpoints and paths have: a law keeps nothing under one of these.
TAKEN = {
    *SHAPES, *ATTRIBUTES, *ledger.MEANING, *ledger.INDENTER, *MEANING,
    "frame", "time", "snapshot", "snapshot_time", "particle", "axis", "step",
    clusters.MEMBER, clusters.POSITION, clusters.FRAMES, "cluster_number",
    "top_speed2", "test_place", "seconds", "began",
}  # fmt: skip
