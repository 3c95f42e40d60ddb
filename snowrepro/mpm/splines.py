"""B-spline weights of one axis: quadratic over three nodes, cubic over four.

Positions are in grid spacings.  ``stencil`` gives the first node and the offset of the particle
from it; ``weights`` and ``gradients`` the values and slopes at the nodes base, base + 1, ...
"""

from ..compiler import ti

NODES = {"quadratic": 3, "cubic": 4}
SIXTH = 1.0 / 6.0  # a product takes a fraction of a division's time
MOST_NODES = max(NODES.values())
INERTIA = {"quadratic": 1.0 / 4.0, "cubic": 1.0 / 3.0}  # D / dx^2 of Jiang et al. 2015


@ti.func
def stencil(position, spline: ti.template()):
    """Return (base, offset): first node of the support and position - base, both per axis.

    Positions are above 1, so that cast is floor, which would be a library call.
    """
    base = ti.cast(position - 0.5, ti.i32)
    if ti.static(spline == "cubic"):
        base = ti.cast(position, ti.i32) - 1
    return base, position - base


@ti.func
def weights(offset, spline: ti.template()):
    """Values of the spline at the nodes of one axis; they sum to one."""
    if ti.static(spline == "cubic"):
        f = offset - 1.0
        g = 1.0 - f
        return ti.Vector(
            [
                SIXTH * g * g * g,
                2.0 / 3.0 - f * f + 0.5 * f * f * f,
                2.0 / 3.0 - g * g + 0.5 * g * g * g,
                SIXTH * f * f * f,
            ]
        )
    else:
        f = offset
        return ti.Vector([0.5 * (1.5 - f) ** 2, 0.75 - (f - 1.0) ** 2, 0.5 * (f - 0.5) ** 2])


@ti.func
def gradients(offset, spline: ti.template()):
    """Slopes of the spline at the nodes of one axis, per grid spacing; they sum to zero."""
    if ti.static(spline == "cubic"):
        f = offset - 1.0
        g = 1.0 - f
        return ti.Vector([-0.5 * g * g, -2.0 * f + 1.5 * f * f, 2.0 * g - 1.5 * g * g, 0.5 * f * f])
    else:
        f = offset
        return ti.Vector([f - 1.5, 2.0 - 2.0 * f, f - 0.5])
