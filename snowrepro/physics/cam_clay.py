"""Cohesive Cam clay of Gaume et al. (2018): an ellipse in pressure p and shear q, with associated flow.

    y(p, q) = q^2 + M^2 (p + beta p_c) (p - p_c) <= 0

p and q are those of ``hencky``, of the plane: M is the slope of the critical state line q = M p there, the sine of an
angle of friction.  (In three dimensions, with q = sqrt(3/2) |dev tau|, the same line has a slope of about sqrt(3) M.)
y has no factor 1 + 2 beta on q^2, as in the code Matter: the ellipse is as high as M (1 + beta) p_c / 2.
"""

from ..compiler import ti
from .elasticity import EXP_RANGE, TINY, bounded_exp, clamp
from .hencky import bounded_log

NEWTON_STEPS = 12
LEAST_CAP = 1e-3  # of the first p_c: snow that came apart keeps this much, as an ellipse has to have a size


@ti.func
def yield_function(p, q, p_c, M, beta):
    """y(p, q), negative inside the ellipse [stress^2]."""
    return q * q + M * M * (p + beta * p_c) * (p - p_c)


@ti.func
def asinh(x):
    """Arsinh of x >= 0."""
    return bounded_log(x + ti.sqrt(x * x + 1.0))


@ti.func
def sinh(x):
    """Sinh of x, bounded as bounded_exp is."""
    power = bounded_exp(clamp(x, -EXP_RANGE, EXP_RANGE))
    return 0.5 * (power - 1.0 / power)


@ti.func
def cap_by_sinh(p_0, K, hardening, J_P):
    """p_c = K sinh(asinh(p_0 / K) - hardening ln J_P)."""
    p_c = K * sinh(asinh(p_0 / K) - hardening * bounded_log(J_P))
    return ti.max(p_c, LEAST_CAP * p_0)


@ti.func
def cap_by_exp(p_0, hardening, J_P):
    """p_c = p_0 exp(-hardening ln J_P)."""
    p_c = p_0 * bounded_exp(clamp(-hardening * bounded_log(J_P), -EXP_RANGE, EXP_RANGE))
    return ti.max(p_c, LEAST_CAP * p_0)


@ti.func
def return_to_ellipse(p, q, p_c, mu, K, M, beta):
    """Return (p, q) of a trial stress after associated flow at a constant p_c; inside the ellipse unchanged.

    With the plastic multiplier g the pressure goes to the ellipse's centre as 1 / (1 + 2 M^2 K g) and q to zero as
    1 / (1 + 2 mu g).  In 1 / sqrt(y + height^2), which is concave in g and nearly linear, Newton's steps from g = 0
    never go too far.
    """
    centre = 0.5 * (1.0 - beta) * p_c
    height = 0.5 * (1.0 + beta) * M * p_c
    a, b = 2.0 * mu, 2.0 * M * M * K
    off = M * (p - centre)
    g = 0.0
    for _ in range(NEWTON_STEPS):
        u, v = 1.0 / (1.0 + a * g), 1.0 / (1.0 + b * g)
        square = q * u * q * u + off * v * off * v + TINY
        slope = (a * q * u * q * u * u + b * off * v * off * v * v) / square + TINY
        g = ti.max(0.0, g + (ti.sqrt(square) / height - 1.0) / slope)
    yields = yield_function(p, q, p_c, M, beta) > 0.0
    new_p = ti.select(yields, centre + (p - centre) / (1.0 + b * g), p)
    new_q = ti.select(yields, q / (1.0 + a * g), q)
    return new_p, new_q
