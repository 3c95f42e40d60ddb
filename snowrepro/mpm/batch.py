"""Many cases in one launch: each goes through its own frames, to the bits that it has alone or in any company.

What the kernels are compiled for (``Constants``) has to be the same for all: pressure, snow shape, floor, sintering,
gravity and heights may differ.  ``Batch`` is what stands on the device; a ``Follower`` of each case makes frames of
what comes from there, and works out what it needs for the next: it may be in another process.  What the device tells of
particles, and the forces that it is given, stand in one table that both see; each case has places of its own in it.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import ConfigError
from ..laws.quantity import Quantity
from ..scene.build import Scene
from ..settings.batch import require_fit_for_batch
from ..settings.case import Case
from . import parallel, state
from .cases import LANES, Cases
from .constants import Constants, make_constants
from .copies import Selection, copy_slots_in, copy_slots_out
from .frame import Frame, Outcome, check_frame, is_over, make_outcome, read_ledger, read_outcomes
from .solver import find_released, is_pressed, is_release, make_orders, make_pressing_force, start_taichi

# What a frame's end is described by: what moves, and what only sintering changes.  The rest is read when asked for.
MOVING = ("position", "velocity", "J_P", "factor", "von_mises")
SINTERED = ("density", "young", "poisson", "hardening")
UNCHANGED = (*SINTERED, "force", "mass")  # is as it was in the frame before, unless it is read anew

Checkpoint = Mapping[str, np.ndarray]
Values = dict[str, np.ndarray]  # quantities of a case's particles by name, each (n, *shape)


@dataclass(frozen=True)
class Block:
    """Where some quantities of a case's particles stand in a table, side by side in ``width`` columns.

    ``first``: the number of the table that it begins with; ``count``: of particles.
    """

    names: tuple[str, ...]
    first: int
    count: int
    width: int

    def view(self, table: np.ndarray) -> np.ndarray:
        """Its part of a table, shape (count, width)."""
        return table[self.first : self.first + self.count * self.width].reshape(self.count, self.width)


@dataclass(frozen=True)
class FrameReport:
    """What the device says of a case's frame: its number, outcome, and where that stands which may have changed.

    ``is_start``: it is where the case begins, and was not computed.
    """

    number: int
    outcome: Outcome
    blocks: tuple[Block, ...] = ()
    is_start: bool = False


@dataclass
class _Snapshot:
    """Copies of particle quantities of one case; ``read`` fetches what is not there, until the case goes on."""

    quantities: tuple[Quantity, ...]
    values: Values
    fetch: Callable[[], Values]

    def read(self, name: str) -> np.ndarray:
        """A copy of one quantity, shape (n, *shape)."""
        if name not in self.values:
            self.values |= self.fetch()
        return self.values[name].copy()


class Follower:
    """A case of a batch as the process sees it that makes a run of it.

    ``table``: where the device tells of particles; ``force``: where in it that of the next frame belongs; ``fetch``
    copies all quantities of the case from the device, for as long as the case waits there.
    """

    def __init__(self, case: Case, scene: Scene, table: np.ndarray, force: Block, fetch: Callable[[], Values]) -> None:
        self.case, self.scene, self.table, self.force, self.fetch = case, scene, table, force.view(table), fetch
        self.constants = make_constants(case)
        self.quantities = state.list_quantities(case)
        self.shapes = {quantity.name: quantity.shape for quantity in self.quantities}
        self.real = np.float32 if case.solver.precision == "f32" else np.float64
        self.known: Values = {}
        self.number = -1

    def take(self, report: FrameReport) -> Frame:
        """The frame that the device tells of.  Raises Diverged where it did not end well."""
        unchanged = {name: self.known[name] for name in UNCHANGED if name in self.known}
        self.known, self.number = self.fetch() if report.is_start else unchanged, report.number
        for block in report.blocks:
            self.known |= split(block.view(self.table), block.names, self.shapes)
        frame = Frame(report.number, report.outcome, _Snapshot(self.quantities, dict(self.known), self.fetch))
        if not report.is_start:
            check_frame(frame.outcome, frame.read, self.case, self.constants, report.number)
        return frame

    def press(self) -> None:
        """Put the external force of the case's next frame, where there is one, into its place."""
        number = self.number + 1
        if is_pressed(self.case, number):
            self.force[:] = make_pressing_force(self.case, self.scene, self.known["position"], number)
            self.known["force"] = self.force.astype(self.real).astype(float, copy=False)  # as the device keeps it
        elif is_release(self.case, number):
            self.known["force"] = np.zeros_like(self.known["force"])


def split(values: np.ndarray, names: Sequence[str], shapes: Mapping[str, tuple[int, ...]]) -> Values:
    """A copy of each of the quantities, shape (n, *shape), that stand side by side in ``values`` (n, width)."""
    widths = [math.prod(shapes[name]) for name in names]
    parts = np.split(values, np.cumsum(widths[:-1]), axis=1)
    return {name: part.reshape(-1, *shapes[name]).copy() for name, part in zip(names, parts, strict=True)}


@dataclass
class _Member:
    """A case on the device: its frame's number, whether it sinters in it, and whether it waits to be told to go on."""

    case: Case
    number: int = 0
    sinters: bool = False
    waits: bool = True


class Batch:
    """Cases side by side on one device.

    ``start`` tells where each begins, ``begin`` lets cases begin their next frames, ``launch`` computes a few substeps
    of all that are in one, and ``collect`` tells of the frames that have ended.
    """

    def __init__(
        self,
        cases: Sequence[Case],
        scenes: Sequence[Scene],
        resumes: Sequence[Checkpoint | None],
        threads: int = 1,
        make_table: Callable[[int], np.ndarray] = np.empty,
    ) -> None:
        """Put the cases in their place, each from its checkpoint on where it has one.

        ``make_table`` makes the table, of so many numbers.  Raises ConfigError where cases are not of a kind, or cannot
        be computed side by side.
        """
        self.constants = require_one_kind(cases)
        start_taichi(cases[0].solver, threads)
        self.members = [_Member(case) for case in cases]
        self.places = Cases([len(s.positions) for s in scenes], [s.node_distance.shape for s in scenes])
        lanes = LANES if cases[0].solver.device == "cpu" else 1
        self.particles = state.Particles(self.places.slots, self.constants.material.STATE, lanes)
        self.nodes = state.Nodes(*_put_side_by_side(scenes, self.places), self.constants.summation == "fixed_point")
        self.ledger = state.Ledger(self.places, by_threads=True)
        own = [quantity.name for quantity in self.constants.material.STATE if quantity.stored]
        self.whole = Selection(self.particles, [quantity.name for quantity in self.particles.quantities])
        self.moving = Selection(self.particles, (*MOVING, *own))
        self.sintered = Selection(self.particles, SINTERED)
        self.force = Selection(self.particles, ("force",))
        self.released = Selection(self.particles, find_released(cases[0]))
        ends = self.places.slots * np.cumsum([0, self.moving.width, self.sintered.width, self.force.width])
        self.firsts = dict(zip((self.moving, self.sintered, self.force), ends[:-1].tolist(), strict=True))
        self.table = make_table(int(ends[-1]))
        self._fill(scenes, resumes)

    def _fill(self, scenes: Sequence[Scene], resumes: Sequence[Checkpoint | None]) -> None:
        """Give each case its first values, or those of its checkpoint."""
        quantities = self.particles.quantities
        for i, (member, scene) in enumerate(zip(self.members, scenes, strict=True)):
            self._write_case(i, state.make_first_values(quantities, scene, member.case.material))
        if self.members[0].case.reading.initial_volume == "grid_density":
            parallel.find_volumes(self.particles, self.nodes, self.ledger, self.constants)
        for i, resume in enumerate(resumes):
            if resume:
                self._write_case(i, resume)
                self.members[i].number = int(resume["frame"])
                self.ledger.top_speed2[i] = float(resume["top_speed2"])

    def start(self) -> dict[int, FrameReport]:
        """Where each case begins: frame 0, or the frame of its checkpoint."""
        outcomes = read_outcomes(self.ledger)
        return {i: FrameReport(m.number, outcomes[i], is_start=True) for i, m in enumerate(self.members)}

    def begin(self, chosen: Sequence[int]) -> None:
        """Begin the next frame of some cases, each with the external force that its ``Follower.press`` put down."""
        if not chosen:
            return
        orders = np.zeros((len(self.members), 3))
        for i in chosen:
            member = self.members[i]
            member.number, member.waits = member.number + 1, False
            orders[i] = acting = make_orders(member.case, member.number)
            member.sinters = acting.sinters
        self._release([i for i in chosen if is_release(self.members[i].case, self.members[i].number)])
        self._take_forces([i for i in chosen if is_pressed(self.members[i].case, self.members[i].number)])
        parallel.begin(self.particles, self.nodes, self.ledger, self.constants, self._mark(chosen), orders)

    def _release(self, chosen: Sequence[int]) -> None:
        """Take the external force from cases, and what else becomes zero at the release."""
        for first, last in self.places.find_spans(chosen):
            zeros = np.zeros((last - first, self.released.width))
            copy_slots_in(self.released, self.places, zeros, first, last)

    def _take_forces(self, chosen: Sequence[int]) -> None:
        """Give the device the external forces of cases."""
        for first, last in self.places.find_spans(chosen):
            copy_slots_in(self.force, self.places, self._view(self.force, first, last), first, last)

    def launch(self) -> None:
        """Have the device compute a few substeps of all cases that are in a frame; it may still be at it afterwards."""
        if self.is_under_way():
            parallel.advance_substeps(self.particles, self.nodes, self.ledger, self.constants)

    def collect(self) -> dict[int, FrameReport]:
        """Wait for the device; tell of the cases whose frame has ended, or failed."""
        ended = is_over(read_ledger(self.ledger)).tolist()
        over = [i for i, member in enumerate(self.members) if ended[i] and not member.waits]
        if not over:
            return {}
        parallel.end(self.particles, self.nodes, self.ledger, self.constants, self._mark(over))
        self._tell(self.moving, over)
        self._tell(self.sintered, [i for i in over if self.members[i].sinters])
        rows = read_ledger(self.ledger)
        return {i: self._report(i, make_outcome(rows[i].tolist())) for i in over}

    def _tell(self, selection: Selection, chosen: Sequence[int]) -> None:
        """Copy a selection of the quantities of cases to their places in the table."""
        for first, last in self.places.find_spans(chosen):
            copy_slots_out(selection, self._view(selection, first, last), first, last)

    def _report(self, i: int, outcome: Outcome) -> FrameReport:
        """What is to be said of a case whose frame has ended; it waits from now on."""
        member = self.members[i]
        member.waits = True
        told = (self.moving, self.sintered) if member.sinters else (self.moving,)
        own = dataclasses.replace(outcome, particle=outcome.particle - self.places.first_slots[i])
        return FrameReport(member.number, own, tuple(self.place_block(selection, i) for selection in told))

    def is_under_way(self) -> bool:
        """Whether any case has begun a frame and not ended it."""
        return any(not member.waits for member in self.members)

    def place_block(self, selection: Selection, i: int) -> Block:
        """Where a selection of the quantities of a case stands in the table."""
        first = self.firsts[selection] + self.places.first_slots[i] * selection.width
        return Block(tuple(selection.places), first, self.places.counts[i], selection.width)

    def read_case(self, i: int) -> Values:
        """Copy all quantities of one case, by name."""
        first, count = self.places.first_slots[i], self.places.counts[i]
        values = np.empty((count, self.whole.width))
        copy_slots_out(self.whole, values, first, first + count)
        return split(values, [*self.whole.places], self.whole.shapes)

    def _write_case(self, i: int, given: Mapping[str, np.ndarray]) -> None:
        """Set all quantities of one case, by name."""
        count = self.places.counts[i]
        columns = [np.asarray(given[name], dtype=float).reshape(count, -1) for name in self.whole.places]
        slots = self.places.first_slots[i : i + 2]
        copy_slots_in(self.whole, self.places, np.ascontiguousarray(np.concatenate(columns, axis=1)), *slots)

    def _view(self, selection: Selection, first: int, last: int) -> np.ndarray:
        """What the table holds of a selection, of the slots from ``first`` on and before ``last``, a row each."""
        start, width = self.firsts[selection], selection.width
        return self.table[start + first * width : start + last * width].reshape(-1, width)

    def _mark(self, chosen: Sequence[int]) -> np.ndarray:
        """One for each of the chosen cases, zero for the others."""
        marks = np.zeros(len(self.members), dtype=np.int32)
        marks[list(chosen)] = 1
        return marks


def require_one_kind(cases: Sequence[Case]) -> Constants:
    """The constants that the kernels are compiled for.  Raises ConfigError where cases differ in these."""
    for case in cases:
        require_fit_for_batch(case)
    first, *others = map(kind_of, cases)
    if any(other != first for other in others):
        raise ConfigError("the cases of a batch differ in what the solver is compiled for")
    return first[0]


def kind_of(case: Case) -> tuple[Constants, str, str, str, str]:
    """What the cases of a batch have in common: constants, device, precision, first volume, what the release stops."""
    reading, solver = case.reading, case.solver
    return make_constants(case), solver.device, solver.precision, reading.initial_volume, reading.release


def _put_side_by_side(scenes: Sequence[Scene], places: Cases) -> tuple[np.ndarray, np.ndarray]:
    """Signed distance (wide, tall) and normal (wide, tall, 2) of the floors, each in its columns."""
    distance, normal = np.zeros(places.grid), np.zeros((*places.grid, 2))
    for scene, left, right in zip(scenes, places.first_columns, places.first_columns[1:], strict=False):
        tall = scene.node_distance.shape[1]
        distance[left:right, :tall] = scene.node_distance
        normal[left:right, :tall] = scene.node_normal
    return distance, normal
