"""Steps 1, 3 and 7: particles to grid and back (APIC), as sums that are separable over the two axes.

The weight of node (i, j) is w_i(x) w_j(y).  A particle's momentum, affine motion and stress reach
each node through a few per-axis products that are formed once a column.
"""

import taichi as ti

from . import splines


@ti.func
def particles_to_grid(p, particles: ti.template(), nodes: ti.template(), laws: ti.template(), dt):
    """Add particle p's mass (step 1), momentum (step 1) and dt x force (step 3, and b) to its nodes.

    momentum_i += w_i m (v + B D^-1 (x_i - x_p) + dt b) - dt V tau grad w_i
    """
    inverse_dx = 1.0 / laws.dx
    base, offset = splines.stencil(particles.position[p] * inverse_dx, laws.spline)
    wx = splines.weights(offset[0], laws.spline)
    wy = splines.weights(offset[1], laws.spline)
    gx = splines.gradients(offset[0], laws.spline) * inverse_dx
    gy = splines.gradients(offset[1], laws.spline) * inverse_dx

    m = particles.mass[p]
    velocity = particles.velocity[p] + dt * particles.force[p]
    # Columns of m B D^-1 dx: the change of momentum from one node to the next along x and along y.
    affine = particles.affine[p] * (m * inverse_dx / laws.apic_inertia)
    along_x = ti.Vector([affine[0, 0], affine[1, 0]])
    along_y = ti.Vector([affine[0, 1], affine[1, 1]])
    stress = particles.tau[p] * (dt * particles.volume[p])
    stress_x = ti.Vector([stress[0, 0], stress[1, 0]])
    stress_y = ti.Vector([stress[0, 1], stress[1, 1]])

    for i in ti.static(range(laws.nodes)):
        even = wx[i] * (m * velocity + along_x * (i - offset[0])) - gx[i] * stress_x
        lever = wx[i] * along_y
        force = wx[i] * stress_y
        mass = wx[i] * m
        for j in ti.static(range(laws.nodes)):
            node = ti.Vector([base[0] + i, base[1] + j])
            # Plain sums, not +=: in a serial loop they need no atomics, and keep one order.
            nodes.mass[node] = nodes.mass[node] + mass * wy[j]
            nodes.momentum[node] = (
                nodes.momentum[node] + even * wy[j] + lever * (wy[j] * (j - offset[1])) - force * gy[j]
            )


@ti.func
def grid_to_particle(p, particles: ti.template(), nodes: ti.template(), laws: ti.template()):
    """Return (velocity, grad v, B) at particle p from the node velocities.

    velocity = sum w_i v_i (step 7), grad v = sum v_i (grad w_i)^T (for step 6),
    B = sum w_i v_i (x_i - x_p)^T (APIC's affine matrix).
    """
    inverse_dx = 1.0 / laws.dx
    base, offset = splines.stencil(particles.position[p] * inverse_dx, laws.spline)
    wx = splines.weights(offset[0], laws.spline)
    wy = splines.weights(offset[1], laws.spline)
    gx = splines.gradients(offset[0], laws.spline) * inverse_dx
    gy = splines.gradients(offset[1], laws.spline) * inverse_dx

    zero = ti.Vector.zero(ti.f64, 2)
    velocity, slope_x, slope_y, moment_x, moment_y = zero, zero, zero, zero, zero
    for i in ti.static(range(laws.nodes)):
        column, column_slope, column_moment = zero, zero, zero
        for j in ti.static(range(laws.nodes)):
            v = nodes.velocity[base[0] + i, base[1] + j]
            column += wy[j] * v
            column_slope += gy[j] * v
            column_moment += (wy[j] * (j - offset[1])) * v
        velocity += wx[i] * column
        slope_x += gx[i] * column
        slope_y += wx[i] * column_slope
        moment_x += (wx[i] * (i - offset[0])) * column
        moment_y += wx[i] * column_moment
    gradient = ti.Matrix.cols([slope_x, slope_y])
    affine = ti.Matrix.cols([moment_x, moment_y]) * laws.dx
    return velocity, gradient, affine


@ti.func
def grid_mass_at(p, particles: ti.template(), nodes: ti.template(), laws: ti.template()):
    """Sum of w_i m_i at particle p (step 2)."""
    base, offset = splines.stencil(particles.position[p] / laws.dx, laws.spline)
    wx = splines.weights(offset[0], laws.spline)
    wy = splines.weights(offset[1], laws.spline)
    total = 0.0
    for i, j in ti.static(ti.ndrange(laws.nodes, laws.nodes)):
        total += wx[i] * wy[j] * nodes.mass[base[0] + i, base[1] + j]
    return total
