"""Steps 1, 3 and 7: particles to grid and back, as sums that are separable over the two axes.

The weight of node (i, j) is w_i(x) w_j(y).  A particle's momentum, affine motion and stress reach
each node through products of numbers of one axis each.  Three ways (``constants.transfer``):

apic      affine particle-in-cell (Jiang et al. 2015), forces by the gradients of the weights
pic_flip  Stomakhin et al. 2013: particles keep ``constants.flip`` of their velocity and gain the nodes' change
mls       moving least squares (Hu et al. 2018): APIC whose forces and velocity gradient are affine fits
"""

from ..compiler import ti
from . import splines
from .state import BLOCK


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
def block_to_grid(block, part, particles: ti.template(), nodes: ti.template(), constants: ti.template(), dt):
    """Steps 1 and 3 for the particles of a block: all shares first, then all sums.

    To the same bits as particle by particle.  But the loop that adds reads its numbers side by side from memory,
    which the compiler turns into vector instructions.
    """
    start = block * BLOCK
    count = ti.min(BLOCK, particles.count - start)
    for k in range(count):
        find_shares(k, start + k, part, particles, constants, dt)
    for k in range(count):
        add_shares(k, particles.shares, nodes, constants)


@ti.func
def find_shares(k, p, part, particles: ti.template(), constants: ti.template(), dt):
    """Find what particle p gives to the nodes around in its ``part`` of them, and put it in place k of the shares.

    Mass and momentum (step 1) and the impulse of forces (step 3): momentum_i = w_i m (v + B D^-1 (x_i - x_p)) and
    impulse_i = dt (w_i m b - V tau grad w_i), where mls has w_i D^-1 (x_i - x_p) in place of grad w_i.
    """
    inverse_dx = 1.0 / constants.dx
    base, offset = splines.stencil(particles.position[p] * inverse_dx, constants.spline)
    m = particles.mass[p]
    momentum = m * particles.velocity[p]
    impulse = (dt * m) * particles.force[p]
    affine = particles.affine[p] * (m * (inverse_dx / constants.inertia))  # m B D^-1 dx
    stress = particles.tau[p] * (-dt * inverse_dx * particles.volume[p])
    if ti.static(constants.transfer == "mls"):
        stress *= 1.0 / constants.inertia

    particles.shares.base[k] = ti.Vector([part[0] + base[0], base[1]])
    particles.shares.mass[k] = m
    particles.shares.own[k] = ti.Vector([momentum[0], momentum[1], impulse[0], impulse[1]])
    particles.shares.along_x[k] = ti.Vector([affine[0, 0], affine[1, 0], stress[0, 0], stress[1, 0]])
    particles.shares.along_y[k] = ti.Vector([affine[0, 1], affine[1, 1], stress[0, 1], stress[1, 1]])
    find_axis_shares(k, offset[0], particles.shares.weight_x, particles.shares.slope_x, constants)
    find_axis_shares(k, offset[1], particles.shares.weight_y, particles.shares.slope_y, constants)


@ti.func
def find_axis_shares(k, offset, weight: ti.template(), slope: ti.template(), constants: ti.template()):
    """Put weights and slopes of the nodes of one axis in place k; slopes are by what stands in ``nodes.sums``."""
    weights = splines.weights(offset, constants.spline)
    gradients = splines.gradients(offset, constants.spline)
    for i in ti.static(range(constants.nodes)):
        moment = weights[i] * (i - offset)
        force = moment if ti.static(constants.transfer == "mls") else gradients[i]
        weight[k, i] = weights[i]
        slope[k, i] = ti.Vector([moment, moment, force, force])


@ti.func
def add_shares(k, shares: ti.template(), nodes: ti.template(), constants: ti.template()):
    """Add the shares in place k to the sums of nodes, all components side by side.

    Node base + (i, j) gets w_i w_j own + s_i w_j along_x + w_i s_j along_y, with weights w and slopes s.
    """
    base = shares.base[k]
    for i in range(constants.nodes):
        w = shares.weight_x[k, i]
        mass = w * shares.mass[k]
        even = w * shares.own[k] + shares.slope_x[k, i] * shares.along_x[k]
        odd = w * shares.along_y[k]
        for j in ti.static(range(constants.nodes)):
            node = ti.Vector([base[0] + i, base[1] + j])
            w_y = shares.weight_y[k, j]
            add(nodes.mass, nodes.fixed_mass, node, mass * w_y, constants.mass_quantum, constants)
            share = even * w_y + odd * shares.slope_y[k, j]
            add(nodes.sums, nodes.fixed_sums, node, share, constants.momentum_quantum, constants)


@ti.func
def collect(i, j, nodes: ti.template(), constants: ti.template()):
    """Turn the fixed-point sums of a node into numbers."""
    if ti.static(constants.summation == "fixed_point"):
        nodes.mass[i, j] = nodes.fixed_mass[i, j] * constants.mass_quantum
        nodes.sums[i, j] = nodes.fixed_sums[i, j] * constants.momentum_quantum


@ti.func
def grid_to_particle(p, part, particles: ti.template(), nodes: ti.template(), constants: ti.template(), dt):
    """Return (velocity, grad v, B) at particle p from the node velocities.

    velocity = sum w_i v_i (step 7), or by pic_flip (1 - flip) of that and ``flip`` of the particle's own
    plus the nodes' change (where ``pic_rate`` is set: what it keeps in a time, and not in a step);
    grad v = sum v_i (grad w_i)^T (for step 6), or by mls B D^-1;
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
            v = nodes.velocity[part[0] + base[0] + i, base[1] + j]
            column += wy[j] * v
            column_slope += gy[j] * v
            column_moment += (wy[j] * (j - offset[1])) * v
            if ti.static(constants.transfer == "pic_flip"):
                old_column += wy[j] * nodes.old_velocity[part[0] + base[0] + i, base[1] + j]
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
        kept = constants.flip
        if ti.static(constants.pic_rate >= 0.0):
            kept = 1.0 / (1.0 + dt * constants.pic_rate)
        velocity += kept * (particles.velocity[p] - old_velocity)
    return velocity, gradient, affine


@ti.func
def grid_mass_at(p, part, particles: ti.template(), nodes: ti.template(), constants: ti.template()):
    """Sum of w_i m_i at particle p (step 2)."""
    base, offset = splines.stencil(particles.position[p] / constants.dx, constants.spline)
    wx = splines.weights(offset[0], constants.spline)
    wy = splines.weights(offset[1], constants.spline)
    total = 0.0
    for i, j in ti.static(ti.ndrange(constants.nodes, constants.nodes)):
        total += wx[i] * wy[j] * nodes.mass[part[0] + base[0] + i, base[1] + j]
    return total
