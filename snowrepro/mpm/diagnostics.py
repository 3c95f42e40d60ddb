"""What is measured at the end of every frame: mass, momentum, energy and where it went, bounded particles.

Their names and meanings, and of what each work is made, stand in ``ledger``.
"""

from collections.abc import Mapping

import numpy as np

from ..analysis.hardness import measure_height
from ..settings.case import Case
from ..settings.laws import Stomakhin
from .frame import Frame
from .ledger import CAUSES, ENERGIES, WORKS, meaning


def measure(frame: Frame, case: Case, before: Mapping[str, float] | None) -> dict[str, float]:
    """All diagnostics of a run for one frame; ``before`` is what the frame before gave, None for the first."""
    row = _describe_end(frame, case)
    if before is None:
        return {name: row.get(name, 0.0) for name in meaning(case)}
    start = _find_start(frame, case, before)
    row |= _find_works(frame, case, row, before, start)
    row |= _find_unclosed(frame, case, row, before, start)
    return {name: row[name] for name in meaning(case)}


def _describe_end(frame: Frame, case: Case) -> dict[str, float]:
    """What a frame's end shows by itself, of its particles and of how it was stepped."""
    reading = case.reading
    mass, velocity, position = frame.read("mass"), frame.read("velocity"), frame.read("position")
    xi, J_P, poisson, density = frame.read("hardening"), frame.read("J_P"), frame.read("poisson"), frame.read("density")
    low, high = reading.hardening_exponent
    softened = xi * np.where(J_P > 1.0, case.softening, 1.0)
    exponent = (
        softened * (1.0 - J_P) if isinstance(case.material.law, Stomakhin) else np.zeros_like(xi)
    )  # Eq. 1 is its own
    gravity = case.gravity_in(frame.number)
    momentum = mass @ velocity
    row = {
        "substeps": frame.outcome.substeps,
        "smallest_step": frame.outcome.smallest_step,
        "total_mass": float(mass.sum()),
        "momentum_x": float(momentum[0]),
        "momentum_y": float(momentum[1]),
        "kinetic_energy": frame.outcome.totals["kinetic_energy"],
        "elastic_energy": frame.outcome.totals["elastic_energy"],
        "gravitational_energy": float(gravity * (mass * position[:, 1]).sum()),
        "top_speed": float(np.sqrt((velocity**2).sum(axis=1).max())),
        "mean_density": float(density.mean()),
        "mean_young": float(frame.read("young").mean()),
        "mean_hardening": float(xi.mean()),
        "mean_factor": float(np.exp(np.log(frame.read("factor")).mean())),
        "body_height": measure_height(position[:, 1], mass),
        "centre_height": float((mass * position[:, 1]).sum() / mass.sum()),
        "poisson_capped": int((poisson >= reading.poisson_cap).sum()),
        "density_capped": int((density >= case.sintering.rho_max).sum()),
        "hardening_capped": int((exponent >= high).sum()),
        "hardening_floored": int((exponent <= low).sum()),
        "volume_bounded": int(((J_P <= reading.plastic_volume[0]) | (J_P >= reading.plastic_volume[1])).sum()),
        "ended_inside": frame.outcome.ended_inside,
    }
    if frame.test:
        row |= {"indenter_depth": frame.test.depth, "indenter_force": frame.test.force}
    return row


def _find_start(frame: Frame, case: Case, before: Mapping[str, float]) -> dict[str, float]:
    """Where a frame began: what the one before gave, without the motion that stopping at release took."""
    stopped = frame.number == case.loading.press_frames + 1 and case.reading.release == "rest"
    return {**before, **({"kinetic_energy": 0.0, "momentum_x": 0.0, "momentum_y": 0.0} if stopped else {})}


def _find_works(
    frame: Frame, case: Case, row: Mapping[str, float], before: Mapping[str, float], start: Mapping[str, float]
) -> dict[str, float]:
    """What each of CAUSES gave to the snow's energy from a frame's ``start`` to its end, the ``row``."""
    fallen = start["centre_height"] - row["centre_height"]
    booked = {
        **frame.outcome.totals,
        "potential_drop": case.gravity_in(frame.number) * row["total_mass"] * fallen,
        "kinetic_gain": row["kinetic_energy"] - start["kinetic_energy"],
        "kinetic_stop": before["kinetic_energy"] - start["kinetic_energy"],
    }
    return {cause.name: cause.work(booked) for cause in CAUSES}


def _find_unclosed(
    frame: Frame, case: Case, row: Mapping[str, float], before: Mapping[str, float], start: Mapping[str, float]
) -> dict[str, float]:
    """The change of energy and momentum in a frame that no cause explains; ``row`` has the works."""
    change = sum(row[name] - before[name] for name in ENERGIES)
    explained = 0.0
    for name in WORKS:  # sum() rounds otherwise from Python 3.12 on
        explained += row[name]
    unclosed = {"unclosed_energy": change - explained}
    weight = [0.0, case.gravity_in(frame.number) * row["total_mass"]]
    steady = (frame.read("mass") @ frame.read("force") - weight) * case.loading.frame_time
    for axis, given in zip("xy", steady, strict=True):
        change = row[f"momentum_{axis}"] - start[f"momentum_{axis}"]
        unclosed[f"unclosed_momentum_{axis}"] = float(change - given - frame.outcome.totals[f"impulse_{axis}"])
    return unclosed
