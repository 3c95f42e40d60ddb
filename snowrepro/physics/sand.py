"""Drucker-Prager plasticity of Klar et al. (2016) in Hencky strain, with cohesion that softens.

    q <= sin(phi) (p + c)

with p and q of ``hencky``, of the plane: there the cone is Mohr and Coulomb's law exactly, phi is the angle of
internal friction, and c the isotropic tensile strength.  (Klar et al. match the cone to a triaxial test instead.)  Flow
keeps the volume.  What comes apart beyond the tip keeps no stress but c; its gain of volume is remembered as a gap,
which has to close before the snow bears pressure again, and no energy comes of that.
"""

from ..compiler import ti
from .elasticity import EXP_RANGE, bounded_exp, clamp

ROOT_2 = 1.4142135623730951  # |deviator| = sqrt(2) half


@ti.func
def cohesion(c, softening, broken):
    """C after plastic strain ``broken``: c exp(-softening broken)."""
    return c * bounded_exp(clamp(-softening * broken, -EXP_RANGE, EXP_RANGE))


@ti.func
def return_to_cone(e, half, gap, mu, K, sine, c):
    """Return (e, half, gap) of a trial strain after flow.

    Beyond the tip snow opens, at the tip's stress.  Under pressure a gap closes first, without stress.  Then shear goes
    to the cone at a constant e.
    """
    tip = c / K
    opened = ti.max(e - tip, 0.0)
    closed = ti.max(ti.min(gap, -e), 0.0)
    new_e = ti.min(e, tip) + closed
    new_half = ti.min(half, ti.max(sine * (c - K * new_e) / (2.0 * mu), 0.0))
    return new_e, new_half, gap + opened - closed
