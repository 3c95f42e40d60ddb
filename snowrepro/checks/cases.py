"""Short runs that together use every law, reading and transfer, and their states at a few frames."""

from collections.abc import Collection, Iterator, Mapping

import numpy as np

from ..composition.compose import compose
from ..mpm import solver
from ..mpm.frame import Frame
from ..mpm.state import Particles
from ..scene.build import Scene, build_scene
from ..settings.case import Case
from ..settings.config import Config

State = dict[str, np.ndarray]  # quantity by name, (particle, ...), particles sorted by their place at the start

# Lands near frame 47 and goes on for a quarter of a second.
SHORT = (
    "fidelity=preview", "loading.press_frames=20", "loading.frames=60", "reading.drop_height=6", "reading.gravity=40",
    "pressure=3000",
)  # fmt: skip
CASES: Mapping[str, tuple[str, ...]] = {
    "sintered": SHORT,
    "unsintered": (*SHORT, "sintering=none", "shape=star", "floor=stair3"),
    # So dense that the bounds of density and Poisson's ratio act.
    "bounded": (*SHORT, "pressure=10000", "sintering.C2=10", "loading.press_frames=5", "loading.frames=10"),
    # As many of the other readings as go together.
    "readings": (
        *SHORT, "reading.cadence=substep", "reading.density_changes=moduli_and_volume", "reading.release=rest",
        "reading.hardening_growth=per_time", "reading.external_force=per_particle", "reading.press=shell",
        "reading.press_ramp=5", "reading.press_damping=1", "reading.contact=coulomb", "reading.friction=0.5",
        "reading.plane=stress_zz_zero", "reading.initial_volume=sampled", "reading.inside_floor=left",
        "reading.plastic_volume=[0.5,2]", "solver.max_bounded=1",
    ),
    # So hard an impact on Coulomb's floor that particles, and not only nodes, collide with it: step 8.
    "hit": (
        *SHORT, "sintering=none", "pressure=0", "loading.press_frames=2", "loading.frames=20", "floor=zigzag",
        "reading.contact=coulomb", "reading.friction=0.3", "reading.drop_height=4", "reading.gravity=150",
        "solver.max_bounded=1",
    ),
    "fixed point": (*SHORT, "solver.summation=fixed_point", "solver.transfer=mls", "solver.spline=quadratic"),
    "pic_flip": (*SHORT, "solver.transfer=pic_flip"),
    "indented": (*SHORT, "indenter=disc", "indenter.speed=100", "indenter.rest_frames=10"),
}  # fmt: skip
OBSERVED = (
    "position", "velocity", "affine", "F_E", "J_P", "density", "young", "poisson", "hardening", "von_mises", "volume",
)  # fmt: skip
ROUNDED = ("position", "velocity", "F_E")  # quantities that ``observe_run`` gives rounding errors
ULPS = 2  # of one number in a frame, at most


def compose_short_runs(names: Collection[str] = tuple(CASES)) -> dict[str, Case]:
    """Compose some of CASES, by name."""
    return {name: compose(overrides).case for name, overrides in CASES.items() if name in names}


def list_watched_frames(case: Case) -> tuple[int, ...]:
    """List the frames that are compared: the first, the release, halfway from there to the end, the end."""
    release = case.loading.press_frames
    return 1, release, (release + case.frames) // 2, case.frames


def observe_run(case: Case, rounding: np.random.Generator | None = None) -> dict[int, State]:
    """Simulate a case and return its states in the watched frames, with energy and momentum of the frame as "totals".

    With ``rounding`` every particle is moved by some units in the last place in each frame, as another compiler or
    another order of sums could do.  Raises Diverged.
    """
    scene = build_scene(case)
    order = order_by_start(scene)
    states = {}
    for frame in solver.frames(case, scene):
        if frame.number in list_watched_frames(case):
            states[frame.number] = {name: frame.read(name)[order] for name in OBSERVED}
            states[frame.number]["totals"] = np.array(list(frame.outcome.totals.values()))
        if rounding is not None:
            for name in ROUNDED:
                values = frame.read(name)
                ulps = rounding.integers(-ULPS, ULPS, size=values.shape, endpoint=True)
                assert isinstance(frame.particles, Particles)
                frame.particles.write(name, values + ulps * np.spacing(values))
    return states


def simulate_to_end(
    config: Config, scene: Scene | None = None, resume: Mapping[str, np.ndarray] | None = None
) -> Frame:
    """Simulate to the last frame and return it.

    ``scene``: where it is not the one that the configuration describes; ``resume``: a checkpoint to go on from.
    Raises Diverged.
    """
    scene = scene or build_scene(config.case)
    *_, last = solver.frames(config.case, scene, resume, config.execution.threads)
    return last


def read_state(frame: Frame) -> State:
    """Read every quantity of every particle from a frame, in the solver's order."""
    return {quantity.name: frame.read(quantity.name) for quantity in frame.particles.quantities}


def order_by_start(scene: Scene) -> np.ndarray:
    """Return the order (n,) of the particles by their place at the start, whatever their order in the scene."""
    return np.lexsort(scene.positions.T)


def list_differences(one: State, other: State) -> Iterator[str]:
    """List the quantities whose bits differ between two states, each with the largest difference."""
    for name, values in one.items():
        if not np.array_equal(values, other[name], equal_nan=True):
            yield f"{name} by {np.abs(values - other[name]).max():.2g}"
