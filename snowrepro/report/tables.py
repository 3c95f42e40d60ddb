"""Tables 1 and 2 beside the paper's: the parameters, and particles and seconds a frame."""

import math
from functools import reduce

import pandas as pd

from ..config import Config
from ..scene.build import build_scene
from ..store import runs
from .document import Findings, Table
from .evidence import Evidence, opened

# Table 1 as printed: symbol, value, where it is in the config (None: it follows), where it acts.
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

# Table 2 as printed: shape, floor, particles, seconds a frame; on a 2.5 GHz Core i7 under OS X 10.11.
TABLE_2 = (("ball", "L", 8151, 0.25), ("star", "square", 22076, 0.51))


def report_parameters(evidence: Evidence) -> Findings:
    """Table 1: the parameters as used beside the paper's."""
    config = evidence.configs[0]
    mass = build_scene(config).mass
    rows = []
    for symbol, printed, place, acts in TABLE_1:
        used = reduce(getattr, place.split("."), config) if place else mass
        same = "yes" if math.isclose(used, printed, rel_tol=1e-4) else "**no**"
        rows.append([symbol, f"{printed:g}", f"{used:g}", same, acts, f"`{place}`" if place else "density x area"])
    table = pd.DataFrame(rows, columns=["parameter", "paper", "used", "same", "acts in", "config"])
    table.to_csv(evidence.folder / "table1.csv", index=False, lineterminator="\n")
    same = int((table["same"] == "yes").sum())
    verdict = f"{same} of {len(table)} parameters of Table 1 are used as printed."
    return Findings([Table(table, data="table1.csv"), *_about_mass(config, mass)], verdict)


def _about_mass(config: Config, mass: float) -> list[str]:
    unit = "cell" if config.reading.length_unit == "cell" else "m"
    return [
        f"A particle's mass follows from density x area: {mass:.4g} kg per {unit} of depth with "
        f"the reading `{config.reading.name}` at fidelity `{config.fidelity.name}`. The printed 0.01 kg is "
        "rho dx^2 / 4 for dx = 0.02 m, which is the reading `si`. As printed it is `material.mass`, which is used only "
        "where b is read as a force per particle (`reading.external_force=per_particle`).",
        "The table prints no unit for E_0 and none for C_1 to C_5; units in which they are read: conf/.",
    ]


def report_timings(evidence: Evidence) -> Findings:
    """Table 2: particles and seconds a frame beside the paper's, with the machine and the substeps."""
    rows = []
    for shape, floor, particles, seconds in TABLE_2:
        matching = [c for c in evidence.configs if (c.shape.name, c.floor.name) == (shape, floor)]
        for config in matching:
            rows.append([f"{shape} shape, {floor} floor", f"{particles:,}", *_measured(config, evidence, seconds)])
    columns = ["example", "particles (paper)", "particles", "s/frame (paper)", "s/frame", "paper / here", "substeps"]
    table = pd.DataFrame(rows, columns=columns)
    table.to_csv(evidence.folder / "table2.csv", index=False, lineterminator="\n")
    told = "; ".join(f"{row[0]}: {row[2]} particles, {row[4]} s/frame (paper: {row[3]})" for row in rows)
    blocks = [
        Table(table, data="table2.csv"),
        "Seconds a frame: mean over all frames of one run on one core, pressing, sintering, diagnostics and storing "
        "included, compilation not. Substeps: mean a frame; they follow the stiffness. The paper measured on a "
        "2.5 GHz Core i7 and prints neither its time step nor its substeps, so the ratio compares machines and "
        "settings as much as programs.",
        *_machines(evidence),
    ]
    return Findings(blocks, f"{told}.")


def _machines(evidence: Evidence) -> list[str]:
    """On what the runs were timed."""
    machines = set()
    for config in evidence.configs:
        if evidence.is_done(config):
            with opened(config) as dataset:
                machines.add(dataset.attrs["machine"])
    return [f"Here: {'; '.join(sorted(machines))}."] if machines else []


def _measured(config: Config, evidence: Evidence, printed: float) -> list[str]:
    """Particles, the paper's seconds, ours, their ratio, and substeps a frame."""
    if not evidence.is_done(config):
        return ["missing", f"{printed:g}", "missing", "", ""]
    row = evidence.table.set_index("run_id").loc[runs.identify(config)]
    with opened(config) as dataset:
        substeps = float(dataset["substeps"][1:].mean())
    seconds = float(row["seconds_per_frame"])
    return [f"{row['particles']:,}", f"{printed:g}", f"{seconds:.3f}", f"{printed / seconds:.1f}", f"{substeps:.1f}"]
