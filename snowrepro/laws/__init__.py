"""The laws that a case can choose, as pure functions of one material point.

A **material** law says what a strain does: return mapping, hardening, stress, energy, stiffness.  A **sintering** law
says what pressing does to the material's parameters: density, Young's modulus, Poisson's ratio and xi.  Each law is a
frozen dataclass: its fields are numbers that kernels are compiled for, its methods are ``ti.func``.

A material law has ``STATE``, the quantities that it keeps of each particle beside J_P, and:

=========================================  ============================================================
``relax(F, R, state, mu, lam, xi)``        return mapping: (F_E, state) of the trial strain F
``factor(J_P, xi)``                        what mu and lam are multiplied by in all that follows
``stress(F_E, R, mu, lam)``                Kirchhoff stress tau, (2, 2)
``stress_zz(F_E, mu, lam)``                its part out of the plane, in plane strain
``energy(F_E, R, mu, lam)``                elastic energy for each unit of volume at the start
``flow_work(F_E, F, R, mu, lam)``          stress at F_E times the plastic strain from F to F_E, likewise
``stiffness(F_E, tau, mu, lam)``           P-wave modulus that the time step rests on [unit of mu]
=========================================  ============================================================

``R`` is the rotation of F, and of F_E: plastic flow does not turn an isotropic body.  ``state`` is a vector: J_P, and
then the quantities of ``STATE`` in their order.  ``xi`` is Eq. 9's, which stands for how far the snow has sintered.

A sintering law has ``advance(rho, xi, sigma_m, b_norm, time_step, weight)``, which gives (rho, E, nu, xi) after one
update: ``sigma_m`` is the von Mises stress, ``b_norm`` the external force, ``weight`` what of Eq. 9's growth the update
stands for.

The nine steps call these and know no law.
"""
