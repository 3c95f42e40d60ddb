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
from .mpm.constants import Constants, make_constants
from .mpm.point import Points, sinter_once
from .mpm.solver import start_taichi
from .point import make_points
from .settings.case import Case
from .settings.laws import InstalledLaw

COUNT, STEPS = 64, 1000
STEP = 1e-4  # standard deviation of the components of strain in a step, of the steady part and of the noise
ROUND_OFF = 1e-9  # part of the largest stress, or energy
MOST_UNCLOSED = 0.02  # part of the work turned over: the error of steps in strain
MOST_TANGENT = 1.1  # over the declared stiffness; the time step keeps a larger margin (solver.cfl)
PROBE = 1e-6  # strain by which a tangent is taken
FAR_STOPS, FAR_STRIDES, FAR_STRIDE = 3, 50, 0.01  # on to a strain of 1.5, where tangents are taken too
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


@dataclass
class Worst:
    """Of each point the largest value so far (NaN is larger than any), and the state in which its step began."""

    values: np.ndarray
    state: State

    def note(self, values: np.ndarray, state: State) -> None:
        """Take what points (count,) have now, as far as it is larger."""
        values = np.where(np.isnan(values), np.inf, values)
        larger = values > self.values
        self.values = _choose(larger, values, self.values)
        self.state = {name: _choose(larger, state[name], old) for name, old in self.state.items()}


@dataclass
class Trial:
    """What points did along their strains.

    ``work`` of the strain; ``stress``: the largest; the worst steps of each point: ``uneven``, how far the stress is
    from symmetric, ``gained``, what plastic flow and hardening gave, and ``steepest``, how much the stress changed.
    Their states have the ``strain`` of the step too.
    """

    points: Points
    work: np.ndarray
    uneven: Worst
    gained: Worst
    steepest: Worst
    stress: float = 0.0


_lawful: set[tuple[Constants, str]] = set()  # what was tried in this process


def require_lawful(case: Case) -> None:
    """Try the laws of a case that are somebody else's.  Raises ConfigError where one breaks a rule, with the point."""
    settings = [part.model_dump(mode="json") for part in (case.material, case.sintering)]
    tried = (make_constants(case), json.dumps(settings, sort_keys=True))
    if tried in _lawful:
        return
    for kind, law in (("material", case.material.law), ("sintering", case.sintering.law)):
        if not isinstance(law, InstalledLaw):
            continue
        for each in try_material(case) if kind == "material" else try_sintering(case):
            if each.is_broken:
                raise ConfigError(
                    f"{kind} law '{law.name}' of {law.origin} is refused: {each.name}: {each.value:.2g} {each.of}, "
                    f"allowed {each.most:.2g}, {each.where}; 'snowrepro point --check' shows all rules"
                )
    _lawful.add(tried)


def try_material(case: Case) -> Iterator[Measured]:
    """Try the material law of a case; yields what was measured of each rule.

    Raises ConfigError for a wrong STATE, and where a law that is somebody else's fails.
    """
    _start(case)
    strains = _draw_strains(np.random.default_rng(0))
    with np.errstate(invalid="ignore", divide="ignore"):  # NaN breaks the first rule
        trial = _follow(case, strains)
        points = trial.points
        yield _try_symmetry(trial)
        yield _try_dissipation(trial)
        yield _try_closing(trial)
        saved = points.save()
        yield _try_observer(points, saved, strains[-1])
        yield _try_tangent(points, saved, strains.mean(axis=0))
        yield _try_continuity(trial, saved)


def _start(case: Case) -> None:
    """Start Taichi with 64 bits for a number: whether a law is right is no matter of the precision of a run."""
    start_taichi(case.solver.model_copy(update={"precision": "f64"}), threads=1)


def _draw_strains(rng: np.random.Generator) -> np.ndarray:
    """Strains (step, point, 2, 2), each point's with a direction that it keeps, and noise."""
    return rng.normal(0, STEP, (1, COUNT, 2, 2)) + rng.normal(0, STEP, (STEPS, COUNT, 2, 2))


def _follow(case: Case, strains: np.ndarray) -> Trial:
    """Lead points along strains."""
    count = strains.shape[1]
    points = make_points(case, count)
    state = _read_state(points, np.zeros_like(strains[0]))
    uneven, gained, steepest = (Worst(np.full(count, -np.inf), state) for _ in range(3))
    trial = Trial(points, np.zeros(count), uneven, gained, steepest)
    points.deform(np.eye(2))
    uneven.note(_measure_unevenness(points), state)
    for strain in strains:
        state = _read_state(points, strain)
        stress, given = points.stresses.copy(), _read_given(points)
        points.deform(_exponential(strain))
        trial.work += (0.5 * (stress + points.stresses) * strain).sum(axis=(1, 2))
        trial.stress = max(trial.stress, _find_largest(points.stresses))
        uneven.note(_measure_unevenness(points), state)
        gained.note(_read_given(points) - given, state)
        steepest.note(np.abs(points.stresses - stress).max(axis=(1, 2)), state)
    return trial


def _read_state(points: Points, strain: np.ndarray) -> State:
    """What a law finds in a step: the points' own state before it, and its strain."""
    names = ("F_E", "J_P", *(quantity.name for quantity in points.constants.material.STATE))
    return {**{name: points.read(name) for name in names}, "strain": strain}


def _exponential(strain: np.ndarray) -> np.ndarray:
    """The exponential of small strains (point, 2, 2) to round-off: SciPy's takes a hundred times as long for many."""
    square = strain @ strain
    return np.eye(2) + strain + square / 2 + square @ strain / 6 + square @ square / 24


def _read_given(points: Points) -> np.ndarray:
    """The energy that plastic flow and hardening gave to each point so far."""
    return points.read("plastic_work") + points.read("hardening_work")


def _find_largest(values: np.ndarray) -> float:
    """The largest size of what is finite."""
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))


def _measure_unevenness(points: Points) -> np.ndarray:
    """How far tau_xy and tau_yx of each point differ; NaN where a number is missing."""
    stress = points.stresses
    numbers = stress.sum(axis=(1, 2)) + points.energies + _read_given(points) + points.read("wave_speed2")
    return np.where(np.isfinite(numbers), np.abs(stress[:, 0, 1] - stress[:, 1, 0]), np.nan)


def _try_symmetry(trial: Trial) -> Measured:
    """Moments balance: tau_xy = tau_yx; no number is missing."""
    worst = trial.uneven
    return _report("symmetric stress", worst.values / trial.stress, ROUND_OFF, "of the largest stress", worst.state)


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
    off = np.abs(points.stresses - expected).max(axis=(1, 2)) / _find_largest(expected)
    return _report("no matter who looks", off, ROUND_OFF, "of the largest stress", saved)


def _try_dissipation(trial: Trial) -> Measured:
    """Plastic flow and hardening together give no energy, in any step."""
    worst = trial.gained
    share = worst.values / _find_largest(trial.points.energies)
    return _report("no energy by plastic flow", share, ROUND_OFF, "of the largest elastic energy", worst.state)


def _try_closing(trial: Trial) -> Measured:
    """The work of the strain is stored, or was taken by plastic flow and hardening."""
    points, work = trial.points, trial.work
    given = _read_given(points)
    unexplained = np.abs(points.energies - work - given)
    turned_over = np.abs(work) + np.abs(given) + points.energies
    state, of = points.save(), "of the work turned over"
    return _report("no work out of nothing", unexplained / turned_over, MOST_UNCLOSED, of, state, "on the way to")


def _try_tangent(points: Points, saved: State, strain: np.ndarray) -> Measured:
    """A P-wave is in no direction faster than declared, also where points are led on along a strain, far from rest."""
    worst = Worst(np.full(len(strain), -np.inf), saved)
    stride = _exponential(FAR_STRIDE * strain / np.linalg.norm(strain, axis=(1, 2), keepdims=True))
    state = saved
    for strides in (0, *[FAR_STRIDES] * FAR_STOPS):
        points.load(state, np.eye(2))
        for _ in range(strides):
            points.deform(stride)
        state = points.save()
        worst.note(_measure_tangent(points, state), state)
    return _report("tangent stiffness", worst.values, MOST_TANGENT, "of the declared", worst.state)


def _measure_tangent(points: Points, state: State) -> np.ndarray:
    """The largest d tau_nn / d eps_nn - tau_nn over the stiffness that the law declares in a state, of each point."""
    points.load(state, np.eye(2))
    points.deform(np.eye(2))
    base, stress = points.save(), points.stresses.copy()
    declared = base["wave_speed2"] * base["mass"] / base["volume"]
    worst = np.zeros(len(declared))
    for angle in np.arange(8) * np.pi / 8:
        normal = np.array([np.cos(angle), np.sin(angle)])
        before = normal @ stress @ normal
        for strain in (PROBE, -PROBE):
            points.load(base, np.eye(2))
            points.deform(np.eye(2) + strain * np.outer(normal, normal))
            tangent = (normal @ points.stresses @ normal - before) / strain - before
            worst = np.maximum(worst, tangent / declared)
    return np.where(declared > 0.0, worst, np.inf)


def _try_continuity(trial: Trial, saved: State) -> Measured:
    """Stress does not jump: the steepest step is halved again and again, and the steeper half is kept.

    A jump that is smaller than what a step of strain changes anyway is not seen.
    """
    points, steep = trial.points, dict(trial.steepest.state)
    strain = steep.pop("strain")
    low = {**saved, **steep}
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
    return _report("no jump of stress", steeper / trial.stress, MOST_JUMP, "of the largest stress", low)


def _choose(chosen: np.ndarray, yes: np.ndarray, no: np.ndarray) -> np.ndarray:
    """For each point the values of one of two arrays (point, ...)."""
    return np.where(chosen.reshape(-1, *[1] * (yes.ndim - 1)), yes, no)


def _report(name: str, values: np.ndarray, most: float, of: str, state: State, place: str = "at") -> Measured:
    """What was measured of a rule from its value at each point (NaN breaks it), with the worst point in its state."""
    finite = np.where(np.isfinite(values), values, np.inf)
    worst = int(np.argmax(finite))
    strain = ", ".join(f"{value:.3g}" for value in state["F_E"][worst].ravel())
    where = f"{place} F_E = [{strain}], J_P = {state['J_P'][worst]:.3g}"
    return Measured(name, float(finite[worst]), most, of, where)


def try_sintering(case: Case) -> Iterator[Measured]:
    """Try one update of the sintering law of a case over a table of densities, stresses and external forces."""
    _start(case)
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
