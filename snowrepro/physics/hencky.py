"""Hencky elasticity: the Kirchhoff stress is linear in the logarithm of the stretch.

The energy for each unit of volume at the start is mu |eps|^2 + lambda/2 e^2, with eps = ln S, S the stretch and
e = tr eps.  Everything is of the plane: there is no strain out of it, and the deviator is eps - e/2.
In the plane the pressure is p = -(tau_1 + tau_2)/2 = -K e with K = lambda + mu, and q = (tau_1 - tau_2)/2, the largest
shear stress, is |dev tau| / sqrt(2): centre and radius of Mohr's circle.
"""

from ..compiler import ti
from .elasticity import EXP_RANGE, TINY, bounded_exp, clamp

LOG_RANGE = (1e-6, 1e6)  # that bounded_log is accurate for; beyond, it stays
_ROOTS = 4
_LOG_TERMS = 17
_POWER_PARTS = 4


@ti.func
def bounded_log(x):
    """ln(x) for x within LOG_RANGE, with the same bits on every CPU.

    The series of 2 artanh((x - 1) / (x + 1)) for x near 1, to round-off, and for other x that of the 16th root of x,
    with an absolute error below 3e-14.
    """
    bounded = clamp(x, LOG_RANGE[0], LOG_RANGE[1])
    root = bounded
    for _ in ti.static(range(_ROOTS)):
        root = ti.sqrt(root)
    is_near = (bounded > 0.5) & (bounded < 2.0)
    base = ti.select(is_near, bounded, root)
    z = (base - 1.0) / (base + 1.0)
    series = 0.0
    for k in ti.static(range(_LOG_TERMS, -1, -1)):
        series = series * (z * z) + 1.0 / (2 * k + 1)
    return ti.select(is_near, 2.0, 2.0 * 2**_ROOTS) * z * series


@ti.func
def bounded_power(x, exponent):
    """X to the power of ``exponent`` for x within LOG_RANGE, as long as |exponent ln x| < 4 EXP_RANGE."""
    part = clamp(exponent * bounded_log(x) * (1.0 / _POWER_PARTS), -EXP_RANGE, EXP_RANGE)
    root = bounded_exp(part)
    return (root * root) * (root * root)


@ti.func
def strain(F, R):
    """Split the stretch S = R^T F: (e, half, along, across).

    e = ln det S; ``half``: half the difference of the principal strains, so that |eps - e/2| = sqrt(2) half;
    ``along``, ``across``: the deviator is half [[along, across], [across, -along]].
    """
    S = R.transpose() @ F
    mean = 0.5 * (S[0, 0] + S[1, 1])
    difference = 0.5 * (S[0, 0] - S[1, 1])
    radius = ti.sqrt(difference * difference + S[0, 1] * S[0, 1])
    first = bounded_log(mean + radius)
    second = bounded_log(mean - radius)
    return first + second, 0.5 * (first - second), difference / (radius + TINY), S[0, 1] / (radius + TINY)


@ti.func
def deformation(e, half, along, across, R):
    """F = R exp(eps) of a strain split as ``strain`` does."""
    first = bounded_exp(clamp(0.5 * e + half, -EXP_RANGE, EXP_RANGE))
    second = bounded_exp(clamp(0.5 * e - half, -EXP_RANGE, EXP_RANGE))
    mean = 0.5 * (first + second)
    shear = 0.5 * (first - second)
    return R @ ti.Matrix([[mean + shear * along, shear * across], [shear * across, mean - shear * along]])


@ti.func
def kirchhoff_stress(F_E, R, mu, lam):
    """Tau = 2 mu eps + lambda e, turned from the body's axes to those of space."""
    e, half, along, across = strain(F_E, R)
    mean = (lam + mu) * e
    shear = 2.0 * mu * half
    tau = ti.Matrix([[mean + shear * along, shear * across], [shear * across, mean - shear * along]])
    return R @ tau @ R.transpose()


@ti.func
def energy_density(F_E, R, mu, lam):
    """Elastic energy for each unit of volume at the start: K/2 e^2 + 2 mu half^2."""
    e, half, _, _ = strain(F_E, R)
    return 0.5 * (lam + mu) * e * e + 2.0 * mu * half * half


@ti.func
def flow_work(F_E, F, R, mu, lam):
    """tau(F_E) times the plastic strain ln F - ln F_E; both have their principal axes in common."""
    e, half, _, _ = strain(F_E, R)
    trial_e, trial_half, _, _ = strain(F, R)
    return (lam + mu) * e * (trial_e - e) + 4.0 * mu * half * (trial_half - half)


@ti.func
def stiffness(tau, mu, lam):
    """P-wave modulus of stressed snow, lambda + 2 mu less the smallest principal stress where that is compression.

    A wave along axis 1 sees d tau_1 / d eps_1 - tau_1.
    """
    mean = 0.5 * (tau[0, 0] + tau[1, 1])
    difference = 0.5 * (tau[0, 0] - tau[1, 1])
    least = mean - ti.sqrt(difference * difference + tau[0, 1] * tau[0, 1])
    return lam + 2.0 * mu - ti.min(least, 0.0)
