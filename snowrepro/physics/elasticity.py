"""Fixed corotated elasticity with Stomakhin's hardening (Eq. 1) and the von Mises stress (Eqs. 3 to 5).

Every function is a pure ``ti.func`` of one material point.  Matrices are (2, 2); stresses have the
unit of Young's modulus.  The closed form of the rotation replaces ``ti.svd``, which drops
off-diagonals below 1e-5 and so erases shear that comes in small increments.
"""

from ..compiler import ti

TINY = 1e-30  # keeps 0/0 out of the closed forms; far below any stretch, and held by f32
EXP_RANGE = 16.5  # |x| that bounded_exp is accurate for
_EXP_TERMS = 18
_EXP_HALVINGS = 4


@ti.func
def bounded_exp(x):
    """exp(x) for |x| <= EXP_RANGE, relative error below 1e-14.

    Only additions and multiplications: it vectorises, and gives the same bits on every CPU,
    which a call to the C library does not.  exp(x) = exp(x/16)^16, Taylor series inside.
    """
    y = x * (1.0 / 2**_EXP_HALVINGS)
    result = 1.0
    for k in ti.static(range(_EXP_TERMS, 0, -1)):
        result = 1.0 + y * result * (1.0 / k)
    for _ in ti.static(range(_EXP_HALVINGS)):
        result = result * result
    return result


@ti.func
def clamp(x, low, high):
    """Limit x to [low, high], without a branch."""
    raised = ti.select(x < low, low, x)
    return ti.select(raised > high, high, raised)


@ti.func
def lame_parameters(E, nu):
    """Lame parameters (mu, lambda) of Young's modulus E and Poisson's ratio nu (paper, Sec. 3.2)."""
    mu = E / (2.0 * (1.0 + nu))
    lam = nu * E / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return mu, lam


@ti.func
def hardening_factor(xi, J_P, lowest_exponent, highest_exponent):
    """Eq. 1: exp(xi (1 - J_P)), the factor on both Lame parameters, its exponent bounded."""
    return bounded_exp(clamp(xi * (1.0 - J_P), lowest_exponent, highest_exponent))


@ti.func
def polar_rotation(F):
    """Rotation R of the polar decomposition F = R S, in closed form for 2x2 with det F > 0."""
    a = F[0, 0] + F[1, 1]
    b = F[1, 0] - F[0, 1]
    inverse = 1.0 / (ti.sqrt(a * a + b * b) + TINY)
    c = a * inverse
    s = b * inverse
    return ti.Matrix([[c, -s], [s, c]])


@ti.func
def kirchhoff_stress(F_E, R, mu, lam):
    """Kirchhoff stress tau = P F^T = 2 mu (F_E - R) F_E^T + lambda (J_E - 1) J_E I (fixed corotated energy)."""
    J_E = F_E.determinant()
    volumetric = lam * (J_E - 1.0) * J_E
    return 2.0 * mu * (F_E - R) @ F_E.transpose() + ti.Matrix([[volumetric, 0.0], [0.0, volumetric]])


@ti.func
def energy_density(F_E, R, mu, lam):
    """Fixed corotated energy mu |F_E - R|^2 + lambda/2 (J_E - 1)^2 for each unit of volume at the start."""
    dilation = F_E.determinant() - 1.0
    return mu * (F_E - R).norm_sqr() + 0.5 * lam * dilation * dilation


@ti.func
def work_of_strain(F_E, R, dF, mu, lam):
    """P : dF for each unit of volume at the start, with P = 2 mu (F_E - R) + lambda (J_E - 1) J_E F_E^-T."""
    pressure = lam * (F_E.determinant() - 1.0)
    cofactor = ti.Matrix([[F_E[1, 1], -F_E[1, 0]], [-F_E[0, 1], F_E[0, 0]]])
    P = 2.0 * mu * (F_E - R) + pressure * cofactor
    return (P * dF).sum()


@ti.func
def kirchhoff_stress_zz(F_E, lam):
    """Kirchhoff stress out of the plane in plane strain, lambda (J_E - 1) J_E."""
    J_E = F_E.determinant()
    return lam * (J_E - 1.0) * J_E


@ti.func
def von_mises_stress(sigma, zz):
    """Eqs. 3 to 5: the scalar stress sigma_m of a Cauchy stress ``sigma`` in the plane and ``zz`` out of it."""
    xx, yy, xy = sigma[0, 0], sigma[1, 1], sigma[0, 1]
    vm1 = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2)  # Eq. 4
    vm2 = 3.0 * xy * xy  # Eq. 5; sigma_yz = sigma_zx = 0
    return ti.sqrt(vm1 + vm2)  # Eq. 3
