"""What is measured at the end of every frame: mass, momentum, energy and where it went, bounded particles.

The energy ledger: kinetic + elastic energy change in a frame by the works of WORKS, each what one cause gave to
the snow, and by ``unclosed_energy``, the rest.  All causes are measured where they act, so the rest is not there
by construction: it is the error of stepping in time, of the order of the time step.
"""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from ..config import Config
from .solver import Frame

# Name of each diagnostic: long name, unit in powers of length, mass and time.
MEANING = {
    "substeps": ("substeps of the frame", "1"),
    "smallest_step": ("smallest time step of the frame", "T"),
    "total_mass": ("mass of all particles", "M"),
    "momentum_x": ("horizontal momentum", "M L/T"),
    "momentum_y": ("vertical momentum", "M L/T"),
    "unclosed_momentum_x": ("horizontal momentum that no cause explains", "M L/T"),
    "unclosed_momentum_y": ("vertical momentum that no cause explains", "M L/T"),
    "kinetic_energy": ("kinetic energy of the particles, their affine motion included", "M L2/T2"),
    "elastic_energy": ("fixed corotated energy of F_E", "M L2/T2"),
    "pressing_work": ("work of the external force b in the frame", "M L2/T2"),
    "gravity_work": ("work of gravity in the frame", "M L2/T2"),
    "sintering_work": ("energy that sintering put in, as moduli, xi and volume changed, in the frame", "M L2/T2"),
    "plastic_work": ("elastic energy that plastic flow took (negative) in the frame", "M L2/T2"),
    "hardening_work": ("energy that the changing factor of Eq. 1 put in, in the frame", "M L2/T2"),
    "floor_work": ("work of the floor, by contact, friction and moving particles out, in the frame", "M L2/T2"),
    "damping_work": ("work of damping and of stopping at release, in the frame", "M L2/T2"),
    "transfer_work": ("kinetic energy lost (negative) between particles and grid in the frame", "M L2/T2"),
    "unclosed_energy": ("energy that no cause explains: the error of stepping in time, in the frame", "M L2/T2"),
    "gravitational_energy": ("potential energy above y = 0 under the gravity of the frame", "M L2/T2"),
    "top_speed": ("largest particle speed", "L/T"),
    "mean_density": ("mean density of Eq. 2", "M/L3"),
    "mean_young": ("mean Young's modulus before hardening", "M/L/T2"),
    "mean_hardening": ("mean hardening coefficient xi", "1"),
    "mean_factor": ("geometric mean of the hardening factor of Eq. 1", "1"),
    "centre_height": ("height of the centre of mass", "L"),
    "poisson_capped": ("particles at the cap of Poisson's ratio", "1"),
    "density_capped": ("particles at the maximum density", "1"),
    "hardening_capped": ("particles at the highest exponent of Eq. 1", "1"),
    "hardening_floored": ("particles at the lowest exponent of Eq. 1", "1"),
    "volume_bounded": ("particles at a bound of J_P", "1"),
    "ended_inside": ("times in the frame that a particle ended inside the floor", "1"),
}

# What runs with an indenter have beside.
INDENTER = {
    "indenter_depth": ("depth of the indenter below first touch, at the end of the frame", "L"),
    "indenter_force": ("upward force on the indenter at unit depth out of the plane, mean over the frame", "M L/T2"),
}

WORKS = (
    "pressing_work",
    "gravity_work",
    "sintering_work",
    "plastic_work",
    "hardening_work",
    "floor_work",
    "damping_work",
    "transfer_work",
)

BOUNDED = ("poisson_capped", "density_capped", "hardening_capped", "hardening_floored", "volume_bounded")


def meaning(config: Config) -> dict[str, tuple[str, str]]:
    """The diagnostics of a run, as in MEANING."""
    return {**MEANING, **INDENTER} if config.indenter else MEANING


def measure(frame: Frame, config: Config, before: Mapping[str, float] | None) -> dict[str, float]:
    """All diagnostics of a run for one frame; ``before`` is what the frame before gave, None for the first."""
    reading = config.reading
    mass, velocity, position = frame.read("mass"), frame.read("velocity"), frame.read("position")
    xi, J_P, poisson, density = frame.read("hardening"), frame.read("J_P"), frame.read("poisson"), frame.read("density")
    low, high = reading.hardening_exponent
    exponent = xi * (1.0 - J_P)
    gravity = config.gravity_in(frame.number)
    momentum = mass @ velocity
    row = {
        "substeps": frame.substeps,
        "smallest_step": frame.smallest_step,
        "total_mass": float(mass.sum()),
        "momentum_x": float(momentum[0]),
        "momentum_y": float(momentum[1]),
        "kinetic_energy": frame.totals["kinetic_energy"],
        "elastic_energy": frame.totals["elastic_energy"],
        "gravitational_energy": float(gravity * (mass * position[:, 1]).sum()),
        "top_speed": float(np.sqrt((velocity**2).sum(axis=1).max())),
        "mean_density": float(density.mean()),
        "mean_young": float(frame.read("young").mean()),
        "mean_hardening": float(xi.mean()),
        "mean_factor": float(np.exp(np.log(frame.read("factor")).mean())),
        "centre_height": float((mass * position[:, 1]).sum() / mass.sum()),
        "poisson_capped": int((poisson >= reading.poisson_cap).sum()),
        "density_capped": int((density >= config.sintering.rho_max).sum()),
        "hardening_capped": int((exponent >= high).sum()),
        "hardening_floored": int((exponent <= low).sum()),
        "volume_bounded": int(((J_P <= reading.plastic_volume[0]) | (J_P >= reading.plastic_volume[1])).sum()),
        "ended_inside": frame.ended_inside,
    }
    if frame.test:
        row |= {"indenter_depth": frame.test.depth, "indenter_force": frame.test.force}
    if before is None:
        return {name: row.get(name, 0.0) for name in meaning(config)}
    stopped = frame.number == config.loading.press_frames + 1 and reading.release == "rest"
    start = {**before, **({"kinetic_energy": 0.0, "momentum_x": 0.0, "momentum_y": 0.0} if stopped else {})}
    row |= _works(frame.totals, row, start, gravity)
    row["damping_work"] -= before["kinetic_energy"] - start["kinetic_energy"]
    change = sum(row[name] - before[name] for name in ("kinetic_energy", "elastic_energy"))
    explained = 0.0
    for name in WORKS:  # sum() rounds otherwise from Python 3.12 on
        explained += row[name]
    row["unclosed_energy"] = change - explained
    steady = (mass @ frame.read("force") - [0.0, gravity * row["total_mass"]]) * config.loading.frame_time
    for axis, given in zip("xy", steady, strict=True):
        change = row[f"momentum_{axis}"] - start[f"momentum_{axis}"]
        row[f"unclosed_momentum_{axis}"] = float(change - given - frame.totals[f"impulse_{axis}"])
    return {name: row[name] for name in meaning(config)}


def _works(
    totals: Mapping[str, float], row: Mapping[str, float], start: Mapping[str, float], gravity: float
) -> dict[str, float]:
    """What each cause gave to the snow's energy in the frame; ``start`` is where the frame began."""
    fallen = start["centre_height"] - row["centre_height"]
    gained = row["kinetic_energy"] - start["kinetic_energy"]
    own = ("pressing_work", "sintering_work", "plastic_work", "hardening_work", "damping_work")
    return {
        **{name: totals[name] for name in own},
        "gravity_work": gravity * row["total_mass"] * fallen,
        "floor_work": totals["contact_work"] + totals["sliding_work"] + totals["lifting_work"],
        "transfer_work": gained - totals["kinetic_work"] - totals["sliding_work"],
    }


def unclosed_share(dataset: xr.Dataset) -> float:
    """Energy that no cause explains, frame by frame without sign, as a part of what the causes gave and took."""
    turned_over = float(sum(abs(dataset[name]).sum() for name in WORKS))
    return float(abs(dataset["unclosed_energy"]).sum()) / turned_over if turned_over else 0.0


def bounded(dataset: xr.Dataset) -> list[str]:
    """One line for each bound of the reading that acted: on how many particles at most, from which frame."""
    lines = []
    for name in BOUNDED:
        counts = dataset[name].values
        if counts.any():
            first = int(dataset.frame[counts > 0][0])
            lines.append(f"{dataset[name].long_name}: up to {int(counts.max())}, first in frame {first}")
    return lines
