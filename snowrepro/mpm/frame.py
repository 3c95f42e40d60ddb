"""The end of a frame: what the ledger says of it, the state of the particles, and why a run ends there."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..errors import Diverged
from ..laws.quantity import Quantity
from ..settings.case import Case
from .constants import Constants
from .copies import FIRST_TOTAL, STATUS, UNDER_WAY, copy_outcomes
from .indenter import Place
from .ledger import TOTALS
from .state import RUNNING, TOO_MANY_SUBSTEPS, Ledger

Read = Callable[[str], np.ndarray]  # a copy of one quantity of a case's particles by name, shape (n, *shape)


class State(Protocol):
    """The particles of a case: the fields themselves, or a copy of them."""

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """What the particles have."""

    def read(self, name: str) -> np.ndarray:
        """A copy of one quantity, shape (n, *shape)."""


@dataclass(frozen=True)
class Outcome:
    """What the ledger says of a case's frame; lengths in the reading's unit, times in seconds.

    ``particle``: the first that is at fault; ``totals``: of TOTALS, what energy and momentum come to.
    """

    status: int
    particle: int
    under_way: bool
    substeps: int
    ended_inside: int
    elapsed: float
    smallest_step: float
    top_speed2: float
    totals: dict[str, float]


def read_outcomes(ledger: Ledger) -> list[Outcome]:
    """Read what the ledger says of each case."""
    return [make_outcome(row) for row in read_ledger(ledger).tolist()]


def read_ledger(ledger: Ledger) -> np.ndarray:
    """Read what the ledger says of each case, as a row of numbers: the fields of Outcome, then TOTALS."""
    values = np.empty((ledger.cases.number, FIRST_TOTAL + len(TOTALS)))
    copy_outcomes(ledger, values)
    return values


def is_over(rows: np.ndarray) -> np.ndarray:
    """Whether the frame has come to its end, or failed, of each case whose row ``read_ledger`` gives."""
    return (rows[:, STATUS] != RUNNING) | (rows[:, UNDER_WAY] == 0)


def make_outcome(row: list[float]) -> Outcome:
    """An outcome from its row of numbers."""
    status, particle, under_way, substeps, ended_inside, elapsed, smallest_step, top_speed2, *totals = row
    return Outcome(
        int(status),
        int(particle),
        bool(under_way),
        int(substeps),
        int(ended_inside),
        elapsed,
        smallest_step,
        top_speed2,
        dict(zip(TOTALS, totals, strict=True)),
    )


@dataclass(frozen=True)
class Indentation:
    """The indenter at the end of a frame: its place (none yet), depth below first touch, and the upward force on it."""

    place: Place | None
    depth: float
    force: float


@dataclass(frozen=True)
class Frame:
    """A run at the end of one frame.

    ``outcome``: what the ledger says; ``test``: of the indenter, if there is one.
    """

    number: int
    outcome: Outcome
    particles: State
    test: Indentation | None = None

    def read(self, name: str) -> np.ndarray:
        """A copy of one quantity of the particles, shape (n, *shape)."""
        return self.particles.read(name)

    def checkpoint(self) -> dict[str, np.ndarray]:
        """All that the next frames depend on, for ``frames`` to go on from."""
        whole = {quantity.name: self.read(quantity.name) for quantity in self.particles.quantities}
        place = self.test.place if self.test else None
        test = {"test_place": np.array([place.x, place.touch, place.vice])} if place else {}
        return {**whole, **test, "frame": np.array(self.number), "top_speed2": np.array(self.outcome.top_speed2)}


def check_frame(outcome: Outcome, read: Read, case: Case, constants: Constants, frame: int) -> None:
    """Raise Diverged if a frame of a case did not end well; ``outcome.particle`` counts from the case's first."""
    check_outcome(outcome, read, constants, frame)
    check_volume(read, case, frame)


def check_outcome(outcome: Outcome, read: Read, constants: Constants, frame: int) -> None:
    """Raise Diverged if the frame did not come to its end."""
    if outcome.status == RUNNING:
        return
    time = (frame - 1) * constants.frame_time + outcome.elapsed
    where = f"in frame {frame} at t = {time:.4g} s"
    if outcome.status == TOO_MANY_SUBSTEPS:
        raise Diverged(
            f"diverged {where}: the time step fell to {outcome.smallest_step:.2g} s, "
            f"with which a frame of {constants.frame_time:g} s needs more than {constants.max_substeps} substeps",
            frame,
        )
    x, y = read("position")[outcome.particle]
    cause = _find_cause(outcome.particle, read)
    raise Diverged(f"diverged {where}: particle {outcome.particle} at ({x:.4g}, {y:.4g}) {cause}", frame)


def _find_cause(p: int, read: Read) -> str:
    """What is wrong with particle p."""
    wave_speed2, poisson = read("wave_speed2")[p], read("poisson")[p]
    if not wave_speed2 > 0.0 or not np.isfinite(wave_speed2):
        return "has a strain that is inverted or not finite"
    if not poisson < 0.5:
        return f"has a Poisson's ratio of {poisson:.3g}, which must stay below 0.5"
    return "left the grid"


def check_volume(read: Read, case: Case, frame: int) -> None:
    """Raise Diverged if many particles are crushed to the lowest J_P: they are no longer followed.

    The upper bound is that of loose powder, whose stiffness Eq. 1 has long taken away.
    """
    low, _ = case.reading.plastic_volume
    part = float((read("J_P") <= low).mean())
    if part > case.solver.max_bounded:
        raise Diverged(
            f"diverged in frame {frame} at t = {frame * case.loading.frame_time:.4g} s: {part:.0%} of the particles "
            f"are crushed to the lowest J_P, {low:g}, beyond which the law does not describe snow",
            frame,
        )
