"""Contact by springs on the particles that touch the floor (``reading.contact=penalty``), in place of contact on nodes.

The surface of the snow lies half a spacing of particles outside their centres.  A particle with a part of it inside the
floor is pushed out by a spring with a dashpot, and held along the floor by another pair, up to Coulomb's friction
(Cundall and Strack 1979).  The force comes from how deep a particle is, not from its approach: what rolls gets back
behind its lowest point what it gave before it.  Springs are as stiff as the time step allows.

The impulse goes to the nodes before they move (step 4), as if it acted at the point of contact: what the nodes around a
particle get has its first moment there.
"""

from ..compiler import ti
from ..physics.elasticity import TINY
from . import contact, splines, transfer

STIFFNESS = 0.25  # of a spring, in mass / dt^2; explicit steps are unstable from 4 on
DAMPING = 1.0  # of a dashpot, in mass / dt: critical for that stiffness


@ti.func
def press(p, part, particles: ti.template(), nodes: ti.template(), constants: ti.template(), dt):
    """Give the nodes around particle p what the floor gives it in a substep, and keep its elastic slip."""
    slip = ti.Vector([0.0, 0.0])
    position = particles.position[p]
    if contact.near_floor(position, part, nodes, constants):
        distance, normal = contact.floor_at(position, part, nodes, constants)
        if distance < constants.reach:
            arm = -constants.reach * normal
            spread = constants.inertia * constants.dx**2
            velocity = particles.velocity[p] + particles.affine[p] @ arm / spread
            # The point of contact gives way to an impulse like this share of the mass, as the particle deforms too.
            share = 1.0 / (1.0 + constants.reach**2 / spread)
            inward = velocity.dot(normal)
            sliding = velocity - inward * normal
            slip = particles.slip[p] - particles.slip[p].dot(normal) * normal + dt * sliding
            push = share * ti.max(0.0, STIFFNESS / dt * (constants.reach - distance) - DAMPING * inward)
            rub = -share * (STIFFNESS / dt * slip + DAMPING * sliding)
            most = constants.friction * push
            if rub.norm() > most:
                rub *= most / (rub.norm() + TINY)
                slip = -(rub / share + DAMPING * sliding) * (dt / STIFFNESS)
            add_push(position, part, particles.mass[p] * (push * normal + rub), arm, nodes, constants)
    particles.slip[p] = slip


@ti.func
def add_push(position, part, impulse, arm, nodes: ti.template(), constants: ti.template()):
    """Add an impulse that acts at ``position + arm`` to the nodes around ``position``."""
    base, offset = splines.stencil(position / constants.dx, constants.spline)
    wx = splines.weights(offset[0], constants.spline)
    wy = splines.weights(offset[1], constants.spline)
    lever = arm / (constants.inertia * constants.dx)
    for i, j in ti.static(ti.ndrange(constants.nodes, constants.nodes)):
        node = ti.Vector([part[0] + base[0] + i, base[1] + j])
        weight = wx[i] * wy[j] * (1.0 + lever[0] * (i - offset[0]) + lever[1] * (j - offset[1]))
        transfer.add(nodes.push, nodes.fixed_push, node, weight * impulse, constants.momentum_quantum, constants)


@ti.func
def clear(i, j, nodes: ti.template(), constants: ti.template()):
    """Nothing presses on a node yet."""
    if ti.static(constants.summation == "fixed_point"):
        nodes.fixed_push[i, j] = 0
    else:
        nodes.push[i, j] = 0.0


@ti.func
def node_velocity(i, j, velocity, mass, nodes: ti.template(), constants: ti.template()):
    """The node's velocity with what the floor gives the particles around it."""
    if ti.static(constants.summation == "fixed_point"):
        nodes.push[i, j] = nodes.fixed_push[i, j] * constants.momentum_quantum
    return velocity + nodes.push[i, j] / mass
