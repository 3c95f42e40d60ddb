"""The nine steps of Fig. 1 for one particle or node, and the sintering update between steps 3 and 4 (Sec. 3.4).

``serial`` and ``parallel`` loop over these stages in the paper's order; step 2 is ``serial.step_2_volume``.
"""

from ..compiler import ti
from ..physics import elasticity
from . import contact, indenter, penalty, transfer
from .state import RUNNING, TOO_MANY_SUBSTEPS, UNSOUND_PARTICLE

HUGE = 1e30  # beyond what any sound quantity reaches, within what f32 holds
NOBODY = 2**31 - 1


@ti.func
def begin_frame(case, ledger: ti.template(), constants: ti.template()):
    """Nothing has happened yet in the frame of a case."""
    ledger.status[case] = RUNNING
    ledger.particle[case] = NOBODY
    ledger.substeps[case] = 0
    ledger.ended_inside[case] = 0
    ledger.elapsed[case] = 0.0
    ledger.under_way[case] = 1
    ledger.smallest_step[case] = constants.frame_time


@ti.func
def clear_particle_accounts(p, particles: ti.template(), nodes: ti.template(), constants: ti.template()):
    """Set the accounts of particle p to zero, as a frame begins."""
    for book in ti.static(particles.books):
        book.field[p] = 0.0
    if ti.static(constants.indents):
        nodes.indenter.particle_impulse[p] = ti.Vector([0.0, 0.0])


@ti.func
def clear_node_accounts(i, j, nodes: ti.template(), constants: ti.template()):
    """Set the accounts of a node to zero, as a frame begins."""
    for book in ti.static(nodes.books):
        book.field[i, j] = 0.0
    if ti.static(constants.indents):
        nodes.indenter.node_impulse[i, j] = ti.Vector([0.0, 0.0])


@ti.func
def goes_on(case, ledger: ti.template()):
    """Whether the frame of a case has a substep to come."""
    return ledger.status[case] == RUNNING and ledger.under_way[case] == 1


@ti.func
def update_stress(group, whole, particles: ti.template(), constants: ti.template()):
    """Return the trial F_E that step 6 left to the yield surface, harden, and store the stress that step 3 needs.

    Straight-line arithmetic over a lane group's particles into local arrays, which the compiler vectorises; writing
    the fields in these loops would prevent it.  A group of which nothing flowed has hardened before: that is done
    where something did, and, if asked for the ``whole``, in any case, as behind what was written between frames.
    """
    zero = lanes(particles)
    relaxed = ti.Struct(F00=zero, F01=zero, F10=zero, F11=zero, cos=zero, sin=zero, J_P=zero)
    positive, tau_xx, tau_xy, tau_yy, wave_speed2 = zero, zero, zero, zero, zero
    for k in range(particles.lanes):
        p = group * particles.lanes + k
        trial = particles.F_E[p]
        R = elasticity.polar_rotation(trial)
        mu, lam, xi = particles.mu[p], particles.lam[p], particles.hardening[p]
        F_E, state = constants.material.relax(trial, R, read_state(p, particles), mu, lam, xi)
        relaxed.F00[k], relaxed.F01[k], relaxed.F10[k], relaxed.F11[k] = F_E[0, 0], F_E[0, 1], F_E[1, 0], F_E[1, 1]
        relaxed.cos[k], relaxed.sin[k] = R[0, 0], R[1, 0]
        relaxed.J_P[k] = state[0]
        positive[k] = ti.select(trial.determinant() > 0.0, 1.0, -1.0)
        for s in ti.static(range(1, len(particles.history))):
            particles.history[s][p] = state[s]
    if whole or has_flowed(group, relaxed, particles):
        harden(group, relaxed, particles, constants)
    for k in range(particles.lanes):
        p = group * particles.lanes + k
        F_E, R = strain_of(k, relaxed)
        mu, lam = particles.factor[p] * particles.mu[p], particles.factor[p] * particles.lam[p]
        tau = constants.material.stress(F_E, R, mu, lam)
        stiffness = constants.material.stiffness(F_E, tau, mu, lam)
        tau_xx[k], tau_xy[k], tau_yy[k] = tau[0, 0], tau[0, 1], tau[1, 1]
        wave_speed2[k] = ti.select(positive[k] > 0.0, stiffness * particles.volume[p] / particles.mass[p], -1.0)
    for k in range(particles.lanes):
        p = group * particles.lanes + k
        particles.tau[p] = ti.Matrix([[tau_xx[k], tau_xy[k]], [tau_xy[k], tau_yy[k]]])
        particles.wave_speed2[p] = wave_speed2[k]


@ti.func
def has_flowed(group, relaxed: ti.template(), particles: ti.template()):
    """Whether the yield surface changed the strain or J_P of any particle of a lane group, as NaN is always."""
    number = 0
    for k in range(particles.lanes):
        p = group * particles.lanes + k
        trial = particles.F_E[p]
        is_first_row_same = (relaxed.F00[k] == trial[0, 0]) & (relaxed.F01[k] == trial[0, 1])
        is_second_row_same = (relaxed.F10[k] == trial[1, 0]) & (relaxed.F11[k] == trial[1, 1])
        is_same = is_first_row_same & is_second_row_same & (relaxed.J_P[k] == particles.J_P[p])
        number += ti.select(is_same, 0, 1)
    return number > 0


@ti.func
def harden(group, relaxed: ti.template(), particles: ti.template(), constants: ti.template()):
    """Store the ``relaxed`` F_E and J_P of a lane group and their factor of Eq. 1; book flow and hardening.

    The factor has a loop of its own: its long chain of products then overlaps from one particle to the next.
    """
    zero = lanes(particles)
    factor, plastic, hardened = zero, zero, zero
    for k in range(particles.lanes):
        factor[k] = constants.material.factor(relaxed.J_P[k], particles.hardening[group * particles.lanes + k])
    for k in range(particles.lanes):
        p = group * particles.lanes + k
        F_E, R = strain_of(k, relaxed)
        # Flow: stress on the yield surface times the plastic strain, under the mean factor.  Hardening: what it lifts.
        energy = constants.material.energy(F_E, R, particles.mu[p], particles.lam[p])
        mean = 0.5 * (particles.factor[p] + factor[k])
        flow = constants.material.flow_work(F_E, particles.F_E[p], R, particles.mu[p], particles.lam[p])
        plastic[k] = particles.plastic_work[p] - mean * flow * particles.volume[p]
        hardened[k] = particles.hardening_work[p] + (factor[k] - particles.factor[p]) * energy * particles.volume[p]
    for k in range(particles.lanes):
        p = group * particles.lanes + k
        particles.F_E[p], _ = strain_of(k, relaxed)
        particles.J_P[p] = relaxed.J_P[k]
        particles.factor[p] = factor[k]
        particles.plastic_work[p] = plastic[k]
        particles.hardening_work[p] = hardened[k]


@ti.func
def strain_of(k, relaxed: ti.template()):
    """F_E on the yield surface and the rotation R of place k of a lane group."""
    F_E = ti.Matrix([[relaxed.F00[k], relaxed.F01[k]], [relaxed.F10[k], relaxed.F11[k]]])
    R = ti.Matrix([[relaxed.cos[k], -relaxed.sin[k]], [relaxed.sin[k], relaxed.cos[k]]])
    return F_E, R


@ti.func
def read_state(p, particles: ti.template()):
    """What the material remembers of particle p, as a vector: J_P, and its law's own quantities."""
    state = ti.Vector([0.0] * ti.static(len(particles.history)))
    for s in ti.static(range(len(particles.history))):
        state[s] = particles.history[s][p]
    return state


@ti.func
def lanes(particles: ti.template()):
    """A local array of zeros, one for each particle of a lane group."""
    return ti.Vector([0.0] * ti.static(particles.lanes))


@ti.func
def is_sound(p, part, particles: ti.template(), constants: ti.template()):
    """Whether particle p is on its ``part`` of the grid, with a finite strain that is not inverted and nu below 0.5.

    Comparisons are written so that NaN fails them.
    """
    sound = particles.wave_speed2[p] > 0.0 and particles.wave_speed2[p] < HUGE and particles.poisson[p] < 0.5
    for d in ti.static(range(2)):
        place = particles.position[p][d]
        sound = sound and place > 2.0 * constants.dx and place < (part[1 + d] - 3) * constants.dx
    return sound


@ti.func
def cell_of(p, particles: ti.template(), constants: ti.template()):
    """Lower left node of the cell that particle p is in; for one that is lost, of one on the grid."""
    position = particles.position[p]
    return ti.cast(ti.math.clamp(position / constants.dx, 0.0, 1e6), ti.i32)


@ti.func
def choose_time_step(case, ledger: ti.template(), constants: ti.template()):
    """Length of the substep that begins, from the stiffness as hardened and sintered and the fastest particle.

    Equal substeps up to the end of the frame, none of them a sliver.  The survey has to be there.
    """
    if ledger.particle[case] != NOBODY:
        ledger.status[case] = UNSOUND_PARTICLE
    else:
        remaining = constants.frame_time - ledger.elapsed[case]
        longest = constants.cfl * constants.dx / (ti.sqrt(ledger.wave_speed2[case]) + ti.sqrt(ledger.top_speed2[case]))
        if remaining / longest > constants.max_substeps - ledger.substeps[case]:
            ledger.status[case] = TOO_MANY_SUBSTEPS
            ledger.smallest_step[case] = longest
        else:
            count = ti.max(1.0, ti.ceil(remaining / longest))
            ledger.dt[case] = remaining / count
            ledger.smallest_step[case] = ti.min(ledger.smallest_step[case], ledger.dt[case])
            ledger.substeps[case] += 1
            ledger.elapsed[case] += ledger.dt[case]
            if count < 1.5:
                ledger.elapsed[case] = constants.frame_time
                ledger.under_way[case] = 0


@ti.func
def clear(i, j, nodes: ti.template(), constants: ti.template()):
    """Empty a node."""
    if ti.static(constants.summation == "fixed_point"):
        nodes.fixed_mass[i, j] = 0
        nodes.fixed_sums[i, j] = 0
    else:
        nodes.mass[i, j] = 0.0
        nodes.sums[i, j] = 0.0
    if ti.static(constants.springs):
        penalty.clear(i, j, nodes, constants)


@ti.func
def von_mises(p, particles: ti.template(), constants: ti.template()):
    """Eqs. 3 to 5 at particle p, with the moduli as hardened."""
    F_E, h = particles.F_E[p], particles.factor[p]
    mu, lam = h * particles.mu[p], h * particles.lam[p]
    J = F_E.determinant() * particles.J_P[p]
    sigma = constants.material.stress(F_E, elasticity.polar_rotation(F_E), mu, lam) / J
    zz = 0.0
    if ti.static(constants.plane_strain):
        zz = constants.material.stress_zz(F_E, mu, lam) / J
    return elasticity.von_mises_stress(sigma, zz)


@ti.func
def elastic_energy(p, particles: ti.template(), constants: ti.template()):
    """Elastic energy of particle p."""
    F_E = particles.F_E[p]
    R = elasticity.polar_rotation(F_E)
    energy = constants.material.energy(F_E, R, particles.mu[p], particles.lam[p])
    return energy * particles.factor[p] * particles.volume[p]


@ti.func
def kinetic_energy(p, particles: ti.template(), constants: ti.template()):
    """Kinetic energy of particle p with that of its affine motion: m/2 (|v|^2 + |B|^2 / D)."""
    own = particles.velocity[p].norm_sqr()
    affine = particles.affine[p].norm_sqr() / (constants.inertia * constants.dx**2)
    return 0.5 * particles.mass[p] * (own + affine)


@ti.func
def sinter(p, particles: ti.template(), constants: ti.template(), dt):
    """Secs. 3.1 to 3.3: density, elasticity and plasticity of particle p after one update, by the law of sintering.

    An update stands for the substep, or for the whole frame where the reading updates once a frame.
    """
    time_step = dt if ti.static(constants.every_substep) else constants.frame_time
    weight = time_step / constants.frame_time if ti.static(constants.hardening_per_time) else 1.0
    energy = elastic_energy(p, particles, constants)
    sigma_m = von_mises(p, particles, constants)
    b_norm = particles.force[p].norm() * constants.force_weight
    rho = particles.density[p]

    new_rho, E, nu, xi = constants.sintering.advance(rho, particles.hardening[p], sigma_m, b_norm, time_step, weight)
    particles.density[p], particles.young[p], particles.poisson[p], particles.hardening[p] = new_rho, E, nu, xi
    particles.mu[p], particles.lam[p] = elasticity.lame_parameters(E, nu)
    if ti.static(constants.volume_follows_density):
        particles.volume[p] = particles.volume[p] * rho / new_rho
    particles.factor[p] = constants.material.factor(particles.J_P[p], xi)
    particles.sintering_work[p] += elastic_energy(p, particles, constants) - energy


@ti.func
def step_4_and_5_node_velocity(i, j, nodes: ti.template(), constants: ti.template(), dt, gravity, damping):
    """Step 4: velocity from momentum, gravity and damping.  Step 5: collision of the node with the floor.

    An impulse does its work at the mean of the velocities before and after the substep.
    """
    transfer.collect(i, j, nodes, constants)
    mass = nodes.mass[i, j]
    if mass > 0.0:
        sums = nodes.sums[i, j]
        old_momentum = ti.Vector([sums[0], sums[1]])
        impulse = ti.Vector([sums[2], sums[3]])
        pushed = (old_momentum + impulse) / mass
        pushed[1] -= dt * gravity
        damped = pushed * (1.0 / (1.0 + dt * damping))
        new = damped
        if ti.static(constants.springs):
            new = penalty.node_velocity(i, j, damped, mass, nodes, constants)
        else:
            new = contact.node_velocity(damped, nodes.distance[i, j], nodes.normal[i, j], constants)
        if ti.static(constants.indents):
            new = indenter.node_velocity(i, j, new, mass, nodes.indenter, constants)
        old = old_momentum / mass
        nodes.velocity[i, j] = new
        if ti.static(constants.transfer == "pic_flip"):
            nodes.old_velocity[i, j] = old
        mean = 0.5 * mass * (old + new)
        nodes.kinetic_work[i, j] += mean.dot(new - old)
        nodes.damping_work[i, j] += mean.dot(damped - pushed)
        nodes.contact_work[i, j] += mean.dot(new - damped)
        nodes.contact_impulse[i, j] += mass * (new - pushed)
    elif ti.static(constants.summation == "fixed_point"):  # what it gets may round to no mass, and particles see it yet
        nodes.velocity[i, j] = ti.Vector([0.0, 0.0])
        if ti.static(constants.transfer == "pic_flip"):
            nodes.old_velocity[i, j] = ti.Vector([0.0, 0.0])


@ti.func
def step_6_to_9_group(
    group, end, part, particles: ti.template(), nodes: ti.template(), constants: ti.template(), dt, gravity
):
    """Steps 6 to 9 for those particles of a lane group that are before ``end``: weights first.

    Returns the square of their highest speed, and how many ended inside the floor.
    """
    x, y = transfer.make_axis(particles, constants), transfer.make_axis(particles, constants)
    transfer.find_axis(group, 0, x, particles, constants)
    transfer.find_axis(group, 1, y, particles, constants)
    top_speed2 = 0.0
    ended_inside = 0
    start = group * particles.lanes
    for k in range(ti.min(particles.lanes, end - start)):
        motion = transfer.grid_to_particle(start + k, k, x, y, part, particles, nodes, constants, dt)
        speed2, inside = step_6_to_9_particle(start + k, motion, part, particles, nodes, constants, dt, gravity)
        top_speed2 = ti.max(top_speed2, speed2)
        ended_inside += inside
    return top_speed2, ended_inside


@ti.func
def step_6_to_9_particle(
    p,
    motion: ti.template(),
    part,
    particles: ti.template(),
    nodes: ti.template(),
    constants: ti.template(),
    dt,
    gravity,
):
    """Step 6: trial deformation.  Step 7: velocity.  Step 8: collision.  Step 9: position.

    ``motion``: what the grid gives (velocity, grad v, B).  Returns the particle's speed squared, and 1 if it ended
    inside the floor, else 0.
    """
    velocity, gradient, affine = motion
    particles.F_E[p] = particles.F_E[p] + dt * (gradient @ particles.F_E[p])  # step 6; clamped in update_stress
    position = particles.position[p]
    mass, force = particles.mass[p], particles.force[p]
    inside = 0
    if ti.static(constants.indents):
        free = velocity
        velocity = indenter.particle_velocity(p, free, position, mass, nodes.indenter, constants)
        particles.sliding_work[p] += 0.5 * mass * (velocity.norm_sqr() - free.norm_sqr())
        particles.sliding_impulse[p] += mass * (velocity - free)
    if contact.near_floor(position, part, nodes, constants):
        distance, normal = contact.floor_at(position, part, nodes, constants)
        if ti.static(not constants.springs) and distance <= constants.touch:
            free = velocity
            velocity = contact.slide(free, normal, constants.friction)  # step 8
            particles.sliding_work[p] += 0.5 * mass * (velocity.norm_sqr() - free.norm_sqr())
            particles.sliding_impulse[p] += mass * (velocity - free)
        distance, normal = contact.floor_at(position + dt * velocity, part, nodes, constants)
        if distance < 0.0:
            inside = 1
            if ti.static(constants.moves_out):
                position -= distance * normal
                particles.lifting_work[p] -= mass * gravity * distance * normal[1]
    particles.pressing_work[p] += dt * mass * force.dot(velocity)
    particles.velocity[p] = velocity  # step 7
    particles.affine[p] = affine
    particles.position[p] = position + dt * velocity  # step 9
    return velocity.norm_sqr(), inside
