"""Steps 1, 3 and 7: particles to grid and back, as sums that are separable over the two axes.

The weight of node (i, j) is w_i(x) w_j(y).  A particle's momentum, affine motion and stress reach
each node through a few per-axis products that are formed once a column.  Three ways (``constants.transfer``):

apic      affine particle-in-cell (Jiang et al. 2015), forces by the gradients of the weights
pic_flip  Stomakhin et al. 2013: particles keep ``constants.flip`` of their velocity and gain the nodes' change
mls       moving least squares (Hu et al. 2018): APIC whose forces and velocity gradient are affine fits
"""

import taichi as ti

from . import splines


@ti.func
def add(sums: ti.template(), fixed_sums: ti.template(), node, value, quantum: ti.template(), constants: ti.template()):
    """Add ``value`` to the sum of a node, in the way that ``constants.summation`` says.

    Plain sums need one thread and keep one order; fixed-point sums do not depend on the order.
    """
    if ti.static(constants.summation == "in_order"):
        sums[node] = sums[node] + value
    elif ti.static(constants.summation == "fixed_point"):
        ti.atomic_add(fixed_sums[node], ti.round(value * ti.static(1.0 / quantum), ti.i64))
    else:
        ti.atomic_add(sums[node], value)


@ti.func
def particles_to_grid(p, particles: ti.template(), nodes: ti.template(), constants: ti.template(), dt):
    """Add particle p's mass (step 1), momentum (step 1) and dt x force (step 3, and b) to its nodes.

    momentum_i += w_i m (v + B D^-1 (x_i - x_p) + dt b) - dt V tau grad w_i, where mls has
    w_i D^-1 (x_i - x_p) in place of grad w_i.  ``old_momentum`` is the same without forces.
    """
    inverse_dx = 1.0 / constants.dx
    base, offset = splines.stencil(particles.position[p] * inverse_dx, constants.spline)
    wx = splines.weights(offset[0], constants.spline)
    wy = splines.weights(offset[1], constants.spline)
    gx = splines.gradients(offset[0], constants.spline) * inverse_dx
    gy = splines.gradients(offset[1], constants.spline) * inverse_dx

    m = particles.mass[p]
    old_velocity = particles.velocity[p]
    velocity = old_velocity + dt * particles.force[p]
    # Columns of m B D^-1 dx: the change of momentum from one node to the next along x and along y.
    affine = particles.affine[p] * (m * inverse_dx / constants.inertia)
    along_x = ti.Vector([affine[0, 0], affine[1, 0]])
    along_y = ti.Vector([affine[0, 1], affine[1, 1]])
    stress = particles.tau[p] * (dt * particles.volume[p])
    stress_x = ti.Vector([stress[0, 0], stress[1, 0]])
    stress_y = ti.Vector([stress[0, 1], stress[1, 1]])
    if ti.static(constants.transfer == "mls"):
        stress_x *= inverse_dx / constants.inertia
        stress_y *= inverse_dx / constants.inertia

    for i in ti.static(range(constants.nodes)):
        arm = i - offset[0]
        slope_x = wx[i] * arm if ti.static(constants.transfer == "mls") else gx[i]
        even = wx[i] * (m * velocity + along_x * arm) - slope_x * stress_x
        old_even = wx[i] * (m * old_velocity + along_x * arm)
        lever = wx[i] * along_y
        force = wx[i] * stress_y
        mass = wx[i] * m
        for j in ti.static(range(constants.nodes)):
            node = ti.Vector([base[0] + i, base[1] + j])
            moment = wy[j] * (j - offset[1])
            slope_y = moment if ti.static(constants.transfer == "mls") else gy[j]
            turning = lever * moment
            add(nodes.mass, nodes.fixed_mass, node, mass * wy[j], constants.mass_quantum, constants)
            add(
                nodes.momentum,
                nodes.fixed_momentum,
                node,
                even * wy[j] + turning - force * slope_y,
                constants.momentum_quantum,
                constants,
            )
            add(
                nodes.old_momentum,
                nodes.fixed_old_momentum,
                node,
                old_even * wy[j] + turning,
                constants.momentum_quantum,
                constants,
            )


@ti.func
def collect(i, j, nodes: ti.template(), constants: ti.template()):
    """Turn the fixed-point sums of a node into numbers."""
    if ti.static(constants.summation == "fixed_point"):
        nodes.mass[i, j] = nodes.fixed_mass[i, j] * constants.mass_quantum
        nodes.momentum[i, j] = nodes.fixed_momentum[i, j] * constants.momentum_quantum
        nodes.old_momentum[i, j] = nodes.fixed_old_momentum[i, j] * constants.momentum_quantum


@ti.func
def grid_to_particle(p, particles: ti.template(), nodes: ti.template(), constants: ti.template()):
    """Return (velocity, grad v, B) at particle p from the node velocities.

    velocity = sum w_i v_i (step 7), or by pic_flip (1 - flip) of that and ``flip`` of the particle's own
    plus the nodes' change; grad v = sum v_i (grad w_i)^T (for step 6), or by mls B D^-1;
    B = sum w_i v_i (x_i - x_p)^T (APIC's affine matrix), zero by pic_flip.
    """
    inverse_dx = 1.0 / constants.dx
    base, offset = splines.stencil(particles.position[p] * inverse_dx, constants.spline)
    wx = splines.weights(offset[0], constants.spline)
    wy = splines.weights(offset[1], constants.spline)
    gx = splines.gradients(offset[0], constants.spline) * inverse_dx
    gy = splines.gradients(offset[1], constants.spline) * inverse_dx

    zero = ti.Vector([0.0, 0.0])
    velocity, slope_x, slope_y, moment_x, moment_y = zero, zero, zero, zero, zero
    old_velocity = zero
    for i in ti.static(range(constants.nodes)):
        column, column_slope, column_moment, old_column = zero, zero, zero, zero
        for j in ti.static(range(constants.nodes)):
            v = nodes.velocity[base[0] + i, base[1] + j]
            column += wy[j] * v
            column_slope += gy[j] * v
            column_moment += (wy[j] * (j - offset[1])) * v
            if ti.static(constants.transfer == "pic_flip"):
                old_column += wy[j] * nodes.old_velocity[base[0] + i, base[1] + j]
        velocity += wx[i] * column
        old_velocity += wx[i] * old_column
        slope_x += gx[i] * column
        slope_y += wx[i] * column_slope
        moment_x += (wx[i] * (i - offset[0])) * column
        moment_y += wx[i] * column_moment
    # Nothing reads this: adjacent stores are where the compiler starts to look for vectors.
    particles.gathered[p] = ti.Matrix.rows([velocity, slope_x, slope_y, moment_x, moment_y])
    gradient = ti.Matrix.cols([slope_x, slope_y])
    affine = ti.Matrix.cols([moment_x, moment_y]) * constants.dx
    if ti.static(constants.transfer == "mls"):
        gradient = affine * (inverse_dx * inverse_dx / constants.inertia)
    if ti.static(constants.transfer == "pic_flip"):
        affine *= 0.0
        velocity += constants.flip * (particles.velocity[p] - old_velocity)
    return velocity, gradient, affine


@ti.func
def grid_mass_at(p, particles: ti.template(), nodes: ti.template(), constants: ti.template()):
    """Sum of w_i m_i at particle p (step 2)."""
    base, offset = splines.stencil(particles.position[p] / constants.dx, constants.spline)
    wx = splines.weights(offset[0], constants.spline)
    wy = splines.weights(offset[1], constants.spline)
    total = 0.0
    for i, j in ti.static(ti.ndrange(constants.nodes, constants.nodes)):
        total += wx[i] * wy[j] * nodes.mass[base[0] + i, base[1] + j]
    return total
