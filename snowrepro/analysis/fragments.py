"""The fragments that a body broke into, in one frame and from frame to frame."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from .motion import AXES, Motion
from .states import STATES

ROUND_OFF = 1e-12  # of a sum of masses


@dataclass(frozen=True)
class Fragments:
    """The fragments of a body in one frame.

    ``label`` (n,): fragment of each particle, 0 the heaviest; ``mass`` (k,): of each fragment, falling, without what
    is crushed or loose in it; ``is_lump`` (k,): whether it is heavy enough to be a lump; ``states`` (n, 3): which part
    of each particle is lump, crushed and loose, nothing for one that has vanished; ``particle_mass`` (n,), and
    ``body_mass`` of all; ``broken``: part of the bonds that broke; ``vanished``: part of the mass that is no longer
    there.
    ``id`` (k,): a number that the heaviest heir of a fragment inherits from frame to frame; ``parent`` (k,): the id of
    the fragment in the frame before that holds most of its mass, -1 in the first frame.
    """

    frame: int
    label: np.ndarray
    mass: np.ndarray
    is_lump: np.ndarray
    states: np.ndarray
    particle_mass: np.ndarray
    body_mass: float
    broken: float
    vanished: float
    id: np.ndarray
    parent: np.ndarray

    @property
    def lump_fraction(self) -> float:
        """Part of the mass that is in lumps."""
        return float(self.mass[self.is_lump].sum() / self.body_mass)

    @property
    def crushed_fraction(self) -> float:
        """Part of the mass that was compacted where it lies, and is in no lump."""
        return self._sum_share(1)

    @property
    def loose_fraction(self) -> float:
        """Part of the mass that came apart."""
        return self._sum_share(2)

    def _sum_share(self, state: int) -> float:
        """Sum the part of the mass in one of STATES: by a plain sum, as BLAS's hangs on how many threads it has."""
        return float((self.particle_mass * self.states[:, state]).sum() / self.body_mass)

    @property
    def shares(self) -> dict[str, float]:
        """The part of the mass in each of STATES, by its name."""
        return dict(zip(STATES, (self.lump_fraction, self.crushed_fraction, self.loose_fraction), strict=True))

    @property
    def powder_fraction(self) -> float:
        """Part of the mass that is there and in no lump: crushed or loose."""
        return 1.0 - self.lump_fraction - self.vanished

    @property
    def largest_state(self) -> np.ndarray:
        """The place in STATES of the largest part of each particle (n,), uint8; loose for one that has vanished."""
        is_there = self.states.any(axis=1)
        return np.where(is_there, self.states.argmax(axis=1), STATES.index("loose")).astype(np.uint8)

    @property
    def lumps(self) -> int:
        """Number of lumps."""
        return int(self.is_lump.sum())

    @property
    def largest(self) -> float:
        """Part of the mass that is in the heaviest fragment."""
        return float(self.mass[0] / self.body_mass)

    @property
    def joined_chance(self) -> float:
        """The chance S = sum (m_i / M)^2 that two random bits of snow are still joined."""
        return float(((self.mass / self.body_mass) ** 2).sum())

    @property
    def effective_number(self) -> float:
        """The number of equal fragments in which two random bits would be joined as often: 1 / S; infinite for none."""
        return 1.0 / self.joined_chance if self.joined_chance > 0 else float("inf")

    @property
    def second_moment(self) -> float:
        """The sum of (m_i / M)^2 without the heaviest fragment: greatest where one body turns into many."""
        return self.joined_chance - self.largest**2

    @property
    def median_mass(self) -> float:
        """The mass, as part of the body, that half of the mass is in fragments at least as heavy as; 0 for less."""
        below = np.cumsum(self.mass) / self.body_mass
        place = int(np.searchsorted(below, 0.5 - ROUND_OFF))
        return float(self.mass[place] / self.body_mass) if place < len(self.mass) else 0.0

    def survival(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the masses of the fragments and the part of the mass in fragments of at least that mass, both (k,).

        Masses fall, and are parts of the body's.
        """
        return self.mass / self.body_mass, np.cumsum(self.mass) / self.body_mass


def make_fragments(
    frame: int,
    component: np.ndarray,
    whole: np.ndarray,
    loose: np.ndarray,
    motion: Motion,
    least: float,
    broken: float = float("nan"),
) -> Fragments:
    """Make the fragments of a frame from the component of each particle (n,), any whole numbers.

    ``whole`` (n,): part of each particle that is in a lump if its fragment is one; ``loose`` (n,): part that is loose,
    as far as it is in no lump; ``least``: the least mass of a lump; ``broken``: part of the bonds that broke.  A
    particle that has vanished is a fragment by itself and in no state.
    """
    gone = motion.vanished[motion.index(frame)]
    if gone.any():
        component = np.where(gone, component.max() + 1 + np.cumsum(gone), component)
    label, mass = _sort_by_mass(component, motion.mass * np.where(gone, 0.0, whole))
    is_lump = mass >= least * (1 - ROUND_OFF)
    lump = np.where(gone, 0.0, whole) * is_lump[label]
    apart = np.minimum(loose, 1.0 - lump)
    states = np.stack([lump, 1.0 - lump - apart, apart], axis=1) * ~gone[:, None]
    vanished = float(motion.mass[gone].sum() / motion.mass.sum())
    number = np.arange(len(mass))
    first = np.full(len(mass), -1)
    body_mass = float(np.bincount(label, motion.mass).sum())  # in the order in which fragments are summed
    return Fragments(frame, label, mass, is_lump, states, motion.mass, body_mass, broken, vanished, number, first)


def trace_ancestry(history: Sequence[Fragments], mass: np.ndarray) -> list[Fragments]:
    """Return the same fragments, frame by frame, with parents and with ids that last from frame to frame.

    ``mass`` (n,): of the particles.  The parent of a fragment held most of its mass; of a parent's heirs the heaviest
    inherits its id, the others get new ones, rising with falling mass.
    """
    with_ids = [history[0]] if history else []
    unused = len(history[0].mass) if history else 0
    for now in history[1:]:
        before = with_ids[-1]
        size = len(now.mass)
        pair, inverse = np.unique(before.label * size + now.label, return_inverse=True)
        shared = np.bincount(inverse, weights=mass)
        old, new = np.divmod(pair, size)
        largest_first = np.lexsort((old, -shared, new))
        _, first = np.unique(new[largest_first], return_index=True)
        parent = old[largest_first][first]  # (k,): of each new fragment
        part = shared[largest_first][first]
        heir_first = np.lexsort((np.arange(size), -part, parent))
        _, first = np.unique(parent[heir_first], return_index=True)
        heirs = heir_first[first]
        names = np.full(size, -1)
        names[heirs] = before.id[parent[heirs]]
        new_ones = np.flatnonzero(names < 0)
        names[new_ones] = unused + np.arange(len(new_ones))
        unused += len(new_ones)
        with_ids.append(replace(now, id=names, parent=before.id[parent]))
    return with_ids


def tabulate_fragments(fragments: Fragments, motion: Motion) -> pd.DataFrame:
    """Tabulate the fragments that are there, a row each: frame, id, parent, mass, place, size and motion.

    Centre, extent (of the box around it) and velocity along each axis, in the units of the data; gyration: root of the
    mean squared distance from the centre; spin: angular velocity about it [1/time], counter-clockwise, in 3D a
    vector; NaN where one place has no turning.
    """
    index = motion.index(fragments.frame)
    here = ~motion.vanished[index]
    label, mass = fragments.label[here], motion.mass[here]
    places = motion.position[index][here].astype(float)
    velocities = motion.velocities(index)[here]
    size = len(fragments.mass)
    total = np.bincount(label, weights=mass, minlength=size)
    not_empty = np.flatnonzero(total > 0)

    def mean(values: np.ndarray) -> np.ndarray:
        """Return the mass-weighted mean of values (n,) by fragment (k,)."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.bincount(label, weights=mass * values, minlength=size) / total

    centre = np.stack([mean(values) for values in places.T], axis=1)
    velocity = np.stack([mean(values) for values in velocities.T], axis=1)
    arm, relative = places - centre[label], velocities - velocity[label]
    extent = _find_extents(places, label, size)
    columns: dict[str, np.ndarray] = {
        "frame": np.full(size, fragments.frame),
        "id": fragments.id,
        "parent": fragments.parent,
        "is_lump": fragments.is_lump,
        "particles": np.bincount(label, minlength=size),
        "mass": total,
        **{name: mean(part) for name, part in zip(STATES, fragments.states[here].T, strict=True)},
    }
    names = motion.axes[: motion.dimensions]
    for name, values in (("centre", centre), ("extent", extent), ("velocity", velocity)):
        columns |= {f"{name}_{axis}": values[:, d] for d, axis in enumerate(names)}
    columns["gyration"] = np.sqrt(mean((arm**2).sum(axis=1)))
    columns |= _find_spins(arm, relative, mean)
    return pd.DataFrame(columns).iloc[not_empty].reset_index(drop=True)


def _find_spins(
    arm: np.ndarray, relative: np.ndarray, mean: Callable[[np.ndarray], np.ndarray]
) -> dict[str, np.ndarray]:
    """Find the angular velocity (k,) that has each fragment's angular momentum about its centre, by column name.

    ``arm``, ``relative`` (n, 2 or 3): places and velocities from those of the fragment's centre; ``mean``: by fragment.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        if arm.shape[1] == 2:
            turning = mean(arm[:, 0] * relative[:, 1] - arm[:, 1] * relative[:, 0])
            return {"spin": turning / mean((arm**2).sum(axis=1))}
        turning = np.stack([mean(values) for values in np.cross(arm, relative).T], axis=1)
        square = np.stack([[mean(arm[:, i] * arm[:, j]) for j in range(3)] for i in range(3)])
        inertia = np.eye(3)[:, :, None] * np.trace(square) - square
        spin = np.einsum("kij,kj->ki", np.linalg.pinv(np.nan_to_num(inertia.transpose(2, 0, 1))), turning)
        return {f"spin_{axis}": spin[:, d] for d, axis in enumerate(AXES)}


def _find_extents(places: np.ndarray, label: np.ndarray, size: int) -> np.ndarray:
    """Find the sides of the box around each fragment, (k, 2 or 3); NaN for a fragment without a particle."""
    order = np.argsort(label, kind="stable")
    present, first = np.unique(label[order], return_index=True)
    sides = np.maximum.reduceat(places[order], first) - np.minimum.reduceat(places[order], first)
    extent = np.full((size, places.shape[1]), np.nan)
    extent[present] = sides
    return extent


def _sort_by_mass(component: np.ndarray, mass: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Number components by falling mass: the number of each particle (n,), and the mass of each component (k,).

    Of equal masses the one with the first particle comes first.
    """
    _, first, inverse = np.unique(component, return_index=True, return_inverse=True)
    total = np.bincount(inverse, weights=mass)
    order = np.lexsort((first, -total))
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return rank[inverse], total[order]
