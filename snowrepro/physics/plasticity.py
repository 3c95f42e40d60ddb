"""Stomakhin's plastic flow: stretches of F_E beyond [1 - theta_c, 1 + theta_s] become plastic."""

from ..compiler import ti
from .elasticity import TINY, clamp


@ti.func
def clamp_stretches(F, R, lowest, highest):
    """Return (F_E, ratio): F with its principal stretches clamped, and det F / det F_E.

    ``R`` is the rotation of F.  The stretch S = R^T F is symmetric, so its eigenvalues are closed
    forms.  F is rewritten only where the clamp acts: an elastic point keeps its bits.
    """
    S = R.transpose() @ F
    mean = 0.5 * (S[0, 0] + S[1, 1])
    half = 0.5 * (S[0, 0] - S[1, 1])
    radius = ti.sqrt(half * half + S[0, 1] * S[0, 1])
    first = mean + radius
    second = mean - radius
    first_clamped = clamp(first, lowest, highest)
    second_clamped = clamp(second, lowest, highest)
    yields = (first_clamped != first) | (second_clamped != second)

    new_mean = 0.5 * (first_clamped + second_clamped)
    shrink = 0.5 * (first_clamped - second_clamped) / (radius + TINY)
    diagonal = shrink * half
    shear = shrink * S[0, 1]
    clamped = R @ ti.Matrix([[new_mean + diagonal, shear], [shear, new_mean - diagonal]])
    ratio = ti.select(yields, (first * second) / (first_clamped * second_clamped), 1.0)
    F_E = F
    for i, j in ti.static(ti.ndrange(2, 2)):
        F_E[i, j] = ti.select(yields, clamped[i, j], F[i, j])
    return F_E, ratio
