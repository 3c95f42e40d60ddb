"""One point of a case's material led along a path of strain, as a Dataset: what a law does, without a run."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.linalg import expm

from . import units
from .errors import ConfigError
from .laws.choose import make_material
from .mpm.point import Points
from .mpm.solver import start_taichi
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


@dataclass(frozen=True)
class Path:
    """A path of strain: one of PATHS, its greatest ``strain`` (logarithmic; in shear the angle) and its steps."""

    name: str = "compression"
    strain: float = 0.2
    steps: int = 400

    def __post_init__(self) -> None:
        if self.name not in PATHS:
            raise ConfigError(f"there is no path '{self.name}'; there are: {', '.join(PATHS)}")
        if not (0 < self.strain <= 5 and 1 <= self.steps <= 100_000):
            raise ConfigError("a path has a strain above 0 and up to 5, and 1 to 100,000 steps")

    @property
    def strains(self) -> np.ndarray:
        """Strain along the path at its start and after each step."""
        _, place = PATHS[self.name]
        return self.strain * place(np.linspace(0.0, 1.0, self.steps + 1))


def follow_path(case: Case, path: Path) -> xr.Dataset:
    """Lead a point of unpressed snow along a path.

    Returns stress (Kirchhoff), what the material remembers, and where the work went, at the start and after each step.
    """
    start_taichi(case.solver, threads=1)
    points, direction = Points(case, 1), PATHS[path.name][0]
    points.deform(np.eye(2))
    rows, work = [_read_row(points)], [0.0]
    for change in np.diff(path.strains):
        points.deform(expm(change * direction))
        rows.append(_read_row(points))
        mean = 0.5 * (rows[-2]["tau"] + rows[-1]["tau"])
        work.append(work[-1] + change * float((mean * direction).sum()))
    return _describe(case, path, rows, work)


def _read_row(points: Points) -> dict[str, np.ndarray]:
    """What is kept of the point after a step."""
    own = [quantity.name for quantity in points.constants.material.STATE]
    names = ("tau", "von_mises", "J_P", "factor", "plastic_work", "hardening_work", "wave_speed2", *own)
    return {**{name: points.read(name)[0] for name in names}, "elastic_energy": points.energies[0]}


def _describe(case: Case, path: Path, rows: list[dict[str, np.ndarray]], work: list[float]) -> xr.Dataset:
    """Put a path into a Dataset with names and units."""
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    tau = columns.pop("tau")
    columns |= {
        "tau_xx": tau[:, 0, 0], "tau_yy": tau[:, 1, 1], "tau_xy": tau[:, 0, 1],
        "pressure": -0.5 * (tau[:, 0, 0] + tau[:, 1, 1]),
        "shear": np.hypot(0.5 * (tau[:, 0, 0] - tau[:, 1, 1]), tau[:, 0, 1]),
        "work": np.array(work),
    }  # fmt: skip
    variables = {name: ("step", values) for name, values in columns.items()}
    dataset = xr.Dataset(variables, {"strain": ("step", path.strains)})
    own = {quantity.name: (quantity.long_name, quantity.unit) for quantity in make_material(case).STATE}
    for name, (long_name, powers) in {**MEANING, **own}.items():
        unit = units.text(powers, case.reading.length_unit)
        dataset[name].attrs = {"long_name": long_name, "units": unit}
    return dataset.assign_attrs(title=f"{case.material.law.name}, {path.name}", path=path.name)


MEANING = {
    "strain": ("strain along the path", "1"),
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
