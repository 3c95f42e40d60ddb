"""The external force b of the pressing stage, as an acceleration on each particle.

The paper draws arrows inward and prints neither direction nor size.  ``pressure`` is the pressure
that the force would build up at the centre of a disc of the snow's area, at rest: it fixes the size.
"""

import numpy as np

SHELL_CELLS = 2.0  # thickness of the pressed shell [cells]


def external_force(
    kind: str, positions: np.ndarray, depth: np.ndarray, pressure: float, rho: float, radius: float, shell: float
) -> np.ndarray:
    """Acceleration b (n, 2) on particles at ``positions`` (n, 2).

    ``depth`` (n,): distance below the surface at the start; ``radius``: of the disc of equal area;
    ``shell``: thickness of the pressed shell; all in length units, ``rho`` in mass / length^3.
    The centre pressure is the integral of rho |b| from the surface to the centre.
    """
    arm = positions - positions.mean(axis=0)
    if kind == "radial_linear":
        return -2.0 * pressure / (rho * radius) * arm / radius
    if kind == "two_sides":
        return -2.0 * pressure / (rho * radius) * arm * [0.0, 1.0] / radius
    inward = -arm / np.maximum(np.linalg.norm(arm, axis=1), 1e-12)[:, None]
    if kind == "radial_constant":
        return pressure / (rho * radius) * inward
    if kind == "shell":
        return pressure / (rho * shell) * inward * (depth < shell)[:, None]
    raise ValueError(f"no such press: {kind}")
