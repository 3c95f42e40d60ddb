"""Table 1: the parameters that are used beside those of the paper."""

import math
from functools import reduce
from typing import Any

import pandas as pd

from ...evidence.gather import Evidence
from ...scene.build import build_scene
from ...settings.case import Case
from ...store.run import Run
from ...text import make_cells
from ..document import FigureContent, Table
from .kinds import FigureKind

# Table 1 as printed: symbol, value, key in the case (None: it follows from others), equations that it acts in.
TABLE_1 = (
    ("rho [kg/m^3]", 100, "material.rho", "Eq. 2, first value"),
    ("rho_max [kg/m^3]", 700, "sintering.rho_max", "Eq. 6"),
    ("E_0", 1.4e5, "material.E", "Eq. 8"),
    ("nu_0", 0.2, "material.nu", "Eq. 8"),
    ("m [kg]", 0.01, None, "momentum; see below"),
    ("C_1", 5e-7, "sintering.C1", "Eq. 2"),
    ("C_2", 1e-3, "sintering.C2", "Eq. 2"),
    ("C_3", -9, "sintering.C3", "Eqs. 7, 8"),
    ("C_4", 1e-3, "sintering.C4", "Eq. 9"),
    ("C_5", 1e-3, "sintering.C5", "Eq. 9"),
    ("theta_c", 1e-2, "material.theta_c", "plastic yield"),
    ("theta_s", 5e-3, "material.theta_s", "plastic yield"),
    ("xi", 5, "material.xi", "Eqs. 1, 9, first value"),
)

# How people read the symbols that the file spells.
SHOWN = {
    "rho [kg/m^3]": "ρ [kg/m³]", "rho_max [kg/m^3]": "ρ_max [kg/m³]", "E_0": "E₀", "nu_0": "ν₀", "C_1": "C₁",
    "C_2": "C₂", "C_3": "C₃", "C_4": "C₄", "C_5": "C₅", "theta_c": "θ_c", "theta_s": "θ_s", "xi": "ξ",
}  # fmt: skip


def report(evidence: Evidence) -> FigureContent:
    """Tabulate the parameters that are used beside those of the paper."""
    run = evidence.runs[0]
    mass = build_scene(run.case).mass
    rows = []
    for symbol, printed, place, acts in TABLE_1:
        used = _get_setting(run.case, place) if place else mass
        same = "yes" if math.isclose(used, printed, rel_tol=1e-4) else "**no**"
        rows.append([symbol, f"{printed:g}", f"{used:g}", same, acts, f"`{place}`" if place else "density x area"])
    table = pd.DataFrame(rows, columns=["parameter", "paper", "used", "same", "acts in", "config"])
    make_cells(table).to_csv(evidence.folder / "table1.csv", index=False, lineterminator="\n")
    as_printed = int((table["same"] == "yes").sum())
    verdict = f"{as_printed} of {len(table)} parameters of Table 1 are used as printed."
    shown = table.assign(parameter=[SHOWN.get(symbol, symbol) for symbol in table["parameter"]])
    return FigureContent([Table(shown, data="table1.csv"), *_explain_mass(run, mass)], verdict)


def _get_setting(case: Case, key: str) -> float:
    """Get the number that a case has for "section.key"."""
    value: Any = reduce(getattr, key.split("."), case)
    return float(value)


def _explain_mass(run: Run, mass: float) -> list[str]:
    """Explain the mass of a particle [kg], and the units of the table."""
    unit = "cell" if run.case.reading.length_unit == "cell" else "m"
    return [
        (
            f"A particle's mass follows from density x area: {mass:.4g} kg per {unit} of depth with the reading "
            f"`{run.case.reading.name}` at fidelity `{run.case.fidelity.name}`. The printed 0.01 kg is ρ dx² / 4 "
            "for dx = 0.02 m, which is the reading `si`. As printed it is `material.mass`, which is used only where b "
            "is read as a force per particle (`reading.external_force=per_particle`)."
        ),
        "The table prints no unit for E₀ and none for C₁ to C₅; units in which they are read: conf/.",
    ]


FIGURE = FigureKind(report, needs_runs=False)
