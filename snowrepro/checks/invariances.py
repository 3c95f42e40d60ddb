"""Tier 0: what must hold of any solver of these laws, whatever its numbers are.  Needs no reference."""

import dataclasses
import functools
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import xarray as xr

from ..composition import compose
from ..config import Config
from ..mpm import solver
from ..mpm.diagnostics import WORKS
from ..scene.build import build_scene
from ..simulation import Progress, simulate
from .cases import SHORT, State, by_start, differing, last_frame, whole_state
from .finding import OK, REGRESSED, Finding, within

FIXED_POINT = "solver.summation=fixed_point"
RESTARTS = (7, 20, 48)  # in mid-press, at the release, in the impact
LENGTH, MASS, TIME = 2.0**3, 2.0**-5, 2.0**-1  # other units: powers of two change no digit
ROUND_OFF = 1e-12  # of sums over some thousand particles and some hundred steps
LOPSIDED = ((0, 0), (200, 0), (200, 30.3), (140, 30.3), (100, 20.3), (70, 40.3), (60, 12.3), (0, 12.3))
MIRRORED = ("position", "velocity", "J_P", "hardening")
UNEXPLAINED = 0.06  # part of the energy that causes give and take, at the coarse steps of these runs


def twice() -> Finding:
    """The same configuration in this process and in a fresh one."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        other = pool.submit(_end_of, SHORT)
        _, saved = _short_run()
        found = [*differing(other.result(), saved[max(saved)])]
    return _same("same bits twice, in two processes", found)


def restart() -> Finding:
    """A run that goes on from a checkpoint, in mid-press, at the release and in the impact."""
    whole, saved = _short_run()
    found = []
    for frame in RESTARTS:
        resumed = simulate(compose(SHORT), resume=saved[frame])
        found += [f"{name} from frame {frame}" for name in whole.variables if not whole[name].equals(resumed[name])]
    return _same("same bits after a restart", found)


def threads() -> Finding:
    """Fixed-point sums do not depend on the number of threads."""
    one, two = (_end_of((*SHORT, FIXED_POINT, f"threads={count}")) for count in (1, 2))
    return _same("same bits on one thread and two (fixed point)", [*differing(one, two)])


def order() -> Finding:
    """Nor on the order of particles; without pressure, whose centre is a plain mean."""
    config = compose((*SHORT, FIXED_POINT, "pressure=0"))
    scene = build_scene(config)
    shuffle = np.random.default_rng(0).permutation(len(scene.positions))
    shuffled = dataclasses.replace(scene, positions=scene.positions[shuffle], depth=scene.depth[shuffle])
    states = [
        {name: values[by_start(s)] for name, values in whole_state(last_frame(config, s)).items()}
        for s in (scene, shuffled)
    ]
    return _same("same bits in any order of particles (fixed point)", [*differing(*states)])


def cadence() -> Finding:
    """What is stored, and how often, does not change what is simulated."""
    often, seldom = (simulate(compose((*SHORT, f"output.every={every}"))) for every in (1, 30))
    ends = [{str(n): d[n].values for n in d.data_vars if "frame" in d[n].dims} for d in (often, seldom)]
    return _same("same bits at any cadence of output", [*differing(*ends)])


def other_seed() -> Finding:
    """Another seed is other snow."""
    one, other = (build_scene(compose((*SHORT, f"seed={seed}"))).positions for seed in (0, 1))
    moved = float(np.mean(np.any(one != other, axis=1))) if one.shape == other.shape else 1.0
    state = OK if moved > 0.99 else REGRESSED
    return Finding(0, "another seed moves every particle", state, f"{moved:.0%} of them", "over 99%")


def units() -> Finding:
    """Lengths, masses and times in other units, by powers of two: the same digits."""
    config = compose(SHORT)
    here, there = (whole_state(last_frame(c)) for c in (config, in_other_units(config)))
    scales = {"position": LENGTH, "velocity": LENGTH / TIME, "young": MASS / LENGTH / TIME**2, "F_E": 1.0,
              "density": MASS / LENGTH**3, "hardening": 1.0, "von_mises": MASS / LENGTH / TIME**2}  # fmt: skip
    found = [*differing({n: here[n] * scale for n, scale in scales.items()}, {n: there[n] for n in scales})]
    return _same("same digits in units of other powers of two", found)


def mirror() -> Finding:
    """Ball on a lopsided floor, left and right swapped, up to and past the impact."""
    one, other = mirrored_runs("legacy")
    apart = max(float(np.abs(one[name] - other[name]).max()) for name in MIRRORED)
    return within(0, "a mirrored scene gives the mirrored run", apart, 1e-9, "apart at most, in any quantity")


def no_pressure() -> Finding:
    """Snow that nothing presses: the laws change neither density nor hardening, and moduli by round-off alone."""
    config = compose((*SHORT, "pressure=0", "loading.frames=20"))
    end, before = last_frame(config), config.material
    first = {"density": before.rho, "hardening": before.xi, "young": before.E, "poisson": before.nu}
    changed = max(float(np.abs(end.read(name) / value - 1.0).max()) for name, value in first.items())
    return within(0, "sintering without pressure changes nothing", changed, ROUND_OFF, "relative change")


def free_fall() -> Finding:
    """From release to touch the centre of mass falls as a stone does."""
    config = compose((*SHORT, "pressure=0", "reading.drop_height=30", "loading.frames=40"))  # out of the floor's reach
    run, gravity = simulate(config), config.reading.gravity
    time = run.time.values[21:] - run.time.values[20]
    speed = run.momentum_y.values[21:] / run.total_mass.values[21:]
    start = run.momentum_y.values[20] / run.total_mass.values[20]
    off = float(np.abs(speed - start + gravity * time).max() / (gravity * time[-1]))
    return within(0, "falls as a stone", off, ROUND_OFF, "of the speed")


def spin() -> Finding:
    """Snow that turns freely keeps its angular momentum, that of the affine motion included."""
    config = compose((*SHORT, "pressure=0", "sintering=none", "loading.frames=20"))
    rate, inertia = 0.5, solver.laws_of(config).inertia * config.dx**2
    first, *_ = solver.frames(config, build_scene(config))
    saved = first.checkpoint()
    arm = saved["position"] - saved["position"].mean(axis=0)
    turn = np.array([[0.0, -rate], [rate, 0.0]])
    saved |= {"velocity": arm @ turn.T, "affine": np.broadcast_to(turn * inertia, saved["affine"].shape)}
    before = _angular_momentum(saved)
    after = _angular_momentum(last_frame(config, resume=saved).checkpoint())
    return within(0, "angular momentum is kept", abs(after / before - 1.0), 1e-9, "lost, of all")


def momentum_and_energy() -> Finding:
    """Every frame's change of momentum has a cause, to round-off, and that of energy but for the steps in time."""
    run, _ = _short_run()
    scale = float(abs(run.momentum_y).max())
    lost = max(float(abs(run[f"unclosed_momentum_{axis}"]).max()) for axis in "xy") / scale
    mass = float(abs(run.total_mass / run.total_mass[0] - 1.0).max())
    turned_over = float(sum(abs(run[name]).sum() for name in WORKS))
    energy = float(abs(run.unclosed_energy).sum()) / turned_over
    found = within(0, "mass and momentum have a cause in each frame", max(lost, mass), ROUND_OFF, "without one")
    return found if energy <= UNEXPLAINED else within(0, found.name, energy, UNEXPLAINED, "of the energy without one")


def in_other_units(config: Config) -> Config:
    """The same run with lengths, masses and times in units that are 1/LENGTH, 1/MASS, 1/TIME as large."""
    stress, speed_up = MASS / LENGTH / TIME**2, LENGTH / TIME**2
    density = MASS / LENGTH**3

    def scaled(section, **factors):
        return section.model_copy(update={name: getattr(section, name) * by for name, by in factors.items()})

    return config.model_copy(
        update={
            "pressure": config.pressure * stress,
            "material": scaled(config.material, rho=density, E=stress),
            "sintering": scaled(
                config.sintering,
                rho_max=density,
                C1=1 / (stress * TIME),
                C2=TIME / LENGTH,
                C4=1 / stress,
                C5=1 / speed_up,
            ),
            "loading": scaled(config.loading, frame_time=TIME),
            "reading": scaled(config.reading, cell=LENGTH, gravity=speed_up),
        }
    )


def mirrored_runs(contact: str) -> tuple[State, State]:
    """The ends of two runs that should be each other's mirror image; the second is already mirrored back."""
    width = LOPSIDED[1][0]
    small = [*SHORT, "loading.press_frames=4", "loading.frames=26", "reading.drop_height=3", "reading.gravity=60"]
    small.append(f"reading.contact={contact}")
    flipped = [[width - x, y] for x, y in LOPSIDED]
    floors = (f"floor.outline.points={[list(corner) for corner in LOPSIDED]}", f"floor.outline.points={flipped}")
    one, other = (compose([*small, floor, f"floor.drop_x={x}"]) for floor, x in zip(floors, (90, 110), strict=True))
    scene = build_scene(one)
    image = dataclasses.replace(build_scene(other), positions=scene.positions * [-1, 1] + [width, 0])
    state, mirrored = (whole_state(last_frame(c, s)) for c, s in ((one, scene), (other, image)))
    mirrored["position"] = mirrored["position"] * [-1, 1] + [width, 0]
    mirrored["velocity"] = mirrored["velocity"] * [-1, 1]
    return state, mirrored


@functools.cache
def _short_run() -> tuple[xr.Dataset, dict[int, dict[str, np.ndarray]]]:
    """The short run that several checks look at, and its checkpoints by frame."""
    config, saved = compose(SHORT), {}

    def keep(progress: Progress) -> None:
        if progress.frame in (*RESTARTS, progress.frames):
            saved[progress.frame] = progress.checkpoint()

    return simulate(config, keep), saved


def _end_of(overrides: Sequence[str]) -> State:
    return whole_state(last_frame(compose(overrides)))


def _angular_momentum(state: State) -> float:
    """About the origin at unit depth: of the particles and of their affine motion."""
    (x, y), (u, v), affine = state["position"].T, state["velocity"].T, state["affine"]
    return float((state["mass"] * (x * v - y * u + affine[:, 1, 0] - affine[:, 0, 1])).sum())


def _same(name: str, found: Sequence[str]) -> Finding:
    """Nothing may differ."""
    if not found:
        return Finding(0, name, OK, "no bit differs", "none")
    return Finding(0, name, REGRESSED, f"{len(found)} differ: {', '.join(found[:3])}", "none")


# Cheapest first.
CHECKS = (
    other_seed, no_pressure, free_fall, spin, momentum_and_energy, cadence, threads, order, mirror, restart, units,
    twice,
)  # fmt: skip
