"""Many cases in one launch: each goes through its own frames, to the bits that it has alone or in any company.

What the kernels are compiled for (``Constants``) has to be the same for all: pressure, snow shape, floor, sintering,
gravity and heights may differ.  ``Batch`` is what stands on the device; a ``Follower`` of each case makes frames of
what comes from there, and works out what it needs for the next: it may be in another process.
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
from .copies import Selection, copy_cases_in, copy_cases_out
from .frame import Frame, Outcome, check_frame, read_outcomes
from .solver import find_released, is_pressed, is_release, make_orders, make_pressing_force, start_taichi

# What a frame's end is described by: what moves, and what only sintering changes.  The rest is read when asked for.
MOVING = ("position", "velocity", "J_P", "factor", "von_mises")
SINTERED = ("density", "young", "poisson", "hardening")
UNCHANGED = (*SINTERED, "force", "mass")  # is as it was in the frame before, unless it is read anew

Checkpoint = Mapping[str, np.ndarray]
Values = dict[str, np.ndarray]  # quantities of a case's particles by name, each (n, *shape)


@dataclass(frozen=True)
class Block:
    """Some quantities of a case's particles, side by side in the columns of ``values`` (n, width)."""

    names: tuple[str, ...]
    values: np.ndarray

    def split(self, shapes: Mapping[str, tuple[int, ...]]) -> Values:
        """A copy of each quantity, shape (n, *shape)."""
        widths = [math.prod(shapes[name]) for name in self.names]
        parts = np.split(self.values, np.cumsum(widths[:-1]), axis=1)
        return {name: part.reshape(-1, *shapes[name]).copy() for name, part in zip(self.names, parts, strict=True)}


@dataclass(frozen=True)
class FrameReport:
    """What the device says of a case's frame: its number, outcome, and what may have changed of its particles.

    ``is_start``: it is where the case begins, and was not computed.
    """

    number: int
    outcome: Outcome
    blocks: tuple[Block, ...]
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

    ``fetch`` copies all quantities of the case from the device, for as long as the case waits there.
    """

    def __init__(self, case: Case, scene: Scene, fetch: Callable[[], Values]) -> None:
        self.case, self.scene, self.fetch = case, scene, fetch
        self.constants = make_constants(case)
        self.quantities = state.list_quantities(case)
        self.shapes = {quantity.name: quantity.shape for quantity in self.quantities}
        self.real = np.float32 if case.solver.precision == "f32" else np.float64
        self.known: Values = {}
        self.number = -1

    def take(self, report: FrameReport) -> Frame:
        """The frame that the device tells of.  Raises Diverged where it did not end well."""
        unchanged = {name: self.known[name] for name in UNCHANGED if name in self.known}
        self.known, self.number = unchanged, report.number
        for block in report.blocks:
            self.known |= block.split(self.shapes)
        frame = Frame(report.number, report.outcome, _Snapshot(self.quantities, dict(self.known), self.fetch))
        if not report.is_start:
            check_frame(frame.outcome, frame.read, self.case, self.constants, report.number)
        return frame

    def press(self) -> np.ndarray | None:
        """The external force in the case's next frame (n, 2); None where there is none, or it is as before."""
        number = self.number + 1
        if is_pressed(self.case, number):
            force = make_pressing_force(self.case, self.scene, self.known["position"], number)
            self.known["force"] = force.astype(self.real).astype(float)  # as the device keeps it
            return force
        if is_release(self.case, number):
            self.known["force"] = np.zeros_like(self.known["force"])
        return None


@dataclass
class _Member:
    """A case on the device: its frame's number, and whether it waits to be told to go on."""

    case: Case
    number: int = 0
    waits: bool = True


class Batch:
    """Cases side by side on one device.

    ``start`` tells where each begins, ``begin`` lets cases begin their next frames, ``launch`` computes a few substeps
    of all that are in one, and ``collect`` tells of the frames that have ended.
    """

    def __init__(
        self, cases: Sequence[Case], scenes: Sequence[Scene], resumes: Sequence[Checkpoint | None], threads: int = 1
    ) -> None:
        """Put the cases in their place, each from its checkpoint on where it has one.

        Raises ConfigError where they are not of a kind, or cannot be computed side by side.
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
        self._fill(scenes, resumes)

    def _fill(self, scenes: Sequence[Scene], resumes: Sequence[Checkpoint | None]) -> None:
        """Give each case its first values, or those of its checkpoint."""
        quantities = self.particles.quantities
        for i, (member, scene) in enumerate(zip(self.members, scenes, strict=True)):
            self._write(self.whole, {i: state.make_first_values(quantities, scene, member.case.material)})
        if self.members[0].case.reading.initial_volume == "grid_density":
            parallel.find_volumes(self.particles, self.nodes, self.ledger, self.constants)
        for i, resume in enumerate(resumes):
            if resume:
                self._write(self.whole, {i: resume})
                self.members[i].number = int(resume["frame"])
                self.ledger.top_speed2[i] = float(resume["top_speed2"])

    def start(self) -> dict[int, FrameReport]:
        """Where each case begins, with all its quantities: frame 0, or the frame of its checkpoint."""
        outcomes = read_outcomes(self.ledger)
        return {
            i: FrameReport(member.number, outcomes[i], (self._read(self.whole, [i])[i],), is_start=True)
            for i, member in enumerate(self.members)
        }

    def begin(self, forces: Mapping[int, np.ndarray | None]) -> None:
        """Begin the next frame of some cases, each with the external force of its ``Follower.press``."""
        if not forces:
            return
        orders = np.zeros((len(self.members), 3))
        for i in forces:
            member = self.members[i]
            member.number, member.waits = member.number + 1, False
            orders[i] = make_orders(member.case, member.number)
        self._release([i for i in forces if is_release(self.members[i].case, self.members[i].number)])
        self._write(self.force, {i: {"force": force} for i, force in forces.items() if force is not None})
        parallel.begin(self.particles, self.nodes, self.ledger, self.constants, self._mark([*forces]), orders)

    def _release(self, chosen: Sequence[int]) -> None:
        """Take the external force from cases, and what else becomes zero at the release."""
        shapes = self.released.shapes
        zeros = {i: {name: np.zeros((self.places.counts[i], *shapes[name])) for name in shapes} for i in chosen}
        self._write(self.released, zeros)

    def launch(self) -> None:
        """Have the device compute a few substeps of all cases that are in a frame; it may still be at it afterwards."""
        if self.is_under_way():
            parallel.advance_substeps(self.particles, self.nodes, self.ledger, self.constants)

    def collect(self) -> dict[int, FrameReport]:
        """Wait for the device; tell of the cases whose frame has ended, or failed."""
        outcomes = read_outcomes(self.ledger)
        over = [i for i, member in enumerate(self.members) if not member.waits and outcomes[i].is_over]
        if not over:
            return {}
        parallel.end(self.particles, self.nodes, self.ledger, self.constants, self._mark(over))
        outcomes = read_outcomes(self.ledger)
        moved = self._read(self.moving, over)
        sintered = self._read(self.sintered, [i for i in over if self._sinters(i)])
        for i in over:
            self.members[i].waits = True
        return {
            i: FrameReport(
                self.members[i].number,
                dataclasses.replace(outcomes[i], particle=outcomes[i].particle - self.places.first_slots[i]),
                (moved[i], sintered[i]) if i in sintered else (moved[i],),
            )
            for i in over
        }

    def is_under_way(self) -> bool:
        """Whether any case has begun a frame and not ended it."""
        return any(not member.waits for member in self.members)

    def _sinters(self, i: int) -> bool:
        """Whether a case sinters in its frame."""
        return make_orders(self.members[i].case, self.members[i].number).sinters

    def read_case(self, i: int) -> Values:
        """Copy all quantities of one case, by name."""
        return self._read(self.whole, [i])[i].split(self.whole.shapes)

    def _read(self, selection: Selection, chosen: Sequence[int]) -> dict[int, Block]:
        """Copy a selection of the quantities of the chosen cases."""
        if not chosen:
            return {}
        rows, count = self._place_rows(chosen)
        values = np.empty((count, selection.width))
        copy_cases_out(selection, self.places, rows, values)
        names = tuple(selection.places)
        return {i: Block(names, values[rows[i] : rows[i] + self.places.counts[i]]) for i in chosen}

    def _write(self, selection: Selection, given: Mapping[int, Mapping[str, np.ndarray]]) -> None:
        """Set a selection of quantities of some cases, by case and name."""
        if not given:
            return
        rows, count = self._place_rows([*given])
        values = np.empty((count, selection.width))
        for i, quantities in given.items():
            for name, (first, last) in selection.places.items():
                part = np.asarray(quantities[name], dtype=float).reshape(self.places.counts[i], -1)
                values[rows[i] : rows[i] + self.places.counts[i], first:last] = part
        copy_cases_in(selection, self.places, rows, values)

    def _place_rows(self, chosen: Sequence[int]) -> tuple[np.ndarray, int]:
        """The first row of each case in an array for the chosen ones alone, -1 for others; and how many rows it has."""
        rows, count = np.full(len(self.members), -1, dtype=np.int32), 0
        for i in chosen:
            rows[i] = count
            count += self.places.counts[i]
        return rows, count

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
