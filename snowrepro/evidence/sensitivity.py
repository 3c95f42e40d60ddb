"""How the definition of a lump matters: one run's lump fraction under many settings of five rules."""

from itertools import product

import numpy as np
import pandas as pd
import xarray as xr

from ..analysis.bonds import BondHistory, Bonds
from ..analysis.definitions import DEFINITIONS, State
from ..analysis.fragments import ROUND_OFF
from ..analysis.gauge import Gauge
from ..analysis.motion import Motion, read_motion
from ..analysis.states import Bodies
from ..analysis.tree import HalfBonds, Tree, find_core_strain, find_holding_strain, grow_tree, sort_by_particle
from ..settings.analysis import Analysis
from ..store.run import Run
from ..summary.row import read_bonds

STRAINS = (0.2, 0.25, 0.3, 0.35, 0.4, 0.5)
SIGNS = ("both", "crush", "stretch")
CORES = (0.25, 0.3333, 0.5, 1.0)  # 1: no core rule
LINKS = (1.0, 1.25, 1.5)
LUMPS = (0.003, 0.01, 0.03, 0.1)
DISTANCES = (0.75, 1.0, 1.5)  # of the definition by proximity [grid spacings]
DAMAGES = (0.25, 0.5, 0.75)
RADII = (1.5, 2.5, 3.5)  # of the neighbourhoods [cells of the paper]
STRETCHES = (1.3, 1.5, 1.8)
CHANGES = ((0.1, 0.3), (0.2, 0.4), (0.2, 0.5), (0.3, 0.6), (0.4, 0.8))  # of volume
CHOICES = (
    "definition", "strain_radius", "part_stretch", "half_change", "break_by", "break_strain", "core_fraction",
    "link_length", "lump_mass",
)  # fmt: skip
NO_STRAIN = (float("nan"),) * 3
HALF_CHANGES = np.round(np.arange(0.15, 0.801, 0.025), 3)  # at which a curve is drawn


def scan_definitions(run: Run) -> pd.DataFrame:
    """Compute the lump fraction of a finished run under many definitions: columns CHOICES and lump_fraction.

    The least mass of a lump is a part of the body here, whatever it is in cells.  ``half_change``: change of volume
    at which snow is half crushed, or half loose, the middle of ``volume_change``.  For proximity ``link_length`` is the
    distance that connects, for damage ``core_fraction`` is the damage that isolates; what does not apply is NaN or
    empty.
    """
    bonds = read_bonds(run)
    with run.open() as dataset:
        spacing = float(dataset.attrs["grid_spacing"])
        by_strain = scan_strain(dataset, run.config.question.analysis)
        others = scan_other_definitions(read_motion(dataset), bonds, run.config.question.analysis)
    return pd.concat([by_strain, scan_bonds(bonds, spacing), others], ignore_index=True)


def scan_strain(dataset: xr.Dataset, analysis: Analysis) -> pd.DataFrame:
    """Compute the part of ``scan_definitions`` that uses strain: its thresholds, its radius and the least lump."""
    motion = read_motion(dataset)
    rows: list[tuple] = []
    for radius, stretch in ((RADII[1], STRETCHES[0]), *product(RADII, STRETCHES[1:2]), (RADII[1], STRETCHES[2])):
        followed = analysis.model_copy(update={"strain_radius": radius, "part_stretch": stretch})
        gauge = Gauge(motion, followed)
        *_, (_, centre) = gauge.follow(int(motion.frames[-1]))
        for change, least in product(CHANGES, LUMPS):
            gauge.analysis = followed.model_copy(
                update={"volume_change": change, "lump_mass": least, "lump_cells": 0.0}
            )
            lumps = float(gauge.divide_clusters(centre)[:, 0].sum())
            rows.append(("strain", radius, stretch, float(np.mean(change)), "", *[np.nan] * 3, least, lumps))
    return pd.DataFrame(rows, columns=[*CHOICES, "lump_fraction"])


def scan_bonds(dataset: xr.Dataset, grid_spacing: float) -> pd.DataFrame:
    """Compute the part of ``scan_definitions`` that uses bonds; ``dataset`` as ``summary.row.read_bonds`` gives it."""
    mass = dataset["mass"].values
    rows = []
    for link, sign in product(LINKS, SIGNS):
        pairs, halves = select_bonds(dataset, link * grid_spacing, sign)
        for core in CORES:
            tree = make_tree(pairs, halves, core)
            for strain in STRAINS:
                weights = np.bincount(tree.cut(strain), weights=mass)
                rows += [
                    ("bonds", *NO_STRAIN, sign, strain, core, link, least, _measure_lumps(weights, least, mass.sum()))
                    for least in LUMPS
                ]
    return pd.DataFrame(rows, columns=[*CHOICES, "lump_fraction"])


def measure_lump_curve(run: Run) -> np.ndarray:
    """Compute the mass in lumps of a finished run by strain, for HALF_CHANGES; all else is as its analysis says."""
    analysis = run.config.question.analysis
    width = np.ptp(analysis.volume_change)
    with run.open() as dataset:
        gauge = Gauge(read_motion(dataset), analysis)
    *_, (_, centre) = gauge.follow(int(gauge.frames[-1]))
    lumps = []
    for half in HALF_CHANGES:
        ends = (max(half - width / 2, 0.0), half + width / 2)
        gauge.analysis = analysis.model_copy(update={"volume_change": ends})
        lumps.append(float(gauge.divide_clusters(centre)[:, 0].sum()))
    return np.array(lumps)


def select_bonds(dataset: xr.Dataset, longest: float, sign: str) -> tuple[np.ndarray, HalfBonds]:
    """Select stored bonds up to the length ``longest``: pairs (m, 2), and the same by particle with their strains."""
    bonds, history = _read_bonds(dataset)
    is_short = bonds.length <= longest * (1 + 1e-6)  # stored in single precision
    return bonds.pairs[is_short], sort_by_particle(
        bonds.pairs[is_short], history.strain(sign)[is_short], dataset.sizes["particle"]
    )


def make_tree(pairs: np.ndarray, halves: HalfBonds, core_fraction: float) -> Tree:
    """Make the fragments at every break strain for one core rule."""
    return grow_tree(pairs, find_holding_strain(halves, find_core_strain(halves, core_fraction)), len(halves.degree))


def scan_other_definitions(motion: Motion, bond_dataset: xr.Dataset, analysis: Analysis) -> pd.DataFrame:
    """Compute the lump fraction by proximity, grid and damage in the last frame; what has vanished is in no lump."""
    nothing, is_there = np.zeros(len(motion.mass)), ~motion.vanished[-1]
    last = len(motion.frames) - 1
    state = State(motion, last, *_read_bonds(bond_dataset), Bodies(nothing.astype(int), nothing, nothing))
    rows: list[tuple] = []

    def add(name: str, sign: str, strain: float, core: float, link: float, **settings: float) -> None:
        """Add the rows of one definition with some settings of the analysis changed."""
        changed = analysis.model_copy(update=settings)
        component = DEFINITIONS[name](state, changed)
        weights, total = np.bincount(component[is_there], motion.mass[is_there]), motion.mass.sum()
        rows.extend(
            (name, *NO_STRAIN, sign, strain, core, link, least, _measure_lumps(weights, least, total))
            for least in LUMPS
        )

    none = float("nan")
    for distance in DISTANCES:
        add("proximity", "", none, none, distance, proximity=distance)
    add("grid", "", none, none, none)
    for damage in DAMAGES:
        strain, link = analysis.break_strain, analysis.link_length
        add("damage", analysis.break_by, strain, damage, link, damage=damage)
    return pd.DataFrame(rows, columns=[*CHOICES, "lump_fraction"])


def _read_bonds(dataset: xr.Dataset) -> tuple[Bonds, BondHistory]:
    """Read bonds and their extreme strains from what is stored of them, in double precision."""
    bonds = Bonds(dataset["pair"].values, dataset["length"].values.astype(float))
    return bonds, BondHistory(dataset["stretch"].values.astype(float), dataset["crush"].values.astype(float))


def _measure_lumps(weights: np.ndarray, least: float, total: float) -> float:
    """Return the part of the mass ``total`` that is in fragments of at least ``least``, a part of it."""
    return float(weights[weights >= least * total * (1 - ROUND_OFF)].sum() / total)
