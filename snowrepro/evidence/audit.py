"""What the paper's equations give by themselves, where they contradict themselves or leave something open.

All follows from the numbers of a case by ``laws``; nothing is simulated.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..composition.compose import compose
from ..settings.case import Case
from ..summary.scales import measure_size, weigh_column
from . import laws

POINTS = 101  # of a line
READINGS = {False: "with Eq. 7's 3 - 2 ρ_r", True: "Eq. 8 as printed"}  # of Eq. 8, by whether it is as printed
MOST_LAMBDA = 20.0  # times E: beyond it a line is broken off, as lambda has no value between
PLANE_STRAINS = {"sideways held": (0.0, -1.0), "from all sides": (-1.0, -1.0)}  # of compression, in the plane
CRUSHED = 0.9  # J_P of snow that is hardly crushed


@dataclass(frozen=True)
class Finding:
    """What one place in the paper comes to.

    ``numbers``: by name; ``lines``: by label, x and y (n,) of what its panel shows; ``levels``: by label, heights that
    the lines are to be seen beside; ``points``: places (x, y) at which numbers are read.
    """

    numbers: Mapping[str, float]
    lines: Mapping[str, tuple[np.ndarray, np.ndarray]]
    levels: Mapping[str, float] = field(default_factory=dict)
    points: Sequence[tuple[float, float]] = ()


@np.errstate(all="ignore")  # where a number has no value with a case's constants, it is infinite
def audit_model(case: Case, pressures: Sequence[float]) -> dict[str, Finding]:
    """Work out all findings, by name.  ``pressures``: of Figure 5, rising [unit of E]."""
    return {
        "start": compare_starts(case),
        "lambda": follow_lambda(case),
        "density": densify_without_end(case, pressures),
        "updates": harden_by_updates(case, pressures[len(pressures) // 2]),
        "energy": stiffen_strained_snow(case),
        "cap": harden_without_cap(case, pressures),
        "units": weigh_in_both_units(case),
        "plane": compare_planes(case),
    }


def compare_starts(case: Case) -> Finding:
    """Compare the Poisson's ratio at which Eqs. 7 and 8 start with nu_0, in both readings of Eq. 8."""
    rho = np.linspace(1.0, 1.5, POINTS) * case.material.rho
    ratios = {as_printed: laws.poissons_ratio(rho, case, as_printed) for as_printed in READINGS}
    return Finding(
        {"start": float(ratios[True][0]), "nu_0": case.material.nu},
        {READINGS[as_printed]: (rho, nu) for as_printed, nu in ratios.items()},
        {"ν₀": case.material.nu},
        [(rho[0], float(nu[0])) for nu in ratios.values()],
    )


def follow_lambda(case: Case) -> Finding:
    """Follow lambda over E up to the largest density: it has no value where Poisson's ratio passes 0.5."""
    rho = np.linspace(case.material.rho, case.sintering.rho_max, 3 * POINTS)
    lines, numbers = {}, {}
    for as_printed, label in READINGS.items():
        nu = laws.poissons_ratio(rho, case, as_printed)
        _, lam = laws.lame_parameters(np.ones_like(nu), nu)
        lines[label] = (rho, np.where(np.abs(lam) < MOST_LAMBDA, lam, np.nan))
        suffix = "_printed" if as_printed else ""
        numbers[f"density{suffix}"] = laws.density_of_ratio(laws.LIMIT, case, as_printed)
        numbers[f"largest{suffix}"] = float(nu[-1])
    return Finding(numbers, lines, {"0": 0.0})


def densify_without_end(case: Case, pressures: Sequence[float]) -> Finding:
    """Follow density by Eq. 2's first term beyond the largest, under constant stresses as large as the pressures."""
    rho_max, pressed = case.sintering.rho_max, case.loading.press_frames * case.loading.frame_time
    rho = np.linspace(case.material.rho, 2.0 * rho_max, POINTS)
    needed = {each: float(laws.densification_time(rho_max, each, case)) for each in pressures}
    cell = measure_printed_cell(case)
    times = (case.reading.cell / cell) ** 2  # a stress is density length^2 / time^2, and the density is the printed one
    return Finding(
        {
            "seconds": needed[pressures[-1]], "highest": pressures[-1],
            "longest": needed[pressures[0]], "lowest": pressures[0],
            "pressed": pressed, "stress": float(laws.densification_time(rho_max, 1.0, case)) / pressed,
            "C1": case.sintering.C1, "C1_in_SI": case.sintering.C1 * times, "times": times, "cell": cell,
        },
        {f"{each:g}": (laws.densification_time(rho[1:], each, case), rho[1:]) for each in pressures},
        {"ρ_max": rho_max},
        [(seconds, rho_max) for seconds in needed.values()],
    )  # fmt: skip


def harden_by_updates(case: Case, stress: float) -> Finding:
    """Follow xi by Eq. 9 over a second under a constant stress, with frames of three lengths and in every time step.

    These are those of unpressed snow, and of snow that Eq. 1 has hardened to the cap.
    """
    frame = case.loading.frame_time
    steps = {f"frames of {part * frame:g} s": part * frame for part in (1.5, 1.0, 0.5)}
    factors = {"every time step": 1.0, "the same, at the cap": math.exp(case.reading.hardening_exponent[1])}
    steps |= {label: frame / count_substeps(case, factor) for label, factor in factors.items()}
    lines = {}
    for label, step in steps.items():
        updates = np.arange(math.floor(1.0 / step + 1e-9) + 1)
        lines[label] = (updates * step, laws.hardening_coefficient(stress, updates, case))
    ends = dict(
        zip(("long", "own", "short", "substep", "capped"), (float(xi[-1]) for _, xi in lines.values()), strict=True)
    )
    longest, _, shortest, *_ = steps.values()
    substeps, capped = (len(lines[label][0]) - 1 for label in factors)
    return Finding(
        {
            **ends, "frame": frame, "long_frame": longest, "short_frame": shortest, "stress": stress,
            "substeps": substeps, "capped_substeps": capped,
        },
        lines,
        points=[(float(time[-1]), float(xi[-1])) for time, xi in lines.values()],
    )  # fmt: skip


def count_substeps(case: Case, factor: float) -> int:
    """Count the time steps of a frame that snow at rest takes, its moduli ``factor`` times the initial ones."""
    material = case.material
    wave_speed = math.sqrt(factor * (material.lam + 2.0 * material.mu) / material.rho)
    return math.ceil(case.loading.frame_time * wave_speed / (case.solver.cfl * case.dx))


def stiffen_strained_snow(case: Case) -> Finding:
    """Follow the elastic energy of a strain that is held, as Eqs. 2 and 7 make the snow denser and so stiffer."""
    rho = np.linspace(1.0, 4.0, 3 * (POINTS - 1) + 1) * case.material.rho
    E = laws.youngs_modulus(rho, case)
    nu = np.minimum(laws.poissons_ratio(rho, case, as_printed=False), case.reading.poisson_cap)
    energies = {"E alone": E}
    for label, strain in PLANE_STRAINS.items():
        energies[f"E and ν, {label}"] = laws.elastic_energy(strain, *laws.lame_parameters(E, nu))
    ratios = {label: energy / energy[0] for label, energy in energies.items()}
    places = {times: (times - 1) * (len(rho) - 1) // 3 for times in (2, 3, 4)}
    names = dict(zip(energies, ("E", "held", "all_sides"), strict=True))
    return Finding(
        {
            **{f"rho_{times}": float(rho[place]) for times, place in places.items()},
            **{f"{names[label]}_{n}": float(ratio[i]) for label, ratio in ratios.items() for n, i in places.items()},
            "nu_cap": case.reading.poisson_cap,
        },
        {label: (rho, ratio) for label, ratio in ratios.items()},
        points=[(float(rho[place]), float(ratios["E alone"][place])) for place in places.values()],
    )


def harden_without_cap(case: Case, pressures: Sequence[float]) -> Finding:
    """Follow Eq. 1's factor over J_P: with xi of Table 1, and after the pressing under constant stresses."""
    J_P = np.linspace(0.8, 1.0, POINTS)
    updates, exponent = case.loading.press_frames, case.reading.hardening_exponent[1]
    grown = {each: np.float64(laws.hardening_coefficient(each, updates, case)) for each in pressures}
    xis = {f"ξ = {case.material.xi:g}": case.material.xi, **{f"ξ = {xi:.0f}, at {p:g}": xi for p, xi in grown.items()}}
    highest, lowest = grown[pressures[-1]], grown[pressures[0]]
    uncapped = {name: float(np.exp(laws.hardening_exponent(xi, CRUSHED, case))) for name, xi in
                (("first", case.material.xi), ("low", lowest), ("high", highest))}  # fmt: skip
    return Finding(
        {
            "J_P_high": 1.0 - exponent / highest, "J_P_low": 1.0 - exponent / lowest, "J_P": CRUSHED,
            **{f"factor_{name}": factor for name, factor in uncapped.items()},
            "xi": case.material.xi, "xi_low": lowest, "xi_high": highest, "lowest": pressures[0],
            "highest": pressures[-1], "exponent": exponent, "cap": math.exp(exponent), "updates": updates,
        },
        {label: (J_P, np.exp(laws.hardening_exponent(xi, J_P, case))) for label, xi in xis.items()},
        {f"cap, e^{exponent:g}": math.exp(exponent)},
        [(1.0 - exponent / xi, math.exp(exponent)) for xi in grown.values()],
    )  # fmt: skip


def weigh_in_both_units(case: Case) -> Finding:
    """Compare rho g D / E_0 of the body in grid units with that in SI, over the width that a cell may have there."""
    size, cell = measure_size(case), measure_printed_cell(case)
    grid, si = (case.model_copy(update={"reading": compose([f"reading={name}"]).case.reading}) for name in
                ("grid_units", "si"))  # fmt: skip
    weights = {"grid": weigh_column(grid, size), "si": weigh_column(si, size)}
    widths = np.geomspace(cell / 4.0, 100.0 * cell, POINTS)
    equal = weights["grid"] / weights["si"] * si.reading.cell
    return Finding(
        {
            "times": weights["grid"] / weights["si"], **weights, "size": size, "gravity": grid.reading.gravity,
            "mass": case.material.mass, "volume": case.material.mass / case.material.rho, "cell": cell,
            "per_cell": case.fidelity.particles_per_cell, "equal_cell": equal,
        },
        {"SI": (widths, weights["si"] * widths / si.reading.cell)},
        {"grid units": weights["grid"]},
        [(si.reading.cell, weights["si"]), (equal, weights["grid"])],
    )  # fmt: skip


def measure_printed_cell(case: Case) -> float:
    """Width of a cell [m] by Table 1: a particle's mass over the density is its area at unit depth."""
    return math.sqrt(case.fidelity.particles_per_cell * case.material.mass / case.material.rho)


def compare_planes(case: Case) -> Finding:
    """Compare the von Mises stress of plane strain with that without stress out of the plane, in two compressions."""
    nu = np.linspace(0.0, 0.499, POINTS)

    def take_ratio(strain: tuple[float, float], nu: np.ndarray) -> np.ndarray:
        """Plane strain over no stress out of the plane."""
        mu, lam = laws.lame_parameters(np.ones_like(nu), nu)
        both = (laws.von_mises_stress(strain, mu, lam, plane_strain) for plane_strain in (True, False))
        return np.divide(*both)

    ends = np.array([case.material.nu, case.reading.poisson_cap])
    ratios = {label: take_ratio(strain, ends) for label, strain in PLANE_STRAINS.items()}
    held, all_sides = ratios.values()
    return Finding(
        {
            "all_sides_last": float(all_sides[1]), "all_sides_first": float(all_sides[0]),
            "held_last": float(held[1]), "held_first": float(held[0]), "nu_0": float(ends[0]), "nu_cap": float(ends[1]),
        },
        {label: (nu, take_ratio(strain, nu)) for label, strain in PLANE_STRAINS.items()},
        points=[(float(x), float(y)) for ratio in ratios.values() for x, y in zip(ends, ratio, strict=True)],
    )  # fmt: skip
