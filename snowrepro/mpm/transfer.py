"""Steps 1, 3 and 7: particles to grid and back, as sums that are separable over the two axes.

The weight of node (i, j) is w_i(x) w_j(y).  A particle's momentum, affine motion and stress reach
each node through products of numbers of one axis each.  Three ways (``constants.transfer``):

apic      affine particle-in-cell (Jiang et al. 2015), forces by the gradients of the weights
pic_flip  Stomakhin et al. 2013: particles keep ``constants.flip`` of their velocity and gain the nodes' change
mls       moving least squares (Hu et al. 2018): APIC whose forces and velocity gradient are affine fits
"""

from ..compiler import ti
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
def make_axis(particles: ti.template(), constants: ti.template()):
    """Room for what ``find_axis`` finds, in local arrays with a column for each particle of a lane group.

    ``base``: the first node; of each node ``weight``, ``moment`` w_i (x_i - x_p) / dx and ``slope`` dx grad w_i.
    """
    table = ti.Matrix.zero(float, constants.nodes, particles.lanes)
    return ti.Struct(base=ti.Vector([0] * particles.lanes), weight=table, moment=table, slope=table)


@ti.func
def find_axis(group, d: ti.template(), axis: ti.template(), particles: ti.template(), constants: ti.template()):
    """Find weights along axis ``d`` for a lane group, in straight-line arithmetic, which the compiler vectorises."""
    inverse_dx = 1.0 / constants.dx
    for k in range(particles.lanes):
        position = particles.position[group * particles.lanes + k][d]
        base, offset = splines.stencil(position * inverse_dx, constants.spline)
        weights = splines.weights(offset, constants.spline)
        gradients = splines.gradients(offset, constants.spline)
        axis.base[k] = base
        for i in ti.static(range(constants.nodes)):
            axis.weight[i, k] = weights[i]
            axis.moment[i, k] = weights[i] * (i - offset)
            axis.slope[i, k] = gradients[i]


@ti.func
def group_to_grid(group, end, part, particles: ti.template(), nodes: ti.template(), constants: ti.template(), dt):
    """Steps 1 and 3 for those particles of a lane group that are before ``end``: weights first, then all sums."""
    x, y = make_axis(particles, constants), make_axis(particles, constants)
    find_axis(group, 0, x, particles, constants)
    find_axis(group, 1, y, particles, constants)
    start = group * particles.lanes
    for k in range(ti.min(particles.lanes, end - start)):
        particle_to_grid(start + k, k, x, y, part, particles, nodes, constants, dt)


@ti.func
def particle_to_grid(
    p,
    k,
    x: ti.template(),
    y: ti.template(),
    part,
    particles: ti.template(),
    nodes: ti.template(),
    constants: ti.template(),
    dt,
):
    """Add what particle p, place k of its lane group, gives to the nodes around in its ``part`` of them.

    Mass and momentum (step 1) and the impulse of forces (step 3): momentum_i = w_i m (v + B D^-1 (x_i - x_p)) and
    impulse_i = dt (w_i m b - V tau grad w_i), where mls has w_i D^-1 (x_i - x_p) in place of grad w_i.  Node base +
    (i, j) gets w_i w_j own + s_i w_j along_x + w_i s_j along_y, all components side by side, as in ``nodes.sums``.
    """
    inverse_dx = 1.0 / constants.dx
    m = particles.mass[p]
    momentum = m * particles.velocity[p]
    impulse = (dt * m) * particles.force[p]
    affine = particles.affine[p] * (m * (inverse_dx / constants.inertia))  # m B D^-1 dx
    stress = particles.tau[p] * (-dt * inverse_dx * particles.volume[p])
    if ti.static(constants.transfer == "mls"):
        stress *= 1.0 / constants.inertia
    own = ti.Vector([momentum[0], momentum[1], impulse[0], impulse[1]])
    along_x = ti.Vector([affine[0, 0], affine[1, 0], stress[0, 0], stress[1, 0]])
    along_y = ti.Vector([affine[0, 1], affine[1, 1], stress[0, 1], stress[1, 1]])
    for i in ti.static(range(constants.nodes)):
        w = x.weight[i, k]
        mass = w * m
        even = w * own + slopes(x, i, k, constants) * along_x
        odd = w * along_y
        for j in ti.static(range(constants.nodes)):
            node = ti.Vector([part[0] + x.base[k] + i, y.base[k] + j])
            add(nodes.mass, nodes.fixed_mass, node, mass * y.weight[j, k], constants.mass_quantum, constants)
            share = even * y.weight[j, k] + odd * slopes(y, j, k, constants)
            add(nodes.sums, nodes.fixed_sums, node, share, constants.momentum_quantum, constants)


@ti.func
def slopes(axis: ti.template(), i: ti.template(), k, constants: ti.template()):
    """By what momentum and impulse of node i grow along an axis, as they stand in ``nodes.sums``."""
    moment = axis.moment[i, k]
    force = moment if ti.static(constants.transfer == "mls") else axis.slope[i, k]
    return ti.Vector([moment, moment, force, force])


@ti.func
def collect(i, j, nodes: ti.template(), constants: ti.template()):
    """Turn the fixed-point sums of a node into numbers."""
    if ti.static(constants.summation == "fixed_point"):
        nodes.mass[i, j] = nodes.fixed_mass[i, j] * constants.mass_quantum
        nodes.sums[i, j] = nodes.fixed_sums[i, j] * constants.momentum_quantum


@ti.func
def grid_to_particle(
    p,
    k,
    x: ti.template(),
    y: ti.template(),
    part,
    particles: ti.template(),
    nodes: ti.template(),
    constants: ti.template(),
    dt,
):
    """Return (velocity, grad v, B) at particle p, place k of its lane group, from the node velocities.

    velocity = sum w_i v_i (step 7), or by pic_flip (1 - flip) of that and ``flip`` of the particle's own
    plus the nodes' change (where ``pic_rate`` is set: what it keeps in a time, and not in a step);
    grad v = sum v_i (grad w_i)^T (for step 6), or by mls B D^-1;
    B = sum w_i v_i (x_i - x_p)^T (APIC's affine matrix), zero by pic_flip.
    """
    inverse_dx = 1.0 / constants.dx
    zero = ti.Vector([0.0, 0.0])
    velocity, slope_x, slope_y, moment_x, moment_y = zero, zero, zero, zero, zero
    old_velocity = zero
    for i in ti.static(range(constants.nodes)):
        column, column_slope, column_moment, old_column = zero, zero, zero, zero
        for j in ti.static(range(constants.nodes)):
            node = ti.Vector([part[0] + x.base[k] + i, y.base[k] + j])
            v = nodes.velocity[node]
            column += y.weight[j, k] * v
            column_slope += (y.slope[j, k] * inverse_dx) * v
            column_moment += y.moment[j, k] * v
            if ti.static(constants.transfer == "pic_flip"):
                old_column += y.weight[j, k] * nodes.old_velocity[node]
        velocity += x.weight[i, k] * column
        old_velocity += x.weight[i, k] * old_column
        slope_x += (x.slope[i, k] * inverse_dx) * column
        slope_y += x.weight[i, k] * column_slope
        moment_x += x.moment[i, k] * column
        moment_y += x.weight[i, k] * column_moment
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
