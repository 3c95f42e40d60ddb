"""The same substep in NVIDIA Warp, on the CPU: one kernel a stage, sums to the grid by atomics, Warp's way.

As in snowrepro: clamp of the stretches, hardening, APIC transfer, gravity, contact of nodes and particles.
Other than there: the time step is fixed, so no largest speed is sought, and all nodes of the grid are cleared
and updated instead of the box in use.  No sintering.
"""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

wp.config.quiet = True
wp.config.enable_backward = False

SUBSTEPS = 50  # a frame of the benchmark's snow: no longer steps than snowrepro's shortest


@dataclass(frozen=True)
class Stages:
    """The compiled kernels of one spline and precision."""

    stress: wp.Kernel
    particles_to_grid: wp.Kernel
    node_velocities: wp.Kernel
    grid_to_particles: wp.Kernel


# Warp's own literals are f32: every number in a kernel is made by ``real``.
TINY = 1e-30  # keeps 0/0 out, in f32 too


@functools.cache
def make_types(real: type) -> tuple[type, type, type]:
    """Make the types of two and three numbers and of a matrix of 2 by 2, in ``wp.float32`` or ``wp.float64``."""
    return wp.types.vector(2, real), wp.types.vector(3, real), wp.types.matrix((2, 2), real)


def make_stages(spline: str, real: type) -> Stages:
    """Make the kernels for ``quadratic`` or ``cubic`` in ``wp.float32`` or ``wp.float64``."""
    weights = make_cubic(real) if spline == "cubic" else make_quadratic(real)
    count = 4 if spline == "cubic" else 3
    slide, floor_at = make_contact(real)
    return Stages(
        make_stress(real),
        make_particles_to_grid(real, weights, count),
        make_node_velocities(real, slide),
        make_grid_to_particles(real, weights, count, slide, floor_at),
    )


def make_quadratic(real: type) -> Any:
    """Make the spline's function: of x to first node, weights, slopes, distances from x, in grid spacings."""
    per_axis = wp.types.vector(3, real)

    @wp.func
    def quadratic(x: real):
        base = int(wp.floor(x - real(0.5)))
        f = x - real(base)
        a, b, c = real(1.5) - f, f - real(1.0), f - real(0.5)
        w = per_axis(real(0.5) * a * a, real(0.75) - b * b, real(0.5) * c * c)
        return base, w, per_axis(-a, real(-2.0) * b, c), per_axis(-f, real(1.0) - f, real(2.0) - f)

    return quadratic


def make_cubic(real: type) -> Any:
    """Make the same function of the cubic spline."""
    per_axis = wp.types.vector(4, real)
    sixth, third2 = real(1.0 / 6.0), real(2.0 / 3.0)

    @wp.func
    def cubic(x: real):
        base = int(wp.floor(x)) - 1
        f = x - real(base) - real(1.0)
        g = real(1.0) - f
        half = real(0.5)
        w = per_axis(
            g * g * g * sixth, third2 - f * f + half * f * f * f, third2 - g * g + half * g * g * g, f * f * f * sixth
        )
        slopes = per_axis(
            -half * g * g,
            real(-2.0) * f + real(1.5) * f * f,
            real(2.0) * g - real(1.5) * g * g,
            half * f * f,
        )
        return base, w, slopes, per_axis(real(-1.0) - f, -f, g, real(1.0) + g)

    return cubic


def make_contact(real: type) -> tuple[Any, Any]:
    """Make two functions: what contact leaves of a velocity, and distance and normal of the floor at a place."""
    vec2, _, _ = make_types(real)
    tiny = real(TINY)

    @wp.func
    def slide(velocity: vec2, normal: vec2, friction: real):
        inward = wp.dot(velocity, normal)
        result = velocity
        if inward < real(0.0):
            tangential = velocity - inward * normal
            kept = real(1.0) + friction * inward / (wp.length(tangential) + tiny)
            result = tangential * wp.max(real(0.0), kept)
        return result

    @wp.func
    def floor_at(position: vec2, distance: wp.array2d(dtype=real), normal: wp.array2d(dtype=vec2), dx: real):
        i = wp.clamp(int(wp.floor(position[0] / dx)), 0, distance.shape[0] - 2)
        j = wp.clamp(int(wp.floor(position[1] / dx)), 0, distance.shape[1] - 2)
        fx, fy = position[0] / dx - real(i), position[1] / dx - real(j)
        gx, gy = real(1.0) - fx, real(1.0) - fy
        d = gx * (gy * distance[i, j] + fy * distance[i, j + 1])
        d += fx * (gy * distance[i + 1, j] + fy * distance[i + 1, j + 1])
        n = gx * (gy * normal[i, j] + fy * normal[i, j + 1]) + fx * (gy * normal[i + 1, j] + fy * normal[i + 1, j + 1])
        return d, n / (wp.length(n) + tiny)

    return slide, floor_at


def make_stress(real: type) -> wp.Kernel:
    """Make the kernel that clamps the stretches, hardens, and stores the stress."""
    vec2, _, mat22 = make_types(real)
    tiny = real(TINY)

    @wp.kernel(module="unique")
    def stress(
        F_E: wp.array(dtype=mat22),
        J_P: wp.array(dtype=real),
        tau: wp.array(dtype=mat22),
        mu_0: wp.array(dtype=real),
        lam_0: wp.array(dtype=real),
        hardening: wp.array(dtype=real),
        stretches: vec2,
        exponents: vec2,
        plastic_volume: vec2,
    ):
        p = wp.tid()
        F = F_E[p]
        a, b = F[0, 0] + F[1, 1], F[1, 0] - F[0, 1]
        inverse = real(1.0) / (wp.sqrt(a * a + b * b) + tiny)
        R = mat22(a * inverse, -b * inverse, b * inverse, a * inverse)
        S = wp.transpose(R) * F
        mean, half = real(0.5) * (S[0, 0] + S[1, 1]), real(0.5) * (S[0, 0] - S[1, 1])
        radius = wp.sqrt(half * half + S[0, 1] * S[0, 1])
        first, second = mean + radius, mean - radius
        kept_first = wp.clamp(first, stretches[0], stretches[1])
        kept_second = wp.clamp(second, stretches[0], stretches[1])
        if kept_first != first or kept_second != second:
            middle = real(0.5) * (kept_first + kept_second)
            shrink = real(0.5) * (kept_first - kept_second) / (radius + tiny)
            shear = shrink * S[0, 1]
            F = R * mat22(middle + shrink * half, shear, shear, middle - shrink * half)
            F_E[p] = F
            J = J_P[p] * (first * second / (kept_first * kept_second))
            J_P[p] = wp.clamp(J, plastic_volume[0], plastic_volume[1])
        h = wp.exp(wp.clamp(hardening[p] * (real(1.0) - J_P[p]), exponents[0], exponents[1]))
        J_E = wp.determinant(F)
        volumetric = h * lam_0[p] * (J_E - real(1.0)) * J_E
        tau[p] = real(2.0) * h * mu_0[p] * ((F - R) * wp.transpose(F)) + mat22(
            volumetric, real(0.0), real(0.0), volumetric
        )

    return stress


def make_particles_to_grid(real: type, weights: Any, count: int) -> wp.Kernel:
    """Make the kernel that sums mass and momentum on the nodes; ``count``: of nodes that a spline reaches an axis."""
    vec2, vec3, mat22 = make_types(real)

    @wp.kernel(module="unique")
    def particles_to_grid(
        position: wp.array(dtype=vec2),
        velocity: wp.array(dtype=vec2),
        affine: wp.array(dtype=mat22),
        tau: wp.array(dtype=mat22),
        force: wp.array(dtype=vec2),
        mass: wp.array(dtype=real),
        volume: wp.array(dtype=real),
        sums: wp.array2d(dtype=vec3),
        inverse_dx: real,
        inertia: real,
        dt: real,
    ):
        p = wp.tid()
        base_x, wx, gx, arm_x = weights(position[p][0] * inverse_dx)
        base_y, wy, gy, arm_y = weights(position[p][1] * inverse_dx)
        m = mass[p]
        momentum = m * (velocity[p] + dt * force[p])
        A = affine[p] * (m * inverse_dx / inertia)
        T = tau[p] * (dt * volume[p] * inverse_dx)
        for i in range(count):
            for j in range(count):
                w = wx[i] * wy[j]
                slope = vec2(gx[i] * wy[j], wx[i] * gy[j])
                q = w * (momentum + A * vec2(arm_x[i], arm_y[j])) - T * slope
                wp.atomic_add(sums, base_x + i, base_y + j, vec3(w * m, q[0], q[1]))

    return particles_to_grid


def make_node_velocities(real: type, slide: Any) -> wp.Kernel:
    """Make the kernel that turns momentum into velocity, with gravity and contact."""
    vec2, vec3, _ = make_types(real)

    @wp.kernel(module="unique")
    def node_velocities(
        sums: wp.array2d(dtype=vec3),
        node_velocity: wp.array2d(dtype=vec2),
        distance: wp.array2d(dtype=real),
        normal: wp.array2d(dtype=vec2),
        dx: real,
        dt: real,
        gravity: real,
        friction: real,
    ):
        i, j = wp.tid()
        s = sums[i, j]
        if s[0] > real(0.0):
            v = vec2(s[1] / s[0], s[2] / s[0] - dt * gravity)
            if distance[i, j] <= real(0.0):
                v = vec2(real(0.0), real(0.0))
            elif distance[i, j] < dx:
                v = slide(v, normal[i, j], friction)
            node_velocity[i, j] = v

    return node_velocities


def make_grid_to_particles(real: type, weights: Any, count: int, slide: Any, floor_at: Any) -> wp.Kernel:
    """Make the kernel that moves the particles with the nodes, and lets them slide on the floor."""
    vec2, _, mat22 = make_types(real)
    touch = real(1e-9 if real is wp.float64 else 1e-5)  # [grid spacings]

    @wp.kernel(module="unique")
    def grid_to_particles(
        position: wp.array(dtype=vec2),
        velocity: wp.array(dtype=vec2),
        affine: wp.array(dtype=mat22),
        F_E: wp.array(dtype=mat22),
        node_velocity: wp.array2d(dtype=vec2),
        distance: wp.array2d(dtype=real),
        normal: wp.array2d(dtype=vec2),
        dx: real,
        dt: real,
        friction: real,
    ):
        p = wp.tid()
        x = position[p]
        base_x, wx, gx, arm_x = weights(x[0] / dx)
        base_y, wy, gy, arm_y = weights(x[1] / dx)
        v = vec2()
        gradient = mat22()
        B = mat22()
        for i in range(count):
            for j in range(count):
                node = node_velocity[base_x + i, base_y + j]
                w = wx[i] * wy[j]
                v += w * node
                gradient += wp.outer(node, vec2(gx[i] * wy[j], wx[i] * gy[j]) / dx)
                B += wp.outer(node, w * dx * vec2(arm_x[i], arm_y[j]))
        F_E[p] = F_E[p] + dt * (gradient * F_E[p])
        near_x = wp.clamp(int(wp.floor(x[0] / dx)), 0, distance.shape[0] - 2)
        near_y = wp.clamp(int(wp.floor(x[1] / dx)), 0, distance.shape[1] - 2)
        if distance[near_x, near_y] < real(2.0) * dx:
            d, n = floor_at(x, distance, normal, dx)
            if d <= touch * dx:
                v = slide(v, n, friction)
            d_end, n_end = floor_at(x + dt * v, distance, normal, dx)
            if d_end < real(0.0):
                x = x - d_end * n_end
        velocity[p] = v
        affine[p] = B
        position[p] = x + dt * v

    return grid_to_particles


class WarpSolver:
    """A simulation on Warp's CPU device."""

    def __init__(self, start, spline: str, real: type = wp.float64):
        """Take over the start of a ``snow.Snow``; ``real``: the type of all numbers."""
        self.stages = make_stages(spline, real)
        self.constants, self.real, self.count = start.constants, real, len(start.particles["mass"])
        vec2, vec3, mat22 = make_types(real)
        dtypes = {0: real, 1: vec2, 2: mat22}
        self.state = {
            name: wp.array(values, dtype=dtypes[values.ndim - 1], device="cpu")
            for name, values in start.particles.items()
        }
        self.state["tau"] = wp.zeros(self.count, dtype=mat22, device="cpu")
        self.size = start.distance.shape
        self.distance = wp.array(start.distance, dtype=real, device="cpu")
        self.normal = wp.array(start.normal, dtype=vec2, device="cpu")
        self.sums = wp.zeros(self.size, dtype=vec3, device="cpu")
        self.node_velocity = wp.zeros(self.size, dtype=vec2, device="cpu")
        self.bounds = (
            vec2(self.constants.material.lowest_stretch, self.constants.material.highest_stretch),
            vec2(*self.constants.material.hardening_exponent),
            vec2(*self.constants.material.plastic_volume),
        )

    def _launch(self, kernel: wp.Kernel, dim, names: str, *rest) -> None:
        wp.launch(kernel, dim=dim, inputs=[*(self.state[name] for name in names.split()), *rest], device="cpu")

    def advance_frame(self, gravity: float, substeps: int) -> None:
        """Advance one frame in equal substeps."""
        constants, stages = self.constants, self.stages
        dt = constants.frame_time / substeps
        floor = (self.distance, self.normal)
        for _ in range(substeps):
            self._launch(stages.stress, self.count, "F_E J_P tau mu lam hardening", *self.bounds)
            self.sums.zero_()
            scales = (1.0 / constants.dx, constants.inertia, dt)
            transferred = "position velocity affine tau force mass volume"
            self._launch(stages.particles_to_grid, self.count, transferred, self.sums, *scales)
            node_laws = (constants.dx, dt, gravity, constants.friction)
            self._launch(stages.node_velocities, self.size, "", self.sums, self.node_velocity, *floor, *node_laws)
            moved = "position velocity affine F_E"
            contact = (constants.dx, dt, constants.friction)
            self._launch(stages.grid_to_particles, self.count, moved, self.node_velocity, *floor, *contact)

    def read(self, name: str) -> np.ndarray:
        """A copy of one quantity."""
        return self.state[name].numpy().copy()
