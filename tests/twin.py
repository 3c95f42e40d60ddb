"""A second, slow implementation of the method in NumPy, written from the paper and with other algorithms.

The rotation comes from a singular value decomposition, sums run over node loops, exp is NumPy's.
"""

import numpy as np


def stretches(F):
    """Singular value decomposition of one 2x2 matrix as proper rotations and signed stretches."""
    U, s, Vt = np.linalg.svd(F)
    if np.linalg.det(U) < 0:
        U[:, 1], s[1] = -U[:, 1], -s[1]
    if np.linalg.det(Vt) < 0:
        Vt[1], s[1] = -Vt[1], -s[1]
    return U, s, Vt


def clamp_plastic(F, J_P, lowest, highest, J_P_bounds=(0.1, 10.0)):
    """Stomakhin's return mapping: (F_E, new J_P)."""
    U, s, Vt = stretches(F)
    clamped = np.clip(s, lowest, highest)
    return U @ np.diag(clamped) @ Vt, np.clip(J_P * s.prod() / clamped.prod(), *J_P_bounds)


def hardening_factor(xi, J_P, low, high):
    """Eq. 1."""
    return np.exp(np.clip(xi * (1 - J_P), low, high))


def lame(E, nu):
    """mu, lambda of Sec. 3.2."""
    return E / (2 * (1 + nu)), nu * E / ((1 + nu) * (1 - 2 * nu))


def first_piola(F, mu, lam):
    """P = 2 mu (F - R) + lambda (J - 1) J F^-T."""
    U, _, Vt = stretches(F)
    J = np.linalg.det(F)
    return 2 * mu * (F - U @ Vt) + lam * (J - 1) * J * np.linalg.inv(F).T


def energy_density(F, mu, lam):
    """mu |F - R|^2 + lambda/2 (J - 1)^2 of many F (n, 2, 2), from their stretches."""
    s = np.linalg.svd(F, compute_uv=False)
    return mu * ((s - 1) ** 2).sum(axis=-1) + 0.5 * lam * (np.linalg.det(F) - 1) ** 2


def von_mises(F_E, J_P, mu, lam, plane_strain=True):
    """Eqs. 3 to 5, from the full 3x3 Cauchy stress."""
    J_E = np.linalg.det(F_E)
    sigma = np.zeros((3, 3))
    sigma[:2, :2] = first_piola(F_E, mu, lam) @ F_E.T / (J_E * J_P)
    if plane_strain:
        sigma[2, 2] = lam * (J_E - 1) * J_E / (J_E * J_P)
    deviator = sigma - np.trace(sigma) / 3 * np.eye(3)
    return np.sqrt(1.5 * (deviator**2).sum())


def spline(kind, r):
    """Value and slope of the B-spline at distance r from a node, in grid spacings."""
    a = abs(r)
    if kind == "cubic":
        if a < 1:
            return 0.5 * a**3 - a**2 + 2 / 3, np.sign(r) * (1.5 * a**2 - 2 * a)
        if a < 2:
            return (2 - a) ** 3 / 6, -np.sign(r) * (2 - a) ** 2 / 2
    else:
        if a < 0.5:
            return 0.75 - a**2, -2 * r
        if a < 1.5:
            return 0.5 * (1.5 - a) ** 2, -np.sign(r) * (1.5 - a)
    return 0.0, 0.0


def neighbours(kind, x, dx):
    """Nodes, weights and weight gradients of one particle."""
    reach = 2 if kind == "cubic" else 1.5
    centre = x / dx
    for i in range(int(np.ceil(centre[0] - reach)), int(np.floor(centre[0] + reach)) + 1):
        for j in range(int(np.ceil(centre[1] - reach)), int(np.floor(centre[1] + reach)) + 1):
            (wx, gx), (wy, gy) = spline(kind, centre[0] - i), spline(kind, centre[1] - j)
            yield (i, j), wx * wy, np.array([gx * wy, wx * gy]) / dx


def substep(state, size, dx, kind, dt, gravity, transfer="apic", flip=0.95):
    """One substep without floor and sintering on a dict of arrays; returns the new dict."""
    inertia = dx**2 * (1 / 3 if kind == "cubic" else 1 / 4)
    mass, momentum, old_momentum = np.zeros(size), np.zeros((*size, 2)), np.zeros((*size, 2))
    s = {name: values.copy() for name, values in state.items()}
    for p in range(len(s["mass"])):
        s["F_E"][p], s["J_P"][p] = clamp_plastic(s["F_E"][p], s["J_P"][p], 1 - 1e-2, 1 + 5e-3)
        h = hardening_factor(s["hardening"][p], s["J_P"][p], -16.118, 5)
        P = first_piola(s["F_E"][p], h * s["mu"][p], h * s["lam"][p])
        for node, w, gradient in neighbours(kind, s["position"][p], dx):
            arm = np.array(node) * dx - s["position"][p]
            velocity = s["velocity"][p] + s["affine"][p] @ arm / inertia
            mass[node] += w * s["mass"][p]
            old_momentum[node] += w * s["mass"][p] * velocity
            momentum[node] += w * s["mass"][p] * (velocity + dt * s["force"][p])
            slope = w * arm / inertia if transfer == "mls" else gradient
            momentum[node] -= dt * s["volume"][p] * P @ s["F_E"][p].T @ slope
    held = mass[..., None] > 0
    old_velocity = np.divide(old_momentum, mass[..., None], out=np.zeros_like(momentum), where=held)
    velocity = np.divide(momentum, mass[..., None], out=np.zeros_like(momentum), where=held)
    velocity[..., 1] -= dt * gravity
    for p in range(len(s["mass"])):
        v, change, grad, B = np.zeros(2), np.zeros(2), np.zeros((2, 2)), np.zeros((2, 2))
        for node, w, gradient in neighbours(kind, s["position"][p], dx):
            v += w * velocity[node]
            change += w * (velocity[node] - old_velocity[node])
            grad += np.outer(velocity[node], gradient)
            B += w * np.outer(velocity[node], np.array(node) * dx - s["position"][p])
        if transfer == "mls":
            grad = B / inertia
        if transfer == "pic_flip":
            v, B = (1 - flip) * v + flip * (s["velocity"][p] + change), np.zeros((2, 2))
        s["F_E"][p] = s["F_E"][p] + dt * grad @ s["F_E"][p]
        s["velocity"][p], s["affine"][p] = v, B
        s["position"][p] += dt * v
    return s
