"""What the finite time step makes of energy, substep by substep, by NumPy: see "Energy that the time step makes".

With I the impulse of stress and gravity on a node, v its velocity before (o) and after (n), V h psi the elastic energy:

strain  V h (psi(F*) - psi(F)) - dt V tau : grad v       F* is the trial strain of step 6
flow    V (h + h')/2 P(F') : (F* - F') - V h (psi(F*) - psi(F'))    F' is on the yield surface, h' is hardened
free    -1/2 I . (v_n - v_o)                             on nodes that the floor leaves alone
held    the same                                         on nodes that it changes
drift   -dt m g . (v - sum w v_n)                        of particles, which do not go with the nodes
"""

from collections.abc import Callable, Mapping

import numpy as np

from snowrepro.mpm import diagnostics
from snowrepro.mpm.frame import Frame, read_outcomes
from snowrepro.settings.case import Case
from tests import twin
from tests.validation.motion import Motion

PARTS = ("strain", "flow", "free", "held", "drift")


def follow(motion: Motion, case: Case, substeps: int) -> tuple[dict[str, float], list[dict[str, float]]]:
    """Fall for so many frames of one substep each: the sum of each of PARTS, and the diagnostics of each frame.

    ``case`` has the gravity; a substep before them yields and hardens, so that what is read is in use.
    """
    made = dict.fromkeys(PARTS, 0.0)
    first = case.loading.press_frames + 2  # behind the release, where motion may be taken
    motion.advance(gravity=case.reading.gravity)
    rows = [measure(motion, case, first, None)]
    for number in range(first + 1, first + 1 + substeps):
        before = {quantity.name: motion.read(quantity.name) for quantity in motion.particles.quantities}
        motion.advance(gravity=case.reading.gravity)
        for name, energy in find_parts(motion, case, before).items():
            made[name] += energy
        rows.append(measure(motion, case, number, rows[-1]))
        assert rows[-1]["substeps"] == 1
    return made, rows[1:]


def measure(motion: Motion, case: Case, number: int, before: Mapping[str, float] | None) -> dict[str, float]:
    """The diagnostics of the frame that ``motion`` is at the end of."""
    return diagnostics.measure(Frame(number, read_outcomes(motion.ledger)[0], motion.particles), case, before)


def find_parts(motion: Motion, case: Case, before: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Each of PARTS in the substep that ``motion`` just took from the state ``before``."""
    dt, gravity = motion.constants.frame_time, case.reading.gravity
    interpolated, gradient, used = gather(motion, before["position"])
    strain, flow = find_strain_and_flow(motion, before, gradient, dt)
    drift = dt * gravity * float(before["mass"] @ (motion.read("velocity") - interpolated)[:, 1])

    mass, sums, new = (getattr(motion.nodes, name).to_numpy()[used] for name in ("mass", "sums", "velocity"))
    old, impulse = sums[:, :2] / mass[:, None], sums[:, 2:] - mass[:, None] * [0.0, dt * gravity]
    pushed = old + impulse / mass[:, None]
    energy = -0.5 * (impulse * (new - old)).sum(axis=1)
    held = np.abs(new - pushed).max(axis=1) > 1e-12 * np.abs(pushed).max()
    return dict(zip(PARTS, (strain, flow, float(energy[~held].sum()), float(energy[held].sum()), drift), strict=True))


def gather(motion: Motion, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Node velocity (n, 2) and its gradient (n, 2, 2) at particles that were at ``positions``, and the nodes in use."""
    constants, velocity = motion.constants, motion.nodes.velocity.to_numpy()
    half = constants.nodes / 2
    base = np.floor(positions / constants.dx - half).astype(int) + 1
    spline: Callable = np.vectorize(lambda r: twin.spline(constants.spline, r), otypes=(float, float))
    w, slope = spline(positions[:, None] / constants.dx - (base[:, None] + np.arange(constants.nodes)[:, None]))
    interpolated, gradient = np.zeros_like(positions), np.zeros((len(positions), 2, 2))
    used = np.zeros(motion.nodes.size, dtype=bool)
    for i in range(constants.nodes):
        for j in range(constants.nodes):
            node = base[:, 0] + i, base[:, 1] + j
            used[node] |= w[:, i, 0] * w[:, j, 1] > 0
            interpolated += (w[:, i, 0] * w[:, j, 1])[:, None] * velocity[node]
            slopes = np.stack([slope[:, i, 0] * w[:, j, 1], w[:, i, 0] * slope[:, j, 1]], axis=-1) / constants.dx
            if constants.transfer == "mls":
                arm = np.stack(node, axis=-1) * constants.dx - positions
                slopes = (w[:, i, 0] * w[:, j, 1])[:, None] * arm / (constants.inertia * constants.dx**2)
            gradient += velocity[node][:, :, None] * slopes[:, None, :]
    return interpolated, gradient, used & (motion.nodes.mass.to_numpy() > 0)


def find_strain_and_flow(
    motion: Motion, before: Mapping[str, np.ndarray], gradient: np.ndarray, dt: float
) -> tuple[float, float]:
    """The parts of strain and of plastic flow, by the twin's energy and stress."""
    F, mu, lam, h = (before[name] for name in ("F_E", "mu", "lam", "factor"))
    trial, relaxed = F + dt * gradient @ F, motion.read("F_E")
    of_F, of_trial, of_relaxed = (h * twin.energy_density(each, mu, lam) for each in (F, trial, relaxed))
    power = (before["tau"] * gradient).sum(axis=(1, 2))
    P = find_first_piola(relaxed, mu, lam)
    booked = 0.5 * (h + motion.read("factor")) * (P * (trial - relaxed)).sum(axis=(1, 2))
    volume = before["volume"]
    return float(volume @ (of_trial - of_F - dt * power)), float(volume @ (booked - (of_trial - of_relaxed)))


def find_first_piola(F: np.ndarray, mu: np.ndarray, lam: np.ndarray) -> np.ndarray:
    """P = 2 mu (F - R) + lambda (J - 1) J F^-T of many F (n, 2, 2), with R from their singular value decomposition."""
    U, _, Vt = np.linalg.svd(F)
    J = np.linalg.det(F)
    inverse = np.linalg.inv(F).swapaxes(1, 2)
    return 2 * mu[:, None, None] * (F - U @ Vt) + (lam * (J - 1) * J)[:, None, None] * inverse
