"""The whole substep as plain loops: what a hand-written Numba kernel reaches, and a second account of the algorithm.

The nine steps of the paper without its sintering update, one particle and one node at a time: serial,
f64, no fast math, nothing fused or blocked.  Contact is that of legacy Taichi.  Same order of sums as
snowrepro, so that both give the same positions up to the last digits of ``exp``.
"""

from math import ceil, exp, floor, sqrt
from typing import NamedTuple

import numba
import numpy as np

RUNNING, LEFT_GRID, BAD_STRAIN = range(3)
TINY = 1e-300
TOUCH = 1e-9  # a particle this near to the floor touches it [grid spacings]

# "numpy": division by zero gives inf, as elsewhere, instead of a check at each division.
compiled = numba.njit(error_model="numpy")


class Particles(NamedTuple):
    """State of n particles; lengths, masses and stresses in the units of the run."""

    position: np.ndarray  # (n, 2)
    velocity: np.ndarray  # (n, 2)
    affine: np.ndarray  # (n, 2, 2) APIC's B
    F_E: np.ndarray  # (n, 2, 2) elastic deformation gradient
    J_P: np.ndarray  # (n,) plastic volume ratio
    tau: np.ndarray  # (n, 3) Kirchhoff stress xx, xy, yy
    mass: np.ndarray  # (n,)
    volume: np.ndarray  # (n,) at the start
    mu: np.ndarray  # (n,) before hardening
    lam: np.ndarray  # (n,) before hardening
    hardening: np.ndarray  # (n,) xi
    force: np.ndarray  # (n, 2) external force as an acceleration


class Nodes(NamedTuple):
    """Grid of (nx, ny) nodes."""

    sums: np.ndarray  # (nx, ny, 3) mass, momentum x, momentum y
    velocity: np.ndarray  # (nx, ny, 2)
    distance: np.ndarray  # (nx, ny) to the floor
    normal: np.ndarray  # (nx, ny, 2) of the floor


class Constants(NamedTuple):
    """Constants of a run."""

    dx: float
    inertia: float  # D / dx^2
    cfl: float
    frame_time: float
    lowest_stretch: float
    highest_stretch: float
    lowest_exponent: float
    highest_exponent: float
    lowest_J_P: float
    highest_J_P: float
    friction: float


@compiled
def quadratic(x):
    """First node, offset from it, weights and slopes of three nodes at x, all in grid spacings."""
    base = floor(x - 0.5)
    f = x - base
    w = (0.5 * (1.5 - f) ** 2, 0.75 - (f - 1.0) ** 2, 0.5 * (f - 0.5) ** 2)
    return base, f, w, (f - 1.5, 2.0 - 2.0 * f, f - 0.5)


@compiled
def cubic(x):
    """The same for the four nodes of the cubic spline."""
    base = floor(x) - 1
    offset = x - base
    f = offset - 1.0
    g = 1.0 - f
    w = (g * g * g / 6.0, 2.0 / 3.0 - f * f + 0.5 * f * f * f, 2.0 / 3.0 - g * g + 0.5 * g * g * g, f * f * f / 6.0)
    return base, offset, w, (-0.5 * g * g, -2.0 * f + 1.5 * f * f, 2.0 * g - 1.5 * g * g, 0.5 * f * f)


SPLINES = {"quadratic": quadratic, "cubic": cubic}


@compiled
def advance_frame(particles, nodes, constants, spline, gravity, top_speed2):
    """Advance one frame.  Returns (status, substeps, largest particle speed squared)."""
    elapsed = 0.0
    substeps = 0
    while elapsed < constants.frame_time:
        status, wave_speed2 = update_stress(particles, constants)
        if status != RUNNING:
            return status, substeps, top_speed2
        status, low_x, high_x, low_y, high_y = box_in_use(particles, nodes, constants)
        if status != RUNNING:
            return status, substeps, top_speed2
        longest = constants.cfl * constants.dx / (sqrt(wave_speed2) + sqrt(top_speed2))
        remaining = constants.frame_time - elapsed
        count = max(1.0, ceil(remaining / longest))
        dt = remaining / count

        box = (low_x, high_x, low_y, high_y)
        nodes.sums[low_x:high_x, low_y:high_y] = 0.0
        particles_to_grid(particles, nodes, constants, spline, dt)
        node_velocities(nodes, constants, box, dt, gravity)
        top_speed2 = grid_to_particles(particles, nodes, constants, spline, dt)
        substeps += 1
        elapsed = constants.frame_time if count < 1.5 else elapsed + dt
    update_stress(particles, constants)
    return RUNNING, substeps, top_speed2


@compiled
def update_stress(particles, constants):
    """Clamp the stretches of the trial F_E, harden and store the stress.  Returns (status, wave speed squared)."""
    fastest = 0.0
    for p in range(len(particles.mass)):
        a, b = particles.F_E[p, 0, 0], particles.F_E[p, 0, 1]
        c, d = particles.F_E[p, 1, 0], particles.F_E[p, 1, 1]
        if not a * d - b * c > 0.0:
            return BAD_STRAIN, fastest
        # F = R S: rotation by (cos, sin), and the symmetric stretch.
        inverse = 1.0 / (sqrt((a + d) ** 2 + (c - b) ** 2) + TINY)
        cos, sin = (a + d) * inverse, (c - b) * inverse
        s_xx, s_xy, s_yy = cos * a + sin * c, cos * b + sin * d, -sin * b + cos * d
        mean, half = 0.5 * (s_xx + s_yy), 0.5 * (s_xx - s_yy)
        radius = sqrt(half * half + s_xy * s_xy)
        first, second = mean + radius, mean - radius
        first_clamped = min(max(first, constants.lowest_stretch), constants.highest_stretch)
        second_clamped = min(max(second, constants.lowest_stretch), constants.highest_stretch)
        if first_clamped != first or second_clamped != second:
            new_mean = 0.5 * (first_clamped + second_clamped)
            shrink = 0.5 * (first_clamped - second_clamped) / (radius + TINY)
            diagonal, shear = shrink * half, shrink * s_xy
            xx, yy = new_mean + diagonal, new_mean - diagonal
            a, b = cos * xx - sin * shear, cos * shear - sin * yy
            c, d = sin * xx + cos * shear, sin * shear + cos * yy
            particles.F_E[p, 0, 0], particles.F_E[p, 0, 1] = a, b
            particles.F_E[p, 1, 0], particles.F_E[p, 1, 1] = c, d
            J_P = particles.J_P[p] * (first * second / (first_clamped * second_clamped))
            particles.J_P[p] = min(max(J_P, constants.lowest_J_P), constants.highest_J_P)

        exponent = particles.hardening[p] * (1.0 - particles.J_P[p])
        h = exp(min(max(exponent, constants.lowest_exponent), constants.highest_exponent))
        mu, lam = h * particles.mu[p], h * particles.lam[p]
        # tau = 2 mu (F - R) F^T + lambda (J - 1) J
        J = a * d - b * c
        volumetric = lam * (J - 1.0) * J
        particles.tau[p, 0] = 2.0 * mu * ((a - cos) * a + (b + sin) * b) + volumetric
        particles.tau[p, 1] = 2.0 * mu * ((a - cos) * c + (b + sin) * d)
        particles.tau[p, 2] = 2.0 * mu * ((c - sin) * c + (d - cos) * d) + volumetric
        speed2 = (lam + 2.0 * mu) * particles.volume[p] / particles.mass[p]
        if not (speed2 > 0.0 and speed2 < 1e300):
            return BAD_STRAIN, fastest
        fastest = max(fastest, speed2)
    return RUNNING, fastest


@compiled
def box_in_use(particles, nodes, constants):
    """Status and the range of nodes that the particles reach, low to high along x and along y."""
    low_x, low_y, high_x, high_y = 1e300, 1e300, -1e300, -1e300
    for p in range(len(particles.mass)):
        x, y = particles.position[p, 0], particles.position[p, 1]
        low_x, high_x = min(low_x, x), max(high_x, x)
        low_y, high_y = min(low_y, y), max(high_y, y)
    nx, ny = nodes.distance.shape
    fits_x = low_x > 2.0 * constants.dx and high_x < (nx - 3) * constants.dx
    fits_y = low_y > 2.0 * constants.dx and high_y < (ny - 3) * constants.dx
    if not (fits_x and fits_y):
        return LEFT_GRID, 0, 0, 0, 0
    return (
        RUNNING,
        floor(low_x / constants.dx) - 2,
        floor(high_x / constants.dx) + 4,
        floor(low_y / constants.dx) - 2,
        floor(high_y / constants.dx) + 4,
    )


@compiled
def particles_to_grid(particles, nodes, constants, spline, dt):
    """Add mass, momentum with its affine part, and the impulse of stress and external force."""
    inverse_dx = 1.0 / constants.dx
    for p in range(len(particles.mass)):
        base_x, offset_x, wx, gx = spline(particles.position[p, 0] * inverse_dx)
        base_y, offset_y, wy, gy = spline(particles.position[p, 1] * inverse_dx)
        m = particles.mass[p]
        vx = particles.velocity[p, 0] + dt * particles.force[p, 0]
        vy = particles.velocity[p, 1] + dt * particles.force[p, 1]
        # Change of momentum from one node to the next: m B D^-1 dx.
        scale = m * inverse_dx / constants.inertia
        a_xx, a_xy = particles.affine[p, 0, 0] * scale, particles.affine[p, 0, 1] * scale
        a_yx, a_yy = particles.affine[p, 1, 0] * scale, particles.affine[p, 1, 1] * scale
        weight = dt * particles.volume[p]
        t_xx, t_xy, t_yy = particles.tau[p, 0] * weight, particles.tau[p, 1] * weight, particles.tau[p, 2] * weight
        for i in range(len(wx)):
            slope_x = gx[i] * inverse_dx
            even_x = wx[i] * (m * vx + a_xx * (i - offset_x)) - slope_x * t_xx
            even_y = wx[i] * (m * vy + a_yx * (i - offset_x)) - slope_x * t_xy
            lever_x, lever_y = wx[i] * a_xy, wx[i] * a_yy
            force_x, force_y = wx[i] * t_xy, wx[i] * t_yy
            mass = wx[i] * m
            for j in range(len(wy)):
                arm, slope_y = wy[j] * (j - offset_y), gy[j] * inverse_dx
                x, y = base_x + i, base_y + j
                nodes.sums[x, y, 0] += mass * wy[j]
                nodes.sums[x, y, 1] += even_x * wy[j] + lever_x * arm - force_x * slope_y
                nodes.sums[x, y, 2] += even_y * wy[j] + lever_y * arm - force_y * slope_y


@compiled
def node_velocities(nodes, constants, box, dt, gravity):
    """Velocity from momentum, gravity, and contact of the nodes: at rest inside the floor, friction just above."""
    for x in range(box[0], box[1]):
        for y in range(box[2], box[3]):
            m = nodes.sums[x, y, 0]
            if m > 0.0:
                vx, vy = nodes.sums[x, y, 1] / m, nodes.sums[x, y, 2] / m - dt * gravity
                if nodes.distance[x, y] <= 0.0:
                    vx, vy = 0.0, 0.0
                elif nodes.distance[x, y] < constants.dx:
                    vx, vy = slide(vx, vy, nodes.normal[x, y, 0], nodes.normal[x, y, 1], constants.friction)
                nodes.velocity[x, y, 0], nodes.velocity[x, y, 1] = vx, vy


@compiled
def slide(vx, vy, nx, ny, friction):
    """Coulomb contact: no motion into the floor, and friction up to its share of what was removed."""
    inward = vx * nx + vy * ny
    if inward >= 0.0:
        return vx, vy
    tx, ty = vx - inward * nx, vy - inward * ny
    kept = max(0.0, 1.0 + friction * inward / (sqrt(tx * tx + ty * ty) + TINY))
    return tx * kept, ty * kept


@compiled
def grid_to_particles(particles, nodes, constants, spline, dt):
    """Velocity, affine motion, trial F_E and position from the nodes.  Returns the largest speed squared."""
    inverse_dx = 1.0 / constants.dx
    top_speed2 = 0.0
    for p in range(len(particles.mass)):
        base_x, offset_x, wx, gx = spline(particles.position[p, 0] * inverse_dx)
        base_y, offset_y, wy, gy = spline(particles.position[p, 1] * inverse_dx)
        vx = vy = l_xx = l_xy = l_yx = l_yy = b_xx = b_xy = b_yx = b_yy = 0.0
        for i in range(len(wx)):
            sum_x = sum_y = slope_x = slope_y = moment_x = moment_y = 0.0  # of this column
            for j in range(len(wy)):
                node_x, node_y = nodes.velocity[base_x + i, base_y + j, 0], nodes.velocity[base_x + i, base_y + j, 1]
                slope, arm = gy[j] * inverse_dx, wy[j] * (j - offset_y)
                sum_x += wy[j] * node_x
                sum_y += wy[j] * node_y
                slope_x += slope * node_x
                slope_y += slope * node_y
                moment_x += arm * node_x
                moment_y += arm * node_y
            slope, arm = gx[i] * inverse_dx, wx[i] * (i - offset_x)
            vx += wx[i] * sum_x
            vy += wx[i] * sum_y
            l_xx += slope * sum_x
            l_yx += slope * sum_y
            l_xy += wx[i] * slope_x
            l_yy += wx[i] * slope_y
            b_xx += arm * sum_x
            b_yx += arm * sum_y
            b_xy += wx[i] * moment_x
            b_yy += wx[i] * moment_y

        a, b = particles.F_E[p, 0, 0], particles.F_E[p, 0, 1]
        c, d = particles.F_E[p, 1, 0], particles.F_E[p, 1, 1]
        particles.F_E[p, 0, 0] = a + dt * (l_xx * a + l_xy * c)
        particles.F_E[p, 0, 1] = b + dt * (l_xx * b + l_xy * d)
        particles.F_E[p, 1, 0] = c + dt * (l_yx * a + l_yy * c)
        particles.F_E[p, 1, 1] = d + dt * (l_yx * b + l_yy * d)
        particles.affine[p, 0, 0], particles.affine[p, 0, 1] = b_xx * constants.dx, b_xy * constants.dx
        particles.affine[p, 1, 0], particles.affine[p, 1, 1] = b_yx * constants.dx, b_yy * constants.dx

        x, y = particles.position[p, 0], particles.position[p, 1]
        if near_floor(x, y, nodes, constants.dx):
            distance, nx, ny = floor_at(x, y, nodes, constants.dx)
            if distance <= TOUCH * constants.dx:
                vx, vy = slide(vx, vy, nx, ny, constants.friction)
            distance, nx, ny = floor_at(x + dt * vx, y + dt * vy, nodes, constants.dx)
            if distance < 0.0:  # back to the surface
                x -= distance * nx
                y -= distance * ny
        particles.velocity[p, 0], particles.velocity[p, 1] = vx, vy
        particles.position[p, 0], particles.position[p, 1] = x + dt * vx, y + dt * vy
        top_speed2 = max(top_speed2, vx * vx + vy * vy)
    return top_speed2


@compiled
def cell_of(x, y, nodes, dx):
    """Lower left node of the cell around a point, kept on the grid."""
    nx, ny = nodes.distance.shape
    return max(0, min(floor(x / dx), nx - 2)), max(0, min(floor(y / dx), ny - 2))


@compiled
def near_floor(x, y, nodes, dx):
    """Whether the floor can be within reach."""
    i, j = cell_of(x, y, nodes, dx)
    return nodes.distance[i, j] < 2.0 * dx


@compiled
def floor_at(x, y, nodes, dx):
    """Distance to the floor and its normal at a point, bilinear between the nodes."""
    i, j = cell_of(x, y, nodes, dx)
    fx, fy = x / dx - i, y / dx - j
    distance = normal_x = normal_y = 0.0
    for k in range(2):
        for m in range(2):
            weight = (fx if k == 1 else 1.0 - fx) * (fy if m == 1 else 1.0 - fy)
            distance += weight * nodes.distance[i + k, j + m]
            normal_x += weight * nodes.normal[i + k, j + m, 0]
            normal_y += weight * nodes.normal[i + k, j + m, 1]
    length = sqrt(normal_x * normal_x + normal_y * normal_y) + TINY
    return distance, normal_x / length, normal_y / length


class NumbaSolver:
    """A simulation by the kernel above."""

    def __init__(self, start, spline: str):
        """Take over the start of a ``snow.Snow``."""
        count, size, constants = len(start.particles["mass"]), start.distance.shape, start.constants
        state = {**start.particles, "tau": np.zeros((count, 3))}
        self.particles = Particles(*(state[name].copy() for name in Particles._fields))
        self.nodes = Nodes(np.zeros((*size, 3)), np.zeros((*size, 2)), start.distance, start.normal)
        law = constants.material
        bounds = (law.lowest_stretch, law.highest_stretch, *law.hardening_exponent, *law.plastic_volume)
        self.constants = Constants(
            constants.dx, constants.inertia, constants.cfl, constants.frame_time, *bounds, constants.friction
        )
        self.spline = SPLINES[spline]
        self.top_speed2 = 0.0

    def advance_frame(self, gravity: float) -> int:
        """Advance one frame; returns its substeps."""
        status, substeps, self.top_speed2 = advance_frame(
            self.particles, self.nodes, self.constants, self.spline, gravity, self.top_speed2
        )
        if status != RUNNING:
            raise RuntimeError("a particle left the grid" if status == LEFT_GRID else "a strain is inverted")
        return substeps
