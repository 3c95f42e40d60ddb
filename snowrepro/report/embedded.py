"""What the viewer holds of one run: places and fields at some frames, and from which break strain each bond holds.

Break strains come from a ladder, so that of a bond's strain only the number of the first step counts at which it
still holds.  That decides everything but on which of several cores a particle hangs (``analysis.tree``), for which
strains within one step differ: for each sign and core rule it is stored how far the step from which a bond holds two
particles together, worked out from steps alone, is from the right one.  It is 0 for nearly all bonds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..analysis.bonds import BondHistory, Bonds, Extremes, lay_bonds
from ..analysis.motion import Motion, motion_of
from ..analysis.summary import row_of
from ..analysis.tree import HalfBonds, core_strain, half_bonds, holding_strain
from ..config import Config
from .evidence import opened
from .packing import differences, packed

FIELDS = ("density", "J_P")
FINENESS = 1024  # of the squares along a side by which particles are put in order


@dataclass(frozen=True)
class Settings:
    """What the viewer lets one choose: ``ladder`` of break strains, rising; ``signs``; ``cores``, core fractions."""

    ladder: tuple[float, ...]
    signs: tuple[str, ...]
    cores: tuple[float, ...]


@dataclass(frozen=True)
class Embedded:
    """One run, its particles in an order in which neighbours are mostly near.

    ``places`` (frames, n, 2); ``fields`` by name (frames, n), and their ``units``; ``mass`` (n,); ``gone`` (n,): the
    frame by its place in the list from which a particle has vanished, as many as there are frames if it never does.
    ``bonds``: packed, see ``_packed_bonds``.  ``least``: mass of a lump by its least size in cells; ``lump_fraction``:
    as the report gives it.
    """

    config: Config
    places: np.ndarray
    fields: dict[str, np.ndarray]
    units: dict[str, str]
    mass: np.ndarray
    gone: np.ndarray
    bonds: dict[str, int | str]
    least: float
    lump_fraction: float


def embed(config: Config, frames: Sequence[int], settings: Settings) -> Embedded:
    """Read a finished run at ``frames``, which are stored and among which are the release and the last."""
    with opened(config) as dataset:
        motion = motion_of(dataset)
        shown = dataset[["position", *FIELDS]].sel(snapshot=list(frames)).load()
    order = _along_a_curve(motion.position[0])
    places = shown["position"].values[:, order].astype(float)
    gone = np.isnan(places).any(axis=2)
    return Embedded(
        config,
        _last_known(places, gone),
        {name: np.nan_to_num(shown[name].values[:, order]) for name in FIELDS},
        {name: shown[name].attrs["units"] for name in FIELDS},
        motion.mass[order],
        len(frames) - gone.sum(axis=0),
        _packed_bonds(config, motion, order, [frame for frame in frames if frame >= motion.release], settings),
        config.analysis.lump_cells * motion.cell_mass,
        float(row_of(config)["lump_fraction"]),
    )


def _along_a_curve(places: np.ndarray) -> np.ndarray:
    """Order of particles, (n,), along a curve through all squares of a grid (Morton), by ``places`` (n, 2)."""
    low = places.min(axis=0)
    square = ((places - low) / max(np.ptp(places, axis=0).max(), np.finfo(float).tiny) * (FINENESS - 1)).astype(int)
    code = np.zeros(len(places), dtype=int)
    for bit in range(FINENESS.bit_length() - 1):
        for axis in range(2):
            code |= ((square[:, axis] >> bit) & 1) << (2 * bit + axis)
    return np.argsort(code, kind="stable")


def _last_known(places: np.ndarray, gone: np.ndarray) -> np.ndarray:
    """``places`` (frames, n, 2) where a particle that is ``gone`` (frames, n) stays where it was."""
    for now in range(1, len(places)):
        places[now][gone[now]] = places[now - 1][gone[now]]
    return places


def _packed_bonds(
    config: Config, motion: Motion, order: np.ndarray, frames: Sequence[int], settings: Settings
) -> dict[str, int | str]:
    """Bonds and what they saw up to each of ``frames``, packed, sorted by their particles' places in ``order``.

    ``pairs`` (2, m): first particle as differences, and how far behind it the second is; ``steps`` (2, frames, m):
    numbers of steps of the ladder, of stretch and of crushing, differences in time; ``corrections`` (signs x cores,
    frames, m): likewise, see above.
    """
    bonds = lay_bonds(motion.position[0].astype(float), config.analysis.link_length * motion.grid_spacing)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    pairs = np.sort(rank[bonds.pairs], axis=1)
    by_place = np.lexsort((pairs[:, 1], pairs[:, 0]))
    first, second = pairs[by_place].T
    steps, corrections = [], []
    for history in _histories(motion, bonds, frames):
        steps.append([_steps(strain, settings)[by_place] for strain in (history.stretch, -history.crush)])
        corrections.append(_corrections(pairs, by_place, len(order), history, settings))
    return {
        "count": len(pairs),
        "pairs": packed(np.stack([differences(first), second - first])),
        "steps": packed(differences(np.array(steps, dtype=np.uint8)).swapaxes(0, 1)),
        "corrections": packed(differences(np.array(corrections, dtype=np.uint8)).swapaxes(0, 1)),
    }


def _histories(motion: Motion, bonds: Bonds, frames: Sequence[int]) -> list[BondHistory]:
    """What the bonds have seen by each of ``frames``, every stored frame counted."""
    extremes, found = Extremes(bonds), []
    for frame, position in zip(motion.frames.tolist(), motion.position, strict=True):
        extremes.extend(position)
        if frame in frames:
            found.append(extremes.history())
    return found


def _steps(strain: np.ndarray, settings: Settings) -> np.ndarray:
    """The first step of the ladder that is not below each strain; their number where none is."""
    return np.searchsorted(settings.ladder, strain)


def _corrections(
    pairs: np.ndarray, by_place: np.ndarray, count: int, history: BondHistory, settings: Settings
) -> list[np.ndarray]:
    """Step from which each bond holds, less what the steps alone say, modulo 256: (m,) for each sign and core rule."""
    found = []
    for sign in settings.signs:
        strain = history.strain(sign)
        steps = _steps(strain, settings)
        if not steps.any():  # nothing has strained: all bonds hold from the first step on
            found += [np.zeros(len(pairs), dtype=int)] * len(settings.cores)
            continue
        exact = half_bonds(pairs, strain, count)
        rough = half_bonds(pairs[by_place], steps[by_place], count)
        found += [
            (_steps(_holding(exact, core), settings)[by_place] - _holding(rough, core).astype(int)) % 256
            for core in settings.cores
        ]
    return found


def _holding(halves: HalfBonds, core_fraction: float) -> np.ndarray:
    return holding_strain(halves, core_strain(halves, core_fraction))
