"""What is simulated: the case.  The solver sees nothing else, and the id of a run is a hash of it.

Lengths are in cells of the paper's grid; ``reading.cell`` turns them into the reading's unit.
"""

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from .base import AddedLater, Name, Settings
from .laws import CamClay, MaterialChoice, PaperRates, Sand, SinteringChoice, Stomakhin
from .loading import MOST_FRAMES, Loading

MODEL_VERSION = 5  # goes up when the same case gives another result, or a result that holds more
ARMS = ("sintered", "unsintered")
Point = tuple[float, float]
Corner = Annotated[tuple[float, ...], Field(min_length=2, max_length=3)]
Ring = tuple[Corner, ...]
APPROACH_SPACINGS = 2.0  # the reach of the cubic spline
MOST_NAME_BYTES = 180  # of all names together: the folder of a run is called by them, and may have 255
MOST_BULGE = 10.0  # nearly a full circle on a short chord
MOST_REACH = 1e5  # of an outline from the origin, ten times the widest domain [cells]
MOST_CORNERS = 10_000  # of an outline; the time to build a scene grows with them


class Outline(Settings):
    """One or more closed curves in cells: a circle, or a polygon whose edges may be arcs, and further ``rings``.

    A third number at a corner bends the edge that starts there: the tangent of a quarter of the
    arc's angle, positive if the arc lies on the right of the straight edge.  A ring inside another is a
    hole, one beside it a body of its own, and so on inwards (the even-odd rule).  Drawings become polygons
    before they come here: see ``composition.drawings``.
    """

    kind: Literal["circle", "polygon"]
    centre: Point = Field((0.0, 0.0), description="circle: centre [cells]")
    radius: float | None = Field(None, gt=0, le=MOST_REACH, description="circle: radius [cells]")
    points: Ring | None = Field(None, description="polygon: corners in order [cells], and bulge [1]")
    rings: Annotated[tuple[Ring, ...] | None, AddedLater] = Field(
        None, description="more closed curves, each a list of corners: holes, other bodies, islands in holes"
    )

    @property
    def curves(self) -> tuple[Ring, ...]:
        """All closed curves as corners; a circle is two half circles."""
        if self.kind == "circle" and self.radius is not None:
            (x, y), r = self.centre, self.radius
            return (((x - r, y, 1.0), (x + r, y, 1.0)), *(self.rings or ()))
        return (self.points or (), *(self.rings or ()))

    @model_validator(mode="after")
    def _has_what_its_kind_needs(self) -> "Outline":
        if self.kind == "circle" and self.radius is None:
            raise ValueError("a circle needs a radius")
        if self.kind == "polygon" and not self.points:
            raise ValueError("a polygon needs points")
        for ring in self.curves:
            if len(ring) < 3 and (len(ring) < 2 or not any(corner[2:] for corner in ring)):
                raise ValueError("a polygon without arcs needs at least three points")
            if any(abs(bulge) > MOST_BULGE for corner in ring for bulge in corner[2:]):
                raise ValueError(f"the bulge of an arc must lie between -{MOST_BULGE:g} and {MOST_BULGE:g}")
        return self

    @model_validator(mode="after")
    def _is_of_a_size_that_can_be_handled(self) -> "Outline":
        corners = sum(len(ring) for ring in self.curves)
        if corners > MOST_CORNERS:
            raise ValueError(f"the outline has {corners:,} corners; at most {MOST_CORNERS:,} are allowed")
        farthest = max((abs(x) for ring in self.curves for corner in ring for x in corner[:2]), default=0.0)
        if farthest > MOST_REACH:
            raise ValueError(f"the outline reaches {farthest:g} cells from (0, 0); at most {MOST_REACH:g} are allowed")
        return self


class Shape(Settings):
    """The body of snow before it is pressed."""

    name: Name
    outline: Outline


class Floor(Settings):
    """What the snow falls on, from the lower left corner of the domain."""

    name: Name
    outline: Outline
    width: float | None = Field(None, gt=10, le=1e4, description="of the domain [cells]; none: the floor's right end")
    drop_x: float | None = Field(None, gt=0, description="place of the snow's centre [cells]; none: mid-domain")


class Material(Settings):
    """Table 1: the snow before sintering."""

    rho: float = Field(gt=0, description="initial density [kg/m^3]")
    E: float = Field(gt=0, description="initial Young's modulus [Pa]")
    nu: float = Field(ge=0, lt=0.5, description="initial Poisson's ratio [1]")
    mass: float = Field(gt=0, description="mass of a particle, Table 1 [kg]")
    theta_c: float = Field(gt=0, lt=1, description="critical compression [1]")
    theta_s: float = Field(gt=0, lt=1, description="critical stretch [1]")
    xi: float = Field(ge=0, description="initial hardening coefficient [1]")
    law: Annotated[MaterialChoice, AddedLater] = Field(Stomakhin(), description="what strain does to the snow")

    @model_validator(mode="after")
    def _has_what_sintering_multiplies(self) -> "Material":
        if isinstance(self.law, CamClay | Sand) and self.law.sintered != "nothing" and self.xi == 0:
            raise ValueError(
                f"law.sintered={self.law.sintered} multiplies the strength by xi over its first value, which must not "
                "be 0: set xi, or law.sintered=nothing"
            )
        return self

    @property
    def mu(self) -> float:
        """Initial Lame parameter mu [Pa]."""
        return self.E / (2.0 * (1.0 + self.nu))

    @property
    def lam(self) -> float:
        """Initial Lame parameter lambda [Pa]."""
        return self.nu * self.E / ((1.0 + self.nu) * (1.0 - 2.0 * self.nu))


class Sintering(Settings):
    """Eqs. 2, 6, 7 and 9: whether they act while the snow is pressed, and their constants."""

    name: Name
    enabled: bool
    rho_max: float = Field(gt=0, description="maximum density [kg/m^3]")
    C1: float = Field(ge=0, description="Eq. 2, internal force [1/(Pa s)]")
    C2: float = Field(ge=0, description="Eq. 2, external force [s/length]")
    C3: float = Field(ge=-16, le=16, description="Eq. 7 [1]")
    C4: float = Field(ge=0, description="Eq. 9, internal force [1/Pa]")
    C5: float = Field(ge=0, description="Eq. 9, external force [s^2/length]")
    law: Annotated[SinteringChoice, AddedLater] = Field(PaperRates(), description="what pressing does to the snow")


class Indenter(Settings):
    """The hardness test: instead of falling, the snow rests, its lower half is held, and a disc is pressed into it."""

    name: Name
    radius: float = Field(gt=0, le=1e9, description="of the rigid disc [cells]")
    depth: float = Field(gt=0, description="to which it goes from the first touch on [cells]")
    speed: float = Field(gt=0, description="with which it goes down [cells/s]")
    friction: float = Field(ge=0, description="Coulomb friction of the disc [1]")
    rest_frames: int = Field(ge=0, description="frames without any force before the test [1]")
    rest_damping: float = Field(ge=0, description="damping of velocities in them [1/s]")
    every: int = Field(gt=0, description="frames between stored particle states from the release on [1]")

    @model_validator(mode="after")
    def _has_a_chord(self) -> "Indenter":
        if self.depth > self.radius:
            raise ValueError(f"depth ({self.depth:g}) must not exceed the disc's radius ({self.radius:g})")
        return self


class Reading(Settings):
    """One way to read what the paper leaves open; conf/reading says why each default is as it is."""

    name: Name
    length_unit: Literal["cell", "m"]
    cell: float = Field(gt=0, description="a cell of the paper's grid in length units")
    gravity: float = Field(ge=0, description="downward acceleration after release [length/s^2]")
    drop_height: float = Field(gt=0, description="free fall to the first touch [cells]")
    press: Literal["radial_linear", "radial_constant", "shell", "two_sides"]
    press_ramp: int = Field(ge=0, description="frames over which the force grows to its value [1]")
    press_damping: float = Field(ge=0, description="damping of velocities while pressed [1/s]")
    unsintered: Literal["pressed", "not_pressed"]
    release: Literal["keep_velocity", "rest"]
    external_force: Literal["per_unit_mass", "per_particle"]
    cadence: Literal["frame", "substep"]
    hardening_growth: Literal["per_update", "per_time"]
    density_changes: Literal["moduli", "moduli_and_volume"]
    poisson_denominator: Literal["consistent", "as_printed"]
    poisson_cap: float = Field(gt=0, lt=0.5, description="upper bound of Poisson's ratio [1]")
    plane: Literal["strain", "stress_zz_zero"]
    hardening_exponent: tuple[float, float] = Field(description="bounds of xi (1 - J_P) in Eq. 1 [1]")
    plastic_volume: tuple[float, float] = Field(description="bounds of J_P [1]")
    softening_length: Annotated[float | None, AddedLater] = Field(
        None, gt=0, description="grid spacing on which a crack takes the energy that it takes here [cells]; none: any"
    )
    initial_volume: Literal["grid_density", "sampled"]
    contact: Literal["legacy", "coulomb", "penalty"]
    friction: float = Field(ge=0, description="Coulomb friction of the floor [1]")
    inside_floor: Literal["moved_out", "left"]

    @model_validator(mode="after")
    def _bounds_are_ordered(self) -> "Reading":
        low, high = self.hardening_exponent
        if not -16.5 <= low <= 0 <= high <= 16.5:
            raise ValueError("hardening_exponent must be [low, high] with -16.5 <= low <= 0 <= high <= 16.5")
        low, high = self.plastic_volume
        if not 0 < low <= 1 <= high:
            raise ValueError("plastic_volume must be [low, high] with 0 < low <= 1 <= high")
        return self


class Fidelity(Settings):
    """How finely the scene is resolved."""

    name: Name
    dx: float = Field(ge=0.01, le=3, description="grid spacing [cells of the paper]")
    particles_per_cell: int = Field(ge=1, le=64, description="particles in a grid cell at the start [1]")


class Solver(Settings):
    """Numerical choices."""

    transfer: Literal["apic", "pic_flip", "mls"]
    flip: float = Field(ge=0, le=1, description="pic_flip: part of the velocity that particles keep in a step [1]")
    pic_rate: Annotated[float | None, AddedLater] = Field(
        None, ge=0, description="pic_flip: in place of flip, rate at which particles lose their own velocity [1/s]"
    )
    precision: Literal["f64", "f32"]
    device: Literal["cpu", "cuda"]
    summation: Literal["in_order", "fixed_point", "atomic"]
    spline: Literal["quadratic", "cubic"]
    cfl: float = Field(gt=0, le=1, description="time step in units of dx / (wave speed + speed) [1]")
    max_substeps: int = Field(
        gt=0, le=10_000_000, description="substeps a frame beyond which a run counts as diverged [1]"
    )
    max_bounded: float = Field(ge=0, le=1, description="part of the particles at the lowest J_P, likewise [1]")

    @model_validator(mode="after")
    def _rate_is_of_pic_flip(self) -> "Solver":
        if self.pic_rate is not None and self.transfer != "pic_flip":
            raise ValueError(f"pic_rate is a choice of transfer=pic_flip, and transfer is {self.transfer}")
        return self

    @model_validator(mode="after")
    def _gpu_sums_in_parallel(self) -> "Solver":
        if self.device == "cuda" and self.summation == "in_order":
            raise ValueError(
                "a GPU cannot sum in_order, which takes one thread: summation=fixed_point repeats bits too, "
                "summation=atomic does not"
            )
        return self


class Output(Settings):
    """What is kept of a run."""

    every: int = Field(gt=0, description="frames between stored particle states [1]")
    cluster_size: float = Field(
        gt=0.1, le=100, description="width of the clusters that are followed in every frame since release [cells]"
    )


class Case(Settings):
    """One simulation, whole."""

    shape: Shape
    floor: Floor
    pressure: float = Field(ge=0, le=1e12, description="nominal pressure at the snow's centre [unit of E]")
    sintering: Sintering
    material: Material
    loading: Loading
    reading: Reading
    fidelity: Fidelity
    solver: Solver
    seed: int = Field(ge=0, le=2**31 - 1, description="of the particles' random places [1]")
    output: Output
    indenter: Indenter | None = None

    @model_validator(mode="after")
    def _names_fit_a_folder(self) -> "Case":
        named = (self.shape, self.floor, self.sintering, self.fidelity, self.indenter)
        length = sum(len(section.name.encode()) for section in named if section)
        if length > MOST_NAME_BYTES:
            raise ValueError(
                f"the names of shape, floor, sintering, fidelity and indenter have {length} bytes together, and may "
                f"have {MOST_NAME_BYTES}: they are part of a folder's name"
            )
        return self

    @model_validator(mode="after")
    def _softening_has_what_it_acts_on(self) -> "Case":
        if self.reading.softening_length and self.material.law.name != "stomakhin":
            raise ValueError(
                f"reading.softening_length acts on Eq. 1, which material '{self.material.law.name}' does not have: "
                "set it to null"
            )
        return self

    @model_validator(mode="after")
    def _density_can_grow(self) -> "Case":
        if self.sintering.rho_max <= self.material.rho:
            raise ValueError(
                f"sintering.rho_max ({self.sintering.rho_max}) must exceed material.rho ({self.material.rho})"
            )
        return self

    @model_validator(mode="after")
    def _steps_fit_in_a_frame(self) -> "Case":
        """As long as the snow is at rest and as soft as at first; later it needs more."""
        material = self.material
        wave_speed = math.sqrt((material.lam + 2.0 * material.mu) / material.rho)
        needed = self.loading.frame_time * wave_speed / (self.solver.cfl * self.dx)
        if needed > self.solver.max_substeps:
            raise ValueError(
                f"a frame needs {needed:,.0f} substeps or more, solver.max_substeps allows "
                f"{self.solver.max_substeps:,}: elastic waves cross {wave_speed:,.4g} lengths a second, the grid "
                f"spacing is {self.dx:g} lengths, and solver.cfl is {self.solver.cfl:g}"
            )
        return self

    @model_validator(mode="after")
    def _indenter_arrives(self) -> "Case":
        if self.indenter and self.frames > MOST_FRAMES:
            raise ValueError(
                f"indenter.speed ({self.indenter.speed:g} cells/s) makes a test of {self.frames:,} frames; at most "
                f"{MOST_FRAMES:,} are allowed"
            )
        return self

    @model_validator(mode="after")
    def _fall_has_an_end(self) -> "Case":
        if self.indenter or self.loading.fall_time is None:
            return self
        if not self.reading.gravity:
            raise ValueError("loading.fall_time follows a fall, and reading.gravity=0 has none: set it to null")
        if self.frames > MOST_FRAMES:
            raise ValueError(
                f"loading.fall_time makes {self.frames:,} frames of a fall that takes {self.fall_time:,.4g} s; at most "
                f"{MOST_FRAMES:,} are allowed"
            )
        return self

    @property
    def arm(self) -> str:
        """Which of ARMS the run belongs to, whatever its option of ``sintering`` is called."""
        return ARMS[0] if self.sintering.enabled else ARMS[1]

    def is_stored(self, frame: int) -> bool:
        """Whether a frame's particles are kept: every so many, and always the start, the release and the last one.

        Those of the frame in which a run ends at rest are kept too.
        """
        release, behind = self.loading.press_frames, frame - self.loading.press_frames
        in_turn = behind % self.indenter.every if self.indenter and behind > 0 else frame % self.output.every
        return (in_turn == 0 or frame in (release, self.frames)) and 0 <= frame <= self.frames

    @property
    def frames(self) -> int:
        """Frames of the run, at most: those of the loading, or as many as the hardness test takes."""
        if self.indenter is None:
            return self.own_loading.frames
        way = self.approach + self.indenter.depth
        return self.frames_before_test + math.ceil(way / (self.indenter.speed * self.loading.frame_time) - 1e-9)

    @property
    def own_loading(self) -> Loading:
        """The loading with the times that it has in this case's fall: see ``Loading.scale_to``."""
        return self.loading.scale_to(self.fall_time) if self.loading.fall_time else self.loading

    @property
    def fall_time(self) -> float:
        """How long the body falls freely to its first touch, sqrt(2 H / g) [s]; endless without gravity."""
        reading = self.reading
        return math.sqrt(2.0 * reading.drop_height * reading.cell / reading.gravity) if reading.gravity else math.inf

    @property
    def frames_before_test(self) -> int:
        """Frames in which snow that is to be indented is pressed and rests."""
        return self.loading.press_frames + (self.indenter.rest_frames if self.indenter else 0)

    @property
    def approach(self) -> float:
        """Height above first touch from which the disc comes, out of reach of the snow's nodes [cells]."""
        return APPROACH_SPACINGS * self.fidelity.dx

    @property
    def frames_at_rest(self) -> int | None:
        """Frames at rest that end the run; None: it goes on to the last, as a hardness test does."""
        rest = self.own_loading.rest if not self.indenter else None
        return math.ceil(rest.seconds / self.loading.frame_time - 1e-9) if rest else None

    def is_tested(self, frame: int) -> bool:
        """Whether the indenter moves in a frame."""
        return self.indenter is not None and frame > self.frames_before_test

    def gravity_in(self, frame: int) -> float:
        """Downward acceleration in a frame [length/s^2]: none while pressed, none in a hardness test."""
        return 0.0 if self.indenter or frame <= self.loading.press_frames else self.reading.gravity

    def damping_in(self, frame: int) -> float:
        """Damping of velocities in a frame [1/s]."""
        if frame <= self.loading.press_frames:
            return self.reading.press_damping
        return self.indenter.rest_damping if self.indenter and not self.is_tested(frame) else 0.0

    @property
    def softening(self) -> float:
        """Factor on xi where J_P > 1: a crack is as wide as the grid spacing, and opens by (J_P - 1) of it."""
        length = self.reading.softening_length
        return self.fidelity.dx / length if length else 1.0

    @property
    def dx(self) -> float:
        """Grid spacing in length units."""
        return self.fidelity.dx * self.reading.cell
