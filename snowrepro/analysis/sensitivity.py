"""What the definition of a lump does: one run's lump fraction under every choice, from its stored bonds."""

from itertools import product

import numpy as np
import pandas as pd
import xarray as xr

from ..config import Analysis, Config
from ..store import runs
from .bonds import BondHistory, Bonds
from .definitions import DEFINITIONS
from .fragments import ROUND_OFF
from .motion import motion_of
from .summary import bonds_of
from .tree import HalfBonds, Tree, core_strain, grow_tree, half_bonds, holding_strain

STRAINS = (0.2, 0.25, 0.3, 0.35, 0.4, 0.5)
SIGNS = ("both", "crush", "stretch")
CORES = (0.25, 0.3333, 0.5, 1.0)  # 1: no core rule
LINKS = (1.0, 1.25, 1.5)
LUMPS = (0.003, 0.01, 0.03, 0.1)
DISTANCES = (0.75, 1.0, 1.5)  # of the definition by proximity [grid spacings]
DAMAGES = (0.25, 0.5, 0.75)
CHOICES = ("definition", "break_by", "break_strain", "core_fraction", "link_length", "lump_mass")


def scan(config: Config) -> pd.DataFrame:
    """The lump fraction of a finished run under every choice: columns CHOICES and lump_fraction.

    A lump's least mass is a part of the body alone here.  For proximity ``link_length`` is the distance that
    connects, and for damage ``core_fraction`` is the damage that isolates; what does not apply is NaN or empty.
    """
    seen = bonds_of(config)
    with runs.open_run(runs.result_path(config)) as dataset:
        spacing = float(dataset.attrs["grid_spacing"])
        others = _other_definitions(dataset, seen, config.analysis)
    return pd.concat([scan_bonds(seen, spacing), others], ignore_index=True)


def scan_bonds(seen: xr.Dataset, grid_spacing: float) -> pd.DataFrame:
    """The part of ``scan`` that bonds decide; ``seen`` as ``summary.bonds_of`` gives it."""
    mass = seen["mass"].values
    rows = []
    for link, sign in product(LINKS, SIGNS):
        pairs, halves = bonds_by_particle(seen, link * grid_spacing, sign)
        for core in CORES:
            tree = tree_of(pairs, halves, core)
            for strain in STRAINS:
                weights = np.bincount(tree.cut(strain), weights=mass)
                rows += [("bonds", sign, strain, core, link, least, _in_lumps(weights, least)) for least in LUMPS]
    return pd.DataFrame(rows, columns=[*CHOICES, "lump_fraction"])


def tree_curve(config: Config) -> tuple[np.ndarray, np.ndarray]:
    """Mass in lumps of a finished run over the break strain, all else as its analysis says: see ``Tree.lumps``."""
    seen, analysis = bonds_of(config), config.analysis
    tree = tree_of(*bonds_by_particle(seen, np.inf, analysis.break_by), analysis.core_fraction)
    return tree.lumps(seen["mass"].values, seen.attrs["least_lump"] * (1 - ROUND_OFF))


def bonds_by_particle(seen: xr.Dataset, longest: float, sign: str) -> tuple[np.ndarray, HalfBonds]:
    """Stored bonds up to the length ``longest``, pairs (m, 2), and the same by particle with their strains."""
    bonds, history = _stored_bonds(seen)
    kept = bonds.length <= longest * (1 + 1e-6)  # stored in single precision
    return bonds.pairs[kept], half_bonds(bonds.pairs[kept], history.strain(sign)[kept], seen.sizes["particle"])


def tree_of(pairs: np.ndarray, halves: HalfBonds, core_fraction: float) -> Tree:
    """Fragments at every break strain under one core rule."""
    return grow_tree(pairs, holding_strain(halves, core_strain(halves, core_fraction)), len(halves.degree))


def _other_definitions(dataset: xr.Dataset, seen: xr.Dataset, analysis: Analysis) -> pd.DataFrame:
    """Proximity, grid and damage at the last frame."""
    motion = motion_of(dataset.isel(snapshot=[-1]), release=int(dataset["snapshot"][-1]))
    bonds, history = _stored_bonds(seen)
    rows = []

    def add(name: str, sign: str, strain: float, core: float, link: float, **settings: float) -> None:
        chosen = analysis.model_copy(update=settings)
        weights = np.bincount(DEFINITIONS[name](motion, 0, bonds, history, chosen), weights=motion.mass)
        rows.extend((name, sign, strain, core, link, least, _in_lumps(weights, least)) for least in LUMPS)

    none = float("nan")
    for distance in DISTANCES:
        add("proximity", "", none, none, distance, proximity=distance)
    add("grid", "", none, none, none)
    for damage in DAMAGES:
        strain, link = analysis.break_strain, analysis.link_length
        add("damage", analysis.break_by, strain, damage, link, damage=damage)
    return pd.DataFrame(rows, columns=[*CHOICES, "lump_fraction"])


def _stored_bonds(seen: xr.Dataset) -> tuple[Bonds, BondHistory]:
    bonds = Bonds(seen["pair"].values, seen["length"].values.astype(float))
    return bonds, BondHistory(seen["stretch"].values.astype(float), seen["crush"].values.astype(float))


def _in_lumps(weights: np.ndarray, least: float) -> float:
    """Part of all mass in fragments of at least ``least``, a part of all."""
    total = weights.sum()
    return float(weights[weights >= least * total * (1 - ROUND_OFF)].sum() / total)
