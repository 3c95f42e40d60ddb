"""Steps 5 and 8: collision of nodes and of particles with the floor, a signed distance on the grid.

Distance and normal are exact at the nodes and bilinear between them, as in legacy Taichi: exact for a
straight floor, within dx^2 / 8R for one of radius R, and rounded over a grid spacing at a corner.
"""

from ..compiler import ti
from ..physics.elasticity import TINY


@ti.func
def slide(velocity, normal, friction):
    """Coulomb contact: remove the inward normal part; friction takes up to ``friction`` times it."""
    inward = velocity.dot(normal)
    result = velocity
    if inward < 0.0:
        tangential = velocity - inward * normal
        speed = tangential.norm() + TINY
        result = tangential * ti.max(0.0, 1.0 + friction * inward / speed)
    return result


@ti.func
def node_velocity(velocity, distance, normal, constants: ti.template()):
    """Step 5: the node's velocity after contact; the floor acts up to one grid spacing above itself."""
    result = velocity
    if ti.static(constants.stick_inside):
        if distance <= 0.0:
            result = ti.Vector([0.0, 0.0])
        elif distance < constants.dx:
            result = slide(velocity, normal, constants.friction)
    else:
        if distance < 0.0:
            result = slide(velocity, normal, constants.friction)
    return result


@ti.func
def cell_of(position, part, constants: ti.template()):
    """Lower left node of the cell around a point, kept on the grid: a diverging particle must not read beyond it.

    ``part``: of the nodes, as ``Cases.part`` gives it.
    """
    corner = ti.cast(position / constants.dx, ti.i32)  # places are positive, and floor would be a library call
    for d in ti.static(range(2)):
        corner[d] = ti.max(0, ti.min(corner[d], part[1 + d] - 2))
    return corner


@ti.func
def floor_at(position, part, nodes: ti.template(), constants: ti.template()):
    """Signed distance and outward normal at a point, bilinear between the nodes."""
    corner = cell_of(position, part, constants)
    f = position / constants.dx - corner
    distance = 0.0
    normal = ti.Vector([0.0, 0.0])
    for i, j in ti.static(ti.ndrange(2, 2)):
        weight = (f[0] if ti.static(i == 1) else 1.0 - f[0]) * (f[1] if ti.static(j == 1) else 1.0 - f[1])
        distance += weight * nodes.distance[part[0] + corner[0] + i, corner[1] + j]
        normal += weight * nodes.normal[part[0] + corner[0] + i, corner[1] + j]
    return distance, normal / (normal.norm() + TINY)


@ti.func
def near_floor(position, part, nodes: ti.template(), constants: ti.template()):
    """Whether the floor can be within reach: a cheap look at one node."""
    corner = cell_of(position, part, constants)
    return nodes.distance[part[0] + corner[0], corner[1]] < 2.0 * constants.dx
