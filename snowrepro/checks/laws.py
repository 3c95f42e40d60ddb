"""Checks of a material law at points: rules that hold of any law, whatever its numbers.

Random points are led along random strains by the solver's own update, in and out of yield.  A law breaks a rule if its
stress is not symmetric or depends on who looks, if it makes work out of nothing, or if it is stiffer than it declares.
The finding then names the point where.
"""

from collections.abc import Iterator

import numpy as np

from ..mpm.point import Points
from ..mpm.solver import start_taichi
from ..settings.case import Case
from .finding import Finding, check_bound

COUNT, STEPS = 64, 1000
STEP = 1e-4  # standard deviation of the components of strain in a step, of the steady part and of the noise
ROUND_OFF = 1e-9  # part of the largest stress, or energy
MOST_UNCLOSED = 0.02  # part of the work turned over: the error of steps in strain
MOST_TANGENT = 1.1  # over the declared stiffness; the time step keeps a larger margin (solver.cfl)
PROBE = 1e-6  # strain by which a tangent is taken


def check_material(case: Case) -> Iterator[Finding]:
    """Check the material law of a case; one finding for each rule."""
    start_taichi(case.solver, threads=1)
    strains = _draw_strains(np.random.default_rng(0))
    points, gained, work = _follow(case, strains)
    yield _check_symmetry(points)
    yield _check_dissipation(points, gained)
    yield _check_closing(points, work)
    saved = points.save()
    yield _check_observer(points, saved, strains[-1])
    yield _check_tangent(points, saved)


def _draw_strains(rng: np.random.Generator) -> np.ndarray:
    """Strains (step, point, 2, 2), each point's with a direction that it keeps, and noise."""
    return rng.normal(0, STEP, (1, COUNT, 2, 2)) + rng.normal(0, STEP, (STEPS, COUNT, 2, 2))


def _follow(case: Case, strains: np.ndarray) -> tuple[Points, np.ndarray, np.ndarray]:
    """Lead points along strains.

    Returns them, what plastic flow and hardening gave to each in each step (step, point), and the work of the strain.
    """
    points, work = Points(case, strains.shape[1]), np.zeros(strains.shape[1])
    points.deform(np.eye(2))
    stress, given = points.stresses.copy(), [_read_given(points)]
    for strain in strains:
        points.deform(_exponential(strain))
        work += (0.5 * (stress + points.stresses) * strain).sum(axis=(1, 2))
        stress = points.stresses.copy()
        given.append(_read_given(points))
    return points, np.diff(given, axis=0), work


def _exponential(strain: np.ndarray) -> np.ndarray:
    """The exponential of small strains (point, 2, 2) to round-off: SciPy's takes a hundred times as long for many."""
    square = strain @ strain
    return np.eye(2) + strain + square / 2 + square @ strain / 6 + square @ square / 24


def _read_given(points: Points) -> np.ndarray:
    """The energy that plastic flow and hardening gave to each point so far."""
    return points.read("plastic_work") + points.read("hardening_work")


def _check_symmetry(points: Points) -> Finding:
    """Moments balance: tau_xy = tau_yx; no number is missing."""
    stress = points.stresses
    worst = np.abs(stress[:, 0, 1] - stress[:, 1, 0]) / np.abs(stress).max()
    return _report("symmetric stress", worst, ROUND_OFF, "of the largest stress", points)


def _check_observer(points: Points, saved: dict[str, np.ndarray], strain: np.ndarray) -> Finding:
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


def _check_dissipation(points: Points, gained: np.ndarray) -> Finding:
    """Plastic flow and hardening together give no energy, in any step."""
    worst = gained.max(axis=0) / points.energies.max()
    return _report("no energy by plastic flow", worst, ROUND_OFF, "of the largest elastic energy", points)


def _check_closing(points: Points, work: np.ndarray) -> Finding:
    """The work of the strain is stored, or was taken by plastic flow and hardening."""
    given = _read_given(points)
    unexplained = np.abs(points.energies - work - given)
    turned_over = np.abs(work) + np.abs(given) + points.energies
    return _report(
        "no work out of nothing", unexplained / turned_over, MOST_UNCLOSED, "of the work turned over", points
    )


def _check_tangent(points: Points, saved: dict[str, np.ndarray]) -> Finding:
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


def _report(name: str, values: np.ndarray, most: float, of: str, points: Points) -> Finding:
    """The finding of a rule from its value at each point (NaN fails), with the worst point where it is broken."""
    finite = np.where(np.isfinite(values), values, np.inf)
    worst = int(np.argmax(finite))
    strain = ", ".join(f"{value:.3g}" for value in points.read("F_E")[worst].ravel())
    found = check_bound(0, name, float(finite[worst]), most, of)
    note = f"at F_E = [{strain}], J_P = {points.read('J_P')[worst]:.3g}" if found.is_caught else ""
    return Finding(found.tier, found.name, found.state, found.measured, found.allowed, note)
