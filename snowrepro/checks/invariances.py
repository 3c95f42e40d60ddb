"""Tier 0: properties that any solver of these laws must have, whatever its numbers are; needs no reference."""

import dataclasses
import functools
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import xarray as xr

from ..composition.compose import compose
from ..mpm import solver
from ..mpm.ledger import WORKS
from ..run import simulate
from ..scene.build import build_scene
from ..settings.base import Settings
from ..settings.config import Config
from ..simulation import Progress
from .cases import SHORT, State, list_differences, order_by_start, read_state, simulate_to_end
from .finding import OK, REGRESSED, Finding, check_bound

FIXED_POINT = "solver.summation=fixed_point"
RESTARTS = (7, 20, 48)  # in mid-press, at the release, in the impact
LENGTH, MASS, TIME = 2.0**3, 2.0**-5, 2.0**-1  # other units: powers of two change no digit
ROUND_OFF = 1e-12  # of sums over some thousand particles and some hundred steps
LOPSIDED = ((0, 0), (200, 0), (200, 30.3), (140, 30.3), (100, 20.3), (70, 40.3), (60, 12.3), (0, 12.3))
MIRRORED = ("position", "velocity", "J_P", "hardening")
UNEXPLAINED = 0.06  # part of the energy that causes give and take, at the coarse steps of these runs


def check_repetition() -> Finding:
    """Check that a fresh process gives the same bits as this one."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        other = pool.submit(_simulate_state, SHORT)
        _, saved = _simulate_short_case()
        names = [*list_differences(other.result(), saved[max(saved)])]
    return _report_differences("same bits twice, in two processes", names)


def check_restart() -> Finding:
    """Check that a run gives the same bits after a stop in mid-press, at the release and in the impact."""
    whole, saved = _simulate_short_case()
    names = []
    for frame in RESTARTS:
        resumed = simulate(compose(SHORT), resume=saved[frame])
        names += [f"{name} from frame {frame}" for name in whole.variables if not whole[name].equals(resumed[name])]
    return _report_differences("same bits after a restart", names)


def check_threads() -> Finding:
    """Check that fixed-point sums do not depend on the number of threads."""
    one, two = (_simulate_state((*SHORT, FIXED_POINT, f"threads={count}")) for count in (1, 2))
    return _report_differences("same bits on one thread and two (fixed point)", [*list_differences(one, two)])


def check_order() -> Finding:
    """Check that fixed-point sums do not depend on the order of particles.

    Without pressure, as its centre is a plain mean of the particles.
    """
    config = compose((*SHORT, FIXED_POINT, "pressure=0"))
    scene = build_scene(config.case)
    shuffle = np.random.default_rng(0).permutation(len(scene.positions))
    shuffled = dataclasses.replace(scene, positions=scene.positions[shuffle], depth=scene.depth[shuffle])
    states = [
        {name: values[order_by_start(s)] for name, values in read_state(simulate_to_end(config, s)).items()}
        for s in (scene, shuffled)
    ]
    return _report_differences("same bits in any order of particles (fixed point)", [*list_differences(*states)])


def check_output() -> Finding:
    """Check that how often states are stored does not change what is simulated."""
    often, seldom = (simulate(compose((*SHORT, f"output.every={every}"))) for every in (1, 30))
    ends = [{str(n): d[n].values for n in d.data_vars if "frame" in d[n].dims} for d in (often, seldom)]
    return _report_differences("same bits at any cadence of output", [*list_differences(*ends)])


def check_seed() -> Finding:
    """Check that another seed moves the particles."""
    one, other = (build_scene(compose((*SHORT, f"seed={seed}")).case).positions for seed in (0, 1))
    moved = float(np.mean(np.any(one != other, axis=1))) if one.shape == other.shape else 1.0
    state = OK if moved > 0.99 else REGRESSED
    return Finding(0, "another seed moves every particle", state, f"{moved:.0%} of them", "over 99%")


def check_units() -> Finding:
    """Check that other units of length, mass and time, by powers of two, give the same digits."""
    config = compose(SHORT)
    here, there = (read_state(simulate_to_end(c)) for c in (config, convert_units(config)))
    scales = {"position": LENGTH, "velocity": LENGTH / TIME, "young": MASS / LENGTH / TIME**2, "F_E": 1.0,
              "density": MASS / LENGTH**3, "hardening": 1.0, "von_mises": MASS / LENGTH / TIME**2}  # fmt: skip
    names = [*list_differences({n: here[n] * scale for n, scale in scales.items()}, {n: there[n] for n in scales})]
    return _report_differences("same digits in units of other powers of two", names)


def check_mirror() -> Finding:
    """Check that a ball on a lopsided floor gives the mirrored run when left and right are swapped."""
    one, other = simulate_mirrored("legacy")
    apart = max(float(np.abs(one[name] - other[name]).max()) for name in MIRRORED)
    return check_bound(0, "a mirrored scene gives the mirrored run", apart, 1e-9, "apart at most, in any quantity")


def check_no_pressure() -> Finding:
    """Check that sintering without pressure changes neither density, hardening nor moduli, but for round-off."""
    config = compose((*SHORT, "pressure=0", "loading.frames=20"))
    end, before = simulate_to_end(config), config.case.material
    first = {"density": before.rho, "hardening": before.xi, "young": before.E, "poisson": before.nu}
    changed = max(float(np.abs(end.read(name) / value - 1.0).max()) for name, value in first.items())
    return check_bound(0, "sintering without pressure changes nothing", changed, ROUND_OFF, "relative change")


def check_free_fall() -> Finding:
    """Check that from release to touch the centre of mass falls as a stone does."""
    config = compose((*SHORT, "pressure=0", "reading.drop_height=30", "loading.frames=40"))  # out of the floor's reach
    run, gravity = simulate(config), config.case.reading.gravity
    time = run.time.values[21:] - run.time.values[20]
    speed = run.momentum_y.values[21:] / run.total_mass.values[21:]
    start = run.momentum_y.values[20] / run.total_mass.values[20]
    off = float(np.abs(speed - start + gravity * time).max() / (gravity * time[-1]))
    return check_bound(0, "falls as a stone", off, ROUND_OFF, "of the speed")


def check_spin() -> Finding:
    """Check that snow that turns freely keeps its angular momentum, with that of the affine motion."""
    config = compose((*SHORT, "pressure=0", "sintering=none", "loading.frames=20"))
    rate, inertia = 0.5, solver.make_constants(config.case).inertia * config.case.dx**2
    first, *_ = solver.frames(config.case, build_scene(config.case))
    saved = first.checkpoint()
    arm = saved["position"] - saved["position"].mean(axis=0)
    turn = np.array([[0.0, -rate], [rate, 0.0]])
    saved |= {"velocity": arm @ turn.T, "affine": np.broadcast_to(turn * inertia, saved["affine"].shape)}
    before = _compute_angular_momentum(saved)
    after = _compute_angular_momentum(simulate_to_end(config, resume=saved).checkpoint())
    return check_bound(0, "angular momentum is kept", abs(after / before - 1.0), 1e-9, "lost, of all")


def check_balances() -> Finding:
    """Check that each frame's change of mass, momentum and energy has a cause.

    For mass and momentum to round-off, for energy but for the error of the steps in time.
    """
    run, _ = _simulate_short_case()
    scale = float(abs(run.momentum_y).max())
    lost = max(float(abs(run[f"unclosed_momentum_{axis}"]).max()) for axis in "xy") / scale
    mass = float(abs(run.total_mass / run.total_mass[0] - 1.0).max())
    turned_over = float(sum(abs(run[name]).sum() for name in WORKS))
    energy = float(abs(run.unclosed_energy).sum()) / turned_over
    balances = check_bound(0, "mass and momentum have a cause in each frame", max(lost, mass), ROUND_OFF, "without one")
    return (
        balances
        if energy <= UNEXPLAINED
        else check_bound(0, balances.name, energy, UNEXPLAINED, "of the energy without one")
    )


def convert_units(config: Config) -> Config:
    """Convert a configuration to units of length, mass and time that are 1/LENGTH, 1/MASS, 1/TIME as large."""
    stress, speed_up = MASS / LENGTH / TIME**2, LENGTH / TIME**2
    density = MASS / LENGTH**3

    def scaled(section: Settings, **factors: float) -> Settings:
        """Return a section with some of its values multiplied by a factor each."""
        return section.model_copy(update={name: getattr(section, name) * by for name, by in factors.items()})

    case = config.case.model_copy(
        update={
            "pressure": config.case.pressure * stress,
            "material": scaled(config.case.material, rho=density, E=stress),
            "sintering": scaled(
                config.case.sintering,
                rho_max=density,
                C1=1 / (stress * TIME),
                C2=TIME / LENGTH,
                C4=1 / stress,
                C5=1 / speed_up,
            ),
            "loading": scaled(config.case.loading, frame_time=TIME),
            "reading": scaled(config.case.reading, cell=LENGTH, gravity=speed_up),
        }
    )
    return config.model_copy(update={"case": case})


def simulate_mirrored(contact: str) -> tuple[State, State]:
    """Simulate two cases that should be mirror images; returns their last states, the second already mirrored back."""
    width = LOPSIDED[1][0]
    small = [*SHORT, "loading.press_frames=4", "loading.frames=26", "reading.drop_height=3", "reading.gravity=60"]
    small.append(f"reading.contact={contact}")
    flipped = [[width - x, y] for x, y in LOPSIDED]
    floors = (f"floor.outline.points={[list(corner) for corner in LOPSIDED]}", f"floor.outline.points={flipped}")
    one, other = (compose([*small, floor, f"floor.drop_x={x}"]) for floor, x in zip(floors, (90, 110), strict=True))
    scene = build_scene(one.case)
    image = dataclasses.replace(build_scene(other.case), positions=scene.positions * [-1, 1] + [width, 0])
    state, mirrored = (read_state(simulate_to_end(c, s)) for c, s in ((one, scene), (other, image)))
    mirrored["position"] = mirrored["position"] * [-1, 1] + [width, 0]
    mirrored["velocity"] = mirrored["velocity"] * [-1, 1]
    return state, mirrored


@functools.cache
def _simulate_short_case() -> tuple[xr.Dataset, dict[int, dict[str, np.ndarray]]]:
    """Simulate the short case that several checks use; returns its Dataset and its checkpoints by frame."""
    config, saved = compose(SHORT), {}

    def keep(progress: Progress) -> None:
        """Keep the checkpoints to go on from, and the last."""
        if progress.frame in (*RESTARTS, progress.frames):
            saved[progress.frame] = progress.checkpoint()

    return simulate(config, keep), saved


def _simulate_state(overrides: Sequence[str]) -> State:
    """Simulate a case and return its last state."""
    return read_state(simulate_to_end(compose(overrides)))


def _compute_angular_momentum(state: State) -> float:
    """Compute the angular momentum about the origin, at unit depth, of the particles and of their affine motion."""
    (x, y), (u, v), affine = state["position"].T, state["velocity"].T, state["affine"]
    return float((state["mass"] * (x * v - y * u + affine[:, 1, 0] - affine[:, 0, 1])).sum())


def _report_differences(name: str, differences: Sequence[str]) -> Finding:
    """Make the finding of a check in which nothing may differ, from the names of what does."""
    if not differences:
        return Finding(0, name, OK, "no bit differs", "none")
    return Finding(0, name, REGRESSED, f"{len(differences)} differ: {', '.join(differences[:3])}", "none")


# By name, which is told where a run diverges; cheapest first.
CHECKS = {
    "other seed": check_seed,
    "no pressure": check_no_pressure,
    "free fall": check_free_fall,
    "spin": check_spin,
    "momentum and energy": check_balances,
    "cadence": check_output,
    "threads": check_threads,
    "order": check_order,
    "mirror": check_mirror,
    "restart": check_restart,
    "units": check_units,
    "twice": check_repetition,
}
