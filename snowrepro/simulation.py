"""Run one case and describe its result as a Dataset that explains itself."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import xarray as xr

from . import units
from .analysis.clusters import FRAMES, MEMBER, POSITION, Clusters, group_particles, locate_clusters, make_clusters
from .analysis.rest import is_at_rest
from .errors import Diverged
from .mpm import diagnostics, ledger, solver
from .mpm.batch import Batch, Follower
from .mpm.frame import Frame
from .mpm.service import Address
from .mpm.service import frames as ask_service
from .mpm.state import list_quantities
from .scene.build import Scene, build_scene
from .settings.case import MODEL_VERSION, Case
from .settings.laws import InstalledLaw, Stomakhin


@dataclass
class Record:
    """What a run has given so far.

    ``rows`` of diagnostics by frame, the states that are stored, where the ``clusters`` of the particles at release
    are in each frame since then (``track``), constants, and whether the last frame is the end of the run.
    """

    rows: list[dict[str, float]] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)  # of the stored frames
    stored: dict[str, list[np.ndarray]] = field(default_factory=dict)
    constants: dict[str, np.ndarray] = field(default_factory=dict)  # as they were at the start
    clusters: Clusters | None = None
    track: list[np.ndarray] = field(default_factory=list)
    is_ended: bool = False

    def add(self, frame: Frame, case: Case) -> None:
        """Measure a frame, and keep its particles if they are to be stored."""
        if frame.number == 0:
            self.constants = {name: frame.read(name) for name in ("mass", "volume")}
        self.rows.append(diagnostics.measure(frame, case, self.rows[-1] if self.rows else None))
        if frame.number >= case.loading.press_frames:
            self._follow(frame.read("position").astype(np.float32), case)
        self.is_ended = self.find_end(case)
        if case.is_stored(frame.number) or self.is_ended:
            self.numbers.append(frame.number)
            for name in (quantity.name for quantity in frame.particles.quantities if quantity.stored):
                self.stored.setdefault(name, []).append(frame.read(name).astype(np.float32))

    def _follow(self, positions: np.ndarray, case: Case) -> None:
        """Find the clusters in a frame since the release; in that of the release the particles are grouped."""
        if self.clusters is None:
            self.clusters = group_particles(positions, self.constants["mass"], _cluster_width(case))
        self.track.append(locate_clusters(self.clusters, positions).astype(np.float32))

    def find_end(self, case: Case) -> bool:
        """Find whether the run is at its end: in its last frame, or with snow that has been at rest for so long."""
        frames, rest = case.frames_at_rest, case.loading.rest
        if len(self.rows) > case.frames:
            return True
        if not (frames and rest and self.clusters):
            return False
        energies = [row["kinetic_energy"] for row in self.rows[case.loading.press_frames :]]
        return is_at_rest(energies, self.track, self.clusters, rest, frames, case.reading.cell)


@dataclass(frozen=True)
class Progress:
    """How far a run is: frames done and in all, substeps of the last frame; and all that it takes to go on.

    ``frames``: at most, or as many as it took once the snow is at rest.
    """

    frame: int
    frames: int
    substeps: int
    checkpoint: Callable[[], dict[str, np.ndarray]]


def simulate_case(
    case: Case,
    on_frame: Callable[[Progress], None] | None = None,
    resume: Mapping[str, np.ndarray] | None = None,
    threads: int = 1,
    service: Address | None = None,
) -> xr.Dataset:
    """Simulate one case, here or by the ``service`` that computes many side by side.

    ``on_frame`` is called after each frame; what its ``checkpoint`` gave can be passed as ``resume`` to
    go on from there, to the same bits.  Returns a Dataset with dimensions ``frame`` (0 to the last, for
    the diagnostics), ``snapshot`` (the stored frames), ``particle`` and ``axis``.  The last frame is that of the case,
    or the one in which the snow has come to rest.
    Raises ConfigError where the scene does not fit, Diverged where the run stops being one.
    """
    scene = build_scene(case)
    record = _unpack(resume, case) if resume else Record()
    for frame in () if record.is_ended else _ask_frames(case, scene, resume, threads, service):
        record.add(frame, case)
        if on_frame:
            last = frame.number if record.is_ended else case.frames
            on_frame(Progress(frame.number, last, frame.outcome.substeps, partial(_pack, record, frame)))
        if record.is_ended:
            break
    return _describe(case, record)


def _ask_frames(
    case: Case, scene: Scene, resume: Mapping[str, np.ndarray] | None, threads: int, service: Address | None
) -> Iterator[Frame]:
    """The frames of a case, from where they are computed."""
    if service:
        return ask_service(service, case, scene, resume)
    return solver.frames(case, scene, resume, threads)


def simulate_cases(cases: Sequence[Case], threads: int = 1) -> Iterator[tuple[int, xr.Dataset | Diverged]]:
    """Simulate cases side by side, to the bits that each has alone.

    Yields, as each ends, its place in ``cases`` with its Dataset, as ``simulate_case`` returns it, or with why it
    stopped being a simulation.  Raises ConfigError where they do not fit together: see ``mpm.batch``.
    """
    scenes = [build_scene(case) for case in cases]
    batch = Batch(cases, scenes, [None] * len(cases), threads)
    followers = [
        Follower(case, scene, batch.table, batch.place_block(batch.force, i), partial(batch.read_case, i))
        for i, (case, scene) in enumerate(zip(cases, scenes, strict=True))
    ]
    records = [Record() for _ in cases]
    reports = batch.start()
    while reports or batch.is_under_way():
        going_on = []
        for i, report in reports.items():
            try:
                records[i].add(followers[i].take(report), cases[i])
            except Diverged as error:
                yield i, error
                continue
            if records[i].is_ended:
                yield i, _describe(cases[i], records[i])
            else:
                followers[i].press()
                going_on.append(i)
        batch.begin(going_on)
        batch.launch()
        reports = batch.collect()


def _pack(record: Record, frame: Frame) -> dict[str, np.ndarray]:
    """The record and the frame's checkpoint as named arrays."""
    rows = {f"row {name}": np.array([row[name] for row in record.rows]) for name in record.rows[0]}
    stored = {f"stored {name}": np.stack(values) for name, values in record.stored.items()}
    constants = {f"constant {name}": values for name, values in record.constants.items()}
    track = {MEMBER: record.clusters.member, POSITION: np.stack(record.track)} if record.clusters else {}
    return {**frame.checkpoint(), **rows, **stored, **constants, **track, "stored frames": np.array(record.numbers)}


def _unpack(saved: Mapping[str, np.ndarray], case: Case) -> Record:
    """The record that ``_pack`` saved."""

    def part(kind: str) -> dict[str, np.ndarray]:
        return {name.removeprefix(kind): saved[name] for name in saved if name.startswith(kind)}

    columns = {name: values.tolist() for name, values in part("row ").items()}
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    numbers = saved["stored frames"].tolist()
    stored = {name: list(values) for name, values in part("stored ").items() if name != "frames"}
    record = Record(rows, numbers, stored, part("constant "))
    if MEMBER in saved:
        released = stored["position"][numbers.index(case.loading.press_frames)]
        record.clusters = make_clusters(saved[MEMBER], released, record.constants["mass"], _cluster_width(case))
        record.track = list(saved[POSITION])
    record.is_ended = record.find_end(case)
    return record


def _cluster_width(case: Case) -> float:
    """The width of a cluster in length units."""
    return case.output.cluster_size * case.reading.cell


def _describe(case: Case, record: Record) -> xr.Dataset:
    """Put the arrays of a run into a Dataset with names and units."""
    rows, numbers = record.rows, record.numbers

    def attrs(long_name: str, powers: str) -> dict[str, str]:
        return {"long_name": long_name, "units": units.text(powers, case.reading.length_unit)}

    table = {quantity.name: quantity for quantity in list_quantities(case)}
    frame_time = case.loading.frame_time
    coords = {
        "frame": ("frame", np.arange(len(rows), dtype=np.int32), attrs("frame number", "1")),
        "time": ("frame", np.arange(len(rows)) * frame_time, attrs("time since pressing began", "T")),
        "snapshot": ("snapshot", np.array(numbers, dtype=np.int32), attrs("frame number of a stored state", "1")),
        "snapshot_time": ("snapshot", np.array(numbers) * frame_time, attrs("time of a stored state", "T")),
        "axis": ("axis", np.array(["x", "y"]), {"long_name": "horizontal and upward axis", "units": "1"}),
    }
    variables = {}
    for name, states in record.stored.items():
        quantity = table[name]
        dims = ("snapshot", "particle", "axis")[: 2 + len(quantity.shape)]
        variables[name] = (dims, np.stack(states), attrs(quantity.long_name, quantity.unit))
    for name, values in record.constants.items():
        variables[name] = (("particle",), values, attrs(table[name].long_name, table[name].unit))
    if record.clusters:
        numbers_tracked = case.loading.press_frames + np.arange(len(record.track), dtype=np.int32)
        coords[FRAMES] = (FRAMES, numbers_tracked, attrs("frame number in which the clusters were followed", "1"))
        member = record.clusters.member.astype(np.int32)
        variables[MEMBER] = (("particle",), member, attrs("cluster of each particle since release", "1"))
        about = attrs("centre of mass of each cluster", "L")
        variables[POSITION] = ((FRAMES, "cluster_number", "axis"), np.stack(record.track), about)
    for name, (long_name, powers) in ledger.meaning(case).items():
        values = np.array([row[name] for row in rows])
        variables[name] = (("frame",), values, attrs(long_name, powers))
    dataset = xr.Dataset(variables, coords)
    dataset.attrs = {
        "title": f"{case.shape.name} snow on {case.floor.name} floor, pressure {case.pressure:g}, "
        f"sintering {case.sintering.name}",
        "model_version": MODEL_VERSION,
        "release_frame": case.loading.press_frames,
        "grid_spacing": case.dx,
        "cell": case.reading.cell,
        "cell_mass": case.material.rho * case.reading.cell**2,
        "length_unit": case.reading.length_unit,
        "comment": "Lengths are in the unit 'length_unit'; grid_spacing is one cell of this run's grid; "
        "cell one of the paper's; cell_mass the mass of unpressed snow in one of these.",
    }
    if case.material.law != Stomakhin():
        dataset.attrs["title"] += f", material {case.material.law.name}"
    for law in (case.material.law, case.sintering.law):
        if isinstance(law, InstalledLaw):
            dataset.attrs["title"] += f", {law.name} of {law.origin}"
    if case.indenter:
        dataset.attrs["title"] += ", indented at release"
        dataset.attrs["comment"] += " floor_work is of floor, vice and indenter together."
    return dataset
