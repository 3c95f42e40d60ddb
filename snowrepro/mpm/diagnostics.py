"""What is measured at the end of every frame: conserved quantities, energies, bounded particles."""

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
    "kinetic_energy": ("kinetic energy of the particles", "M L2/T2"),
    "elastic_energy": ("fixed corotated energy of F_E", "M L2/T2"),
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

BOUNDED = ("poisson_capped", "density_capped", "hardening_capped", "hardening_floored", "volume_bounded")


def measure(frame: Frame, config: Config) -> dict[str, float]:
    """All diagnostics of MEANING for one frame."""
    reading = config.reading
    mass, velocity, position = frame.read("mass"), frame.read("velocity"), frame.read("position")
    xi, J_P, poisson, density = frame.read("hardening"), frame.read("J_P"), frame.read("poisson"), frame.read("density")
    low, high = reading.hardening_exponent
    exponent = xi * (1.0 - J_P)
    bounded = np.clip(exponent, low, high)
    gravity = reading.gravity if frame.number > config.loading.press_frames else 0.0
    energy_density = elastic_energy(frame.read("F_E"), frame.read("mu"), frame.read("lam")) * np.exp(bounded)
    momentum = mass @ velocity
    return {
        "substeps": frame.substeps,
        "smallest_step": frame.smallest_step,
        "total_mass": float(mass.sum()),
        "momentum_x": float(momentum[0]),
        "momentum_y": float(momentum[1]),
        "kinetic_energy": float(0.5 * (mass * (velocity**2).sum(axis=1)).sum()),
        "elastic_energy": float((energy_density * frame.read("volume")).sum()),
        "gravitational_energy": float(gravity * (mass * position[:, 1]).sum()),
        "top_speed": float(np.sqrt((velocity**2).sum(axis=1).max())),
        "mean_density": float(density.mean()),
        "mean_young": float(frame.read("young").mean()),
        "mean_hardening": float(xi.mean()),
        "mean_factor": float(np.exp(bounded.mean())),
        "centre_height": float((mass * position[:, 1]).sum() / mass.sum()),
        "poisson_capped": int((poisson >= reading.poisson_cap).sum()),
        "density_capped": int((density >= config.sintering.rho_max).sum()),
        "hardening_capped": int((exponent >= high).sum()),
        "hardening_floored": int((exponent <= low).sum()),
        "volume_bounded": int(((J_P <= reading.plastic_volume[0]) | (J_P >= reading.plastic_volume[1])).sum()),
        "ended_inside": frame.ended_inside,
    }


def elastic_energy(F_E: np.ndarray, mu: np.ndarray, lam: np.ndarray) -> np.ndarray:
    """Fixed corotated energy density mu |F_E - R|^2 + lambda/2 (J_E - 1)^2; F_E (n, 2, 2)."""
    a = F_E[:, 0, 0] + F_E[:, 1, 1]
    b = F_E[:, 1, 0] - F_E[:, 0, 1]
    J_E = np.linalg.det(F_E)
    # |F - R|^2 = |F|^2 - 2 tr(R^T F) + 2, and tr(R^T F) = sqrt(a^2 + b^2) in two dimensions
    distance = (F_E**2).sum(axis=(1, 2)) - 2.0 * np.hypot(a, b) + 2.0
    return mu * distance + 0.5 * lam * (J_E - 1.0) ** 2


def bounded(dataset: xr.Dataset) -> list[str]:
    """One line for each bound of the reading that acted: on how many particles at most, from which frame."""
    lines = []
    for name in BOUNDED:
        counts = dataset[name].values
        if counts.any():
            first = int(dataset.frame[counts > 0][0])
            lines.append(f"{dataset[name].long_name}: up to {int(counts.max())}, first in frame {first}")
    return lines
