"""Short runs that together use every law, reading and transfer, and their states at a few frames."""

from collections.abc import Collection, Iterator, Mapping

import numpy as np

from ..composition import compose
from ..config import Config
from ..mpm import solver
from ..mpm.state import PARTICLE_STATE
from ..scene.build import Scene, build_scene

State = dict[str, np.ndarray]  # quantity by name, (particle, ...), particles sorted by where they started

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
ROUNDED = ("position", "velocity", "F_E")  # what a rounding error would be in
ULPS = 2  # of one number in a frame, at most


def configs(names: Collection[str] = tuple(CASES)) -> dict[str, Config]:
    """The configurations of some cases by name."""
    return {name: compose(overrides) for name, overrides in CASES.items() if name in names}


def watched(config: Config) -> tuple[int, ...]:
    """The frames that are compared: the first, the release, halfway to the end, the end."""
    release = config.loading.press_frames
    return 1, release, (release + config.frames) // 2, config.frames


def observe(config: Config, rounding: np.random.Generator | None = None) -> dict[int, State]:
    """The states in the watched frames, and under "totals" what each frame's energy and momentum came to.

    With ``rounding`` every particle is moved by some units in the last place in each frame: a run as another
    compiler, or the same sums in another order, could have made it.  Raises Diverged.
    """
    scene = build_scene(config)
    order = by_start(scene)
    states = {}
    for frame in solver.frames(config, scene):
        if frame.number in watched(config):
            states[frame.number] = {name: frame.read(name)[order] for name in OBSERVED}
            states[frame.number]["totals"] = np.array(list(frame.totals.values()))
        if rounding is not None:
            for name in ROUNDED:
                values = frame.read(name)
                ulps = rounding.integers(-ULPS, ULPS, size=values.shape, endpoint=True)
                frame.particles.write(name, values + ulps * np.spacing(values))
    return states


def last_frame(config: Config, scene: Scene | None = None, **how) -> solver.Frame:
    """The end of a run, of a ``scene`` of its own if need be; ``how`` as ``solver.frames`` takes it."""
    *_, last = solver.frames(config, scene or build_scene(config), **how)
    return last


def whole_state(frame: solver.Frame) -> State:
    """Every quantity of every particle, in the solver's order."""
    return {quantity.name: frame.read(quantity.name) for quantity in PARTICLE_STATE}


def by_start(scene: Scene) -> np.ndarray:
    """The order of particles by where they start, whatever order the scene has them in."""
    return np.lexsort(scene.positions.T)


def differing(one: State, other: State) -> Iterator[str]:
    """The quantities that are not the same bits, each with the largest difference."""
    for name, values in one.items():
        if not np.array_equal(values, other[name], equal_nan=True):
            yield f"{name} by {np.abs(values - other[name]).max():.2g}"
