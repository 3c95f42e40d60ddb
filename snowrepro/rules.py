"""Rules that hold of any law, whatever its numbers, tried at points by the solver's own update.

Random points are led along random strains, in and out of yield.  A material law breaks a rule if its stress is not
symmetric, depends on who looks or jumps, if it makes work out of nothing, or if it is stiffer than it declares.  A
sintering law breaks one if it leaves what the solver can go on with.  What is measured then names the point where.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .errors import ConfigError
from .mpm.ledger import meaning
from .mpm.point import Points, sinter_once
from .mpm.solver import start_taichi
from .mpm.state import SHAPES
from .settings.case import Case
from .settings.laws import InstalledLaw

COUNT, STEPS = 64, 1000
STEP = 1e-4  # standard deviation of the components of strain in a step, of the steady part and of the noise
ROUND_OFF = 1e-9  # part of the largest stress, or energy
MOST_UNCLOSED = 0.02  # part of the work turned over: the error of steps in strain
MOST_TANGENT = 1.1  # over the declared stiffness; the time step keeps a larger margin (solver.cfl)
PROBE = 1e-6  # strain by which a tangent is taken
HALVINGS = 20  # of the step in which the stress changed most: a millionth of it is left
MOST_JUMP = 1e-3  # part of the largest stress, over that millionth
DENSITIES, STRESSES, FORCES = 12, (0.0, 1.0, 1e2, 1e4, 1e6), (0.0, 1.0, 1e3)  # of the table of a sintering law

State = dict[str, np.ndarray]


@dataclass(frozen=True)
class Measured:
    """A rule, and how far it is from being broken.

    ``value`` must not exceed ``most``; ``of``: their unit and meaning; ``where``: the worst point, in words.
    """

    name: str
    value: float
    most: float
    of: str
    where: str

    @property
    def is_broken(self) -> bool:
        """Whether the rule is broken; NaN breaks it."""
        return not self.value <= self.most


@dataclass(frozen=True)
class Trial:
    """What points did along their strains.

    ``gained``: what plastic flow and hardening gave in each step (step, point); ``work`` of the strain; of each point's
    steepest step the state ``before`` it and its ``strain``.
    """

    points: Points
    gained: np.ndarray
    work: np.ndarray
    before: State
    strain: np.ndarray


_lawful: set[str] = set()  # what was tried in this process


def require_lawful(case: Case) -> None:
    """Try the laws of a case that are somebody else's.  Raises ConfigError where one breaks a rule, with the point."""
    laws = {"material": case.material.law, "sintering": case.sintering.law}
    own = {kind: law for kind, law in laws.items() if isinstance(law, InstalledLaw)}
    tried = json.dumps({kind: getattr(case, kind).model_dump(mode="json") for kind in own}, sort_keys=True)
    if tried in _lawful:
        return
    for kind, law in own.items():
        with np.errstate(invalid="ignore"):  # NaN breaks the first rule
            for each in try_material(case) if kind == "material" else try_sintering(case):
                if each.is_broken:
                    raise ConfigError(
                        f"{kind} law '{law.name}' of {law.origin} is refused: {each.name}: {each.value:.2g} {each.of}, "
                        f"allowed {each.most:.2g}, {each.where}; 'snowrepro point --check' shows all rules"
                    )
    _lawful.add(tried)


def try_material(case: Case) -> Iterator[Measured]:
    """Try the material law of a case; yields what was measured of each rule.  Raises ConfigError for a wrong STATE."""
    start_taichi(case.solver, threads=1)
    strains = _draw_strains(np.random.default_rng(0))
    trial = _follow(case, strains)
    points = trial.points
    yield _try_symmetry(points)
    yield _try_dissipation(points, trial.gained)
    yield _try_closing(points, trial.work)
    saved = points.save()
    yield _try_observer(points, saved, strains[-1])
    yield _try_tangent(points, saved)
    yield _try_continuity(trial, saved)


def _draw_strains(rng: np.random.Generator) -> np.ndarray:
    """Strains (step, point, 2, 2), each point's with a direction that it keeps, and noise."""
    return rng.normal(0, STEP, (1, COUNT, 2, 2)) + rng.normal(0, STEP, (STEPS, COUNT, 2, 2))


def _follow(case: Case, strains: np.ndarray) -> Trial:
    """Lead points along strains."""
    points, work = _make_points(case, strains.shape[1]), np.zeros(strains.shape[1])
    points.deform(np.eye(2))
    stress, given = points.stresses.copy(), [_read_given(points)]
    kept = ("F_E", "J_P", *(quantity.name for quantity in points.constants.material.STATE))
    before, steepest, steep = {name: points.read(name) for name in kept}, np.zeros(len(work)), strains[0].copy()
    for strain in strains:
        state = {name: points.read(name) for name in kept}
        points.deform(_exponential(strain))
        change = np.abs(points.stresses - stress).max(axis=(1, 2))
        work += (0.5 * (stress + points.stresses) * strain).sum(axis=(1, 2))
        stress = points.stresses.copy()
        given.append(_read_given(points))
        larger = change > steepest
        steepest[larger], steep[larger] = change[larger], strain[larger]
        for name in kept:
            before[name][larger] = state[name][larger]
    return Trial(points, np.diff(given, axis=0), work, before, steep)


def _make_points(case: Case, count: int) -> Points:
    """Points of the case's material.  Raises ConfigError where its law's quantities have names that are taken."""
    points = Points(case, count)
    taken = {*SHAPES, *meaning(case), "frame", "time", "snapshot", "axis"}
    if wrong := [quantity.name for quantity in points.constants.material.STATE if quantity.name in taken]:
        raise ConfigError(
            f"material law '{case.material.law.name}': STATE has names that are taken: {', '.join(wrong)}"
        )
    return points


def _exponential(strain: np.ndarray) -> np.ndarray:
    """The exponential of small strains (point, 2, 2) to round-off: SciPy's takes a hundred times as long for many."""
    square = strain @ strain
    return np.eye(2) + strain + square / 2 + square @ strain / 6 + square @ square / 24


def _read_given(points: Points) -> np.ndarray:
    """The energy that plastic flow and hardening gave to each point so far."""
    return points.read("plastic_work") + points.read("hardening_work")


def _try_symmetry(points: Points) -> Measured:
    """Moments balance: tau_xy = tau_yx; no number is missing."""
    stress = points.stresses
    worst = np.abs(stress[:, 0, 1] - stress[:, 1, 0]) / np.abs(stress).max()
    return _report("symmetric stress", worst, ROUND_OFF, "of the largest stress", points)


def _try_observer(points: Points, saved: State, strain: np.ndarray) -> Measured:
    """A turned body has the turned stress, also in a step that yields."""
    angle = np.linspace(0.1, 6.0, len(strain))
    Q = np.moveaxis(np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]), -1, 0)
    back = np.swapaxes(Q, 1, 2)
    points.load(saved, np.eye(2))
    points.deform(_exponential(strain))
    expected = Q @ points.stresses @ back
    points.load(saved, Q)
    points.deform(Q @ _exponential(strain) @ back)
    off = np.abs(points.stresses - expected).max(axis=(1, 2)) / np.abs(expected).max()
    return _report("no matter who looks", off, ROUND_OFF, "of the largest stress", points)


def _try_dissipation(points: Points, gained: np.ndarray) -> Measured:
    """Plastic flow and hardening together give no energy, in any step."""
    worst = gained.max(axis=0) / points.energies.max()
    return _report("no energy by plastic flow", worst, ROUND_OFF, "of the largest elastic energy", points)


def _try_closing(points: Points, work: np.ndarray) -> Measured:
    """The work of the strain is stored, or was taken by plastic flow and hardening."""
    given = _read_given(points)
    unexplained = np.abs(points.energies - work - given)
    turned_over = np.abs(work) + np.abs(given) + points.energies
    return _report(
        "no work out of nothing", unexplained / turned_over, MOST_UNCLOSED, "of the work turned over", points
    )


def _try_tangent(points: Points, saved: State) -> Measured:
    """A P-wave is in no direction faster than declared: d tau_nn / d eps_nn - tau_nn over the law's stiffness."""
    points.load(saved, np.eye(2))
    points.deform(np.eye(2))
    base, stress = points.save(), points.stresses.copy()
    declared = base["wave_speed2"] * base["mass"] / base["volume"]
    worst = np.zeros(COUNT)
    for angle in np.arange(8) * np.pi / 8:
        normal = np.array([np.cos(angle), np.sin(angle)])
        before = normal @ stress @ normal
        for strain in (PROBE, -PROBE):
            points.load(base, np.eye(2))
            points.deform(np.eye(2) + strain * np.outer(normal, normal))
            tangent = (normal @ points.stresses @ normal - before) / strain - before
            worst = np.maximum(worst, tangent / declared)
    return _report("tangent stiffness", worst, MOST_TANGENT, "of the declared", points)


def _try_continuity(trial: Trial, saved: State) -> Measured:
    """Stress does not jump: the steepest step is halved again and again, and the steeper half is kept.

    A jump that is smaller than what a step of strain changes anyway is not seen.
    """
    points, strain = trial.points, trial.strain
    low, largest = {**saved, **trial.before}, np.abs(points.stresses).max()
    points.load(low, np.eye(2))
    points.deform(np.eye(2))
    low, low_stress = points.save(), points.stresses.copy()
    steeper = np.zeros(len(strain))
    for _ in range(HALVINGS):
        strain = 0.5 * strain
        points.load(low, np.eye(2))
        points.deform(_exponential(strain))
        middle, middle_stress = points.save(), points.stresses.copy()
        points.deform(_exponential(strain))
        first, second = (
            np.abs(a - b).max(axis=(1, 2)) for a, b in ((middle_stress, low_stress), (points.stresses, middle_stress))
        )
        later = second > first
        low = {name: _choose(later, middle[name], values) for name, values in low.items()}
        low_stress, steeper = _choose(later, middle_stress, low_stress), np.maximum(first, second)
    points.load(low, np.eye(2))
    return _report("no jump of stress", steeper / largest, MOST_JUMP, "of the largest stress", points)


def _choose(chosen: np.ndarray, yes: np.ndarray, no: np.ndarray) -> np.ndarray:
    """For each point the values of one of two arrays (point, ...)."""
    return np.where(chosen.reshape(-1, *[1] * (yes.ndim - 1)), yes, no)


def _report(name: str, values: np.ndarray, most: float, of: str, points: Points) -> Measured:
    """What was measured of a rule from its value at each point (NaN breaks it), with the worst point."""
    finite = np.where(np.isfinite(values), values, np.inf)
    worst = int(np.argmax(finite))
    strain = ", ".join(f"{value:.3g}" for value in points.read("F_E")[worst].ravel())
    where = f"at F_E = [{strain}], J_P = {points.read('J_P')[worst]:.3g}"
    return Measured(name, float(finite[worst]), most, of, where)


def try_sintering(case: Case) -> Iterator[Measured]:
    """Try one update of the sintering law of a case over a table of densities, stresses and external forces."""
    start_taichi(case.solver, threads=1)
    densities = np.linspace(case.material.rho, case.sintering.rho_max, DENSITIES)
    rho, sigma, b = (each.ravel() for each in np.meshgrid(densities, STRESSES, FORCES, indexing="ij"))
    new_rho, E, nu, xi = sinter_once(case, rho, sigma, b)

    def report(name: str, sound: np.ndarray) -> Measured:
        """How many points are not sound, and the first of them."""
        worst = int(np.argmin(sound))
        where = f"at a density of {rho[worst]:.4g}, a stress of {sigma[worst]:.3g}, a force of {b[worst]:.3g}"
        return Measured(name, float((~sound).sum()), 0.0, f"of {len(rho)} points where not", where)

    yield report("snow does not become lighter, nor denser than rho_max", (new_rho >= rho) & (new_rho <= _above(case)))
    yield report("Young's modulus is positive", (E > 0) & np.isfinite(E))
    yield report("Poisson's ratio is from 0 to below 0.5", (nu >= 0) & (nu < 0.5))
    yield report("xi is not negative", (xi >= 0) & np.isfinite(xi))


def _above(case: Case) -> float:
    """The maximum density, and round-off."""
    return case.sintering.rho_max * (1.0 + ROUND_OFF)
