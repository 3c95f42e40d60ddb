"""Eq. 8: the moduli of snow at its maximum density, on which Eq. 7 rests; plain Python, without Taichi."""

import math


def maximum_moduli(E0: float, nu0: float, rho_r0: float, C3: float, as_printed: bool) -> tuple[float, float]:
    """Eq. 8: (E_max, nu_max) from the initial E0, nu0 and relative density rho_r0.

    The paper prints 3 - rho_r under the root of nu_max where Eq. 7 has 3 - 2 rho_r.  As printed,
    Eq. 7 does not return nu0 at rho_r0; ``as_printed=False`` uses Eq. 7's own denominator, so it does.
    """
    E_max = E0 / math.exp(C3 * (1.0 - rho_r0))
    denominator = 3.0 - rho_r0 if as_printed else 3.0 - 2.0 * rho_r0
    nu_max = nu0 / math.sqrt(rho_r0 / denominator)
    return E_max, nu_max
