"""What the viewer holds of one run: particles at some frames, and from which break strain on each bond holds.

The reader chooses the break strain from a ladder.  So of a bond's strain only one number counts: the first step of
the ladder at which it still holds.  This decides everything except on which of several cores a particle hangs
(``analysis.tree``), where strains within one step differ.  For that, each sign and core rule has corrections: how far
the step that follows from steps alone is from the right one.  A correction is 0 for nearly all bonds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...analysis.bonds import BondHistory, Bonds, Extremes, lay_bonds
from ...analysis.motion import Motion, read_motion
from ...analysis.tree import HalfBonds, find_core_strain, find_holding_strain, sort_by_particle
from ...store.run import Run
from ...summary.row import read_row
from .packing import pack, take_differences

FIELDS = ("density", "J_P")
FINENESS = 1024  # of the squares along a side by which particles are put in order


@dataclass(frozen=True)
class ViewerSettings:
    """What the reader can choose: ``ladder`` of break strains, rising; ``signs``; ``cores``: core fractions."""

    ladder: tuple[float, ...]
    signs: tuple[str, ...]
    cores: tuple[float, ...]


@dataclass(frozen=True)
class EmbeddedRun:
    """One run, with its particles in an order in which neighbours are mostly near each other.

    ``places`` (frames, n, 2); ``fields`` by name (frames, n), and their ``units``; ``mass`` (n,); ``gone`` (n,): the
    index of the frame from which on a particle has vanished, or the number of frames.  ``bonds``: see ``_pack_bonds``.
    ``least``: mass of a lump by its least size in cells; ``lump_fraction``: as the report gives it.
    """

    run: Run
    places: np.ndarray
    fields: dict[str, np.ndarray]
    units: dict[str, str]
    mass: np.ndarray
    gone: np.ndarray
    bonds: dict[str, int | str]
    least: float
    lump_fraction: float


def embed(run: Run, frames: Sequence[int], settings: ViewerSettings) -> EmbeddedRun:
    """Read a finished run at ``frames``; these must be stored, and contain the release and the last frame."""
    with run.open() as dataset:
        motion = read_motion(dataset)
        stored = dataset[["position", *FIELDS]].sel(snapshot=list(frames)).load()
    order = _order_along_curve(motion.position[0])
    places = stored["position"].values[:, order].astype(float)
    gone = np.isnan(places).any(axis=2)
    return EmbeddedRun(
        run,
        _keep_last_places(places, gone),
        {name: np.nan_to_num(stored[name].values[:, order]) for name in FIELDS},
        {name: stored[name].attrs["units"] for name in FIELDS},
        motion.mass[order],
        len(frames) - gone.sum(axis=0),
        _pack_bonds(run, motion, order, [frame for frame in frames if frame >= motion.release], settings),
        run.config.question.analysis.lump_cells * motion.cell_mass,
        float(read_row(run)["lump_fraction"]),
    )


def _order_along_curve(places: np.ndarray) -> np.ndarray:
    """Order particles at ``places`` (n, 2) along a curve through all squares of a grid (Morton); returns (n,)."""
    low = places.min(axis=0)
    square = ((places - low) / max(np.ptp(places, axis=0).max(), np.finfo(float).tiny) * (FINENESS - 1)).astype(int)
    code = np.zeros(len(places), dtype=int)
    for bit in range(FINENESS.bit_length() - 1):
        for axis in range(2):
            code |= ((square[:, axis] >> bit) & 1) << (2 * bit + axis)
    return np.argsort(code, kind="stable")


def _keep_last_places(places: np.ndarray, gone: np.ndarray) -> np.ndarray:
    """Keep particles that are ``gone`` (frames, n) where they were last; ``places`` (frames, n, 2)."""
    for frame in range(1, len(places)):
        places[frame][gone[frame]] = places[frame - 1][gone[frame]]
    return places


def _pack_bonds(
    run: Run, motion: Motion, order: np.ndarray, frames: Sequence[int], settings: ViewerSettings
) -> dict[str, int | str]:
    """Pack the bonds and their strains up to each of ``frames``, sorted by their particles' places in ``order``.

    ``pairs`` (2, m): first particle as differences, and how far behind it the second is; ``steps`` (2, frames, m):
    numbers of steps of the ladder, of stretch and of crushing, as differences in time; ``corrections`` (signs x cores,
    frames, m): likewise, see the module.
    """
    bonds = lay_bonds(motion.position[0].astype(float), run.config.question.analysis.link_length * motion.grid_spacing)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    pairs = np.sort(rank[bonds.pairs], axis=1)
    by_place = np.lexsort((pairs[:, 1], pairs[:, 0]))
    first, second = pairs[by_place].T
    steps, corrections = [], []
    for history in _list_histories(motion, bonds, frames):
        steps.append([_find_steps(strain, settings)[by_place] for strain in (history.stretch, -history.crush)])
        corrections.append(_find_corrections(pairs, by_place, len(order), history, settings))
    return {
        "count": len(pairs),
        "pairs": pack(np.stack([take_differences(first), second - first])),
        "steps": pack(take_differences(np.array(steps, dtype=np.uint8)).swapaxes(0, 1)),
        "corrections": pack(take_differences(np.array(corrections, dtype=np.uint8)).swapaxes(0, 1)),
    }


def _list_histories(motion: Motion, bonds: Bonds, frames: Sequence[int]) -> list[BondHistory]:
    """List the strains of all bonds up to each of ``frames``; every stored frame counts."""
    extremes, histories = Extremes(bonds), []
    for frame, position in zip(motion.frames.tolist(), motion.position, strict=True):
        extremes.extend(position)
        if frame in frames:
            histories.append(extremes.to_history())
    return histories


def _find_steps(strain: np.ndarray, settings: ViewerSettings) -> np.ndarray:
    """Find the first step of the ladder that is not below each strain; the number of steps if none is."""
    return np.searchsorted(settings.ladder, strain)


def _find_corrections(
    pairs: np.ndarray, by_place: np.ndarray, count: int, history: BondHistory, settings: ViewerSettings
) -> list[np.ndarray]:
    """Compute the corrections, modulo 256: (m,) for each sign and core rule.

    A correction is the step from which on a bond holds, less the one that follows from steps alone.
    """
    corrections = []
    for sign in settings.signs:
        strain = history.strain(sign)
        steps = _find_steps(strain, settings)
        if not steps.any():  # nothing has strained: all bonds hold from the first step on
            corrections += [np.zeros(len(pairs), dtype=int)] * len(settings.cores)
            continue
        exact = sort_by_particle(pairs, strain, count)
        rough = sort_by_particle(pairs[by_place], steps[by_place], count)
        corrections += [
            (
                _find_steps(_find_holding_strains(exact, core), settings)[by_place]
                - _find_holding_strains(rough, core).astype(int)
            )
            % 256
            for core in settings.cores
        ]
    return corrections


def _find_holding_strains(halves: HalfBonds, core_fraction: float) -> np.ndarray:
    """Find the strain from which on each bond holds two particles together."""
    return find_holding_strain(halves, find_core_strain(halves, core_fraction))
