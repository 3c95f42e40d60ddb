"""The nine steps of Fig. 1 in order, and the sintering update between steps 3 and 4 (Sec. 3.4).

One kernel call advances one frame on one thread.  Loops inside it run serially and in one order,
so a run gives the same bits each time; a sweep uses the cores by running many cases at once.
"""

import taichi as ti

from ..physics import elasticity, plasticity, sintering
from . import contact, transfer
from .state import BAD_STRAIN, LANES, LEFT_GRID, RUNNING, TOO_MANY_SUBSTEPS


@ti.kernel
def advance_frame(
    particles: ti.template(),
    nodes: ti.template(),
    ledger: ti.template(),
    laws: ti.template(),
    gravity: ti.f64,
    damping: ti.f64,
    sinters: ti.i32,
):
    """Advance one frame in substeps whose length follows the stiffness as hardened and sintered.

    ``gravity`` [length/s^2] points down, ``damping`` [1/s] acts on node velocities, ``sinters`` is
    whether Eqs. 2 to 9 act.  The outcome is in ``ledger``; a failure leaves the frame where it happened.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        elapsed = 0.0
        substep = 0
        status = RUNNING
        culprit = -1
        ended_inside = 0
        smallest_step = laws.frame_time
        top_speed2 = ledger.top_speed2[None]

        while status == RUNNING and elapsed < laws.frame_time:
            update_stress(particles, laws)
            status, culprit, wave_speed2, low, high = survey(particles, nodes, laws)
            remaining = laws.frame_time - elapsed
            longest = laws.cfl * laws.dx / (ti.sqrt(wave_speed2) + ti.sqrt(top_speed2))
            if status == RUNNING and remaining / longest > laws.max_substeps - substep:
                status = TOO_MANY_SUBSTEPS
            if status == RUNNING:
                # Equal substeps up to the end of the frame, none of them a sliver.
                count = ti.max(1.0, ti.ceil(remaining / longest))
                dt = remaining / count
                smallest_step = ti.min(smallest_step, dt)

                sinters_now = sinters and (laws.every_substep or substep == 0)
                top_speed2, inside = advance_substep(
                    particles, nodes, laws, dt, low, high, gravity, damping, sinters_now
                )
                ended_inside += inside
                substep += 1
                elapsed += dt
                if count < 1.5:
                    elapsed = laws.frame_time

        if status == RUNNING:
            update_stress(particles, laws)  # what is stored lies on the yield surface
            for p in range(particles.count):
                particles.von_mises[p] = von_mises(p, particles, laws)
        ledger.status[None] = status
        ledger.particle[None] = culprit
        ledger.substeps[None] = substep
        ledger.ended_inside[None] = ended_inside
        ledger.elapsed[None] = elapsed
        ledger.smallest_step[None] = smallest_step
        ledger.top_speed2[None] = top_speed2


@ti.func
def advance_substep(
    particles: ti.template(), nodes: ti.template(), laws: ti.template(), dt, low, high, gravity, damping, sinters_now
):
    """The nine steps, on nodes ``low`` to ``high``; stresses are up to date.

    Returns the largest particle speed squared and how many particles ended inside the floor.
    """
    clear(nodes, low, high)
    for p in range(particles.count):
        transfer.particles_to_grid(p, particles, nodes, laws, dt)  # steps 1 and 3; step 2 is step_2_volume
    if sinters_now:
        for p in range(particles.count):
            sinter(p, particles, laws, dt)
    for i, j in ti.ndrange((low[0], high[0]), (low[1], high[1])):
        step_4_and_5_node_velocity(i, j, nodes, laws, dt, gravity, damping)
    top_speed2 = 0.0
    ended_inside = 0
    for p in range(particles.count):
        speed2, inside = step_6_to_9_particle(p, particles, nodes, laws, dt)
        top_speed2 = ti.max(top_speed2, speed2)
        ended_inside += inside
    return top_speed2, ended_inside


@ti.kernel
def step_2_volume(particles: ti.template(), nodes: ti.template(), laws: ti.template()):
    """Step 2, at the first substep only: particle density on the grid and from it the volume (Stomakhin)."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        for i, j in ti.ndrange(nodes.size[0], nodes.size[1]):
            nodes.mass[i, j] = 0.0
        for p in range(particles.count):
            transfer.particles_to_grid(p, particles, nodes, laws, 0.0)
        for p in range(particles.count):
            density = transfer.grid_mass_at(p, particles, nodes, laws) / laws.dx**2
            particles.volume[p] = particles.mass[p] / density


@ti.func
def update_stress(particles: ti.template(), laws: ti.template()):
    """Clamp the trial F_E that step 6 left, harden (Eq. 1), and store the stress that step 3 needs.

    Straight-line arithmetic over LANES particles into local arrays, which the compiler vectorises;
    writing the fields inside the first loop would prevent it.
    """
    for group in range(particles.lane_groups):
        F00, F01, F10, F11 = lanes(), lanes(), lanes(), lanes()
        tau_xx, tau_xy, tau_yy = lanes(), lanes(), lanes()
        J_P, wave_speed2 = lanes(), lanes()
        for k in range(LANES):
            p = group * LANES + k
            trial = particles.F_E[p]
            R = elasticity.polar_rotation(trial)
            F_E, ratio = plasticity.clamp_stretches(trial, R, laws.lowest_stretch, laws.highest_stretch)
            volume_ratio = elasticity.clamp(particles.J_P[p] * ratio, laws.plastic_volume[0], laws.plastic_volume[1])
            h = elasticity.hardening_factor(
                particles.hardening[p], volume_ratio, laws.hardening_exponent[0], laws.hardening_exponent[1]
            )
            mu, lam = h * particles.mu[p], h * particles.lam[p]
            tau = elasticity.kirchhoff_stress(F_E, R, mu, lam)
            F00[k], F01[k], F10[k], F11[k] = F_E[0, 0], F_E[0, 1], F_E[1, 0], F_E[1, 1]
            tau_xx[k], tau_xy[k], tau_yy[k] = tau[0, 0], tau[0, 1], tau[1, 1]
            J_P[k] = volume_ratio
            wave_speed2[k] = ti.select(
                trial.determinant() > 0.0, (lam + 2.0 * mu) * particles.volume[p] / particles.mass[p], -1.0
            )
        for k in range(LANES):
            p = group * LANES + k
            particles.F_E[p] = ti.Matrix([[F00[k], F01[k]], [F10[k], F11[k]]])
            particles.tau[p] = ti.Matrix([[tau_xx[k], tau_xy[k]], [tau_xy[k], tau_yy[k]]])
            particles.J_P[p] = J_P[k]
            particles.wave_speed2[p] = wave_speed2[k]


@ti.func
def lanes():
    """A local array of LANES zeros."""
    return ti.Vector([0.0] * LANES)


@ti.func
def survey(particles: ti.template(), nodes: ti.template(), laws: ti.template()):
    """Return (status, particle at fault, largest wave speed squared, and the range of nodes in use).

    Comparisons are written so that NaN fails them.
    """
    status = RUNNING
    culprit = -1
    fastest = 0.0
    lowest = ti.Vector([1e300, 1e300])
    highest = ti.Vector([-1e300, -1e300])
    for p in range(particles.count):
        position = particles.position[p]
        fastest = ti.max(fastest, particles.wave_speed2[p])
        lowest = ti.min(lowest, position)
        highest = ti.max(highest, position)
        inside = True
        for d in ti.static(range(2)):
            inside = inside and position[d] > 2.0 * laws.dx and position[d] < (nodes.size[d] - 3) * laws.dx
        if not inside:
            status = LEFT_GRID
            culprit = p
        if not (particles.wave_speed2[p] > 0.0 and particles.wave_speed2[p] < 1e300):
            status = BAD_STRAIN
            culprit = p
    low = ti.Vector([0, 0])
    high = ti.Vector([0, 0])
    if status == RUNNING:
        low = ti.floor(lowest / laws.dx, ti.i32) - 2
        high = ti.floor(highest / laws.dx, ti.i32) + 4
    return status, culprit, fastest, low, high


@ti.func
def clear(nodes: ti.template(), low, high):
    """Empty the nodes in use."""
    for i, j in ti.ndrange((low[0], high[0]), (low[1], high[1])):
        nodes.mass[i, j] = 0.0
        nodes.momentum[i, j] = ti.Vector.zero(ti.f64, 2)


@ti.func
def von_mises(p, particles: ti.template(), laws: ti.template()):
    """Eqs. 3 to 5 at particle p, with the moduli as hardened."""
    h = elasticity.hardening_factor(
        particles.hardening[p], particles.J_P[p], laws.hardening_exponent[0], laws.hardening_exponent[1]
    )
    return elasticity.von_mises_stress(
        particles.F_E[p], particles.J_P[p], h * particles.mu[p], h * particles.lam[p], laws.plane_strain
    )


@ti.func
def sinter(p, particles: ti.template(), laws: ti.template(), dt):
    """Secs. 3.1 to 3.3: density, elasticity and plasticity of particle p after one update.

    An update stands for the substep, or for the whole frame where the reading updates once a frame.
    """
    time_step = dt if ti.static(laws.every_substep) else laws.frame_time
    weight = time_step / laws.frame_time if ti.static(laws.hardening_per_time) else 1.0
    sigma_m = von_mises(p, particles, laws)
    b_norm = particles.force[p].norm() * laws.force_weight
    rho = particles.density[p]
    rho_r = sintering.relative_density(rho, laws.rho_max)

    new_rho = ti.min(sintering.density(rho, sigma_m, rho_r, b_norm, time_step, laws.C1, laws.C2), laws.rho_max)
    particles.density[p] = new_rho
    particles.young[p] = sintering.youngs_modulus(rho_r, laws.E_max, laws.C3)
    particles.poisson[p] = ti.min(sintering.poissons_ratio(rho_r, laws.nu_max), laws.poisson_cap)
    particles.hardening[p] = sintering.hardening_coefficient(
        particles.hardening[p], sigma_m, b_norm, weight, laws.C4, laws.C5
    )
    particles.mu[p], particles.lam[p] = elasticity.lame_parameters(particles.young[p], particles.poisson[p])
    if ti.static(laws.volume_follows_density):
        particles.volume[p] = particles.volume[p] * rho / new_rho


@ti.func
def step_4_and_5_node_velocity(i, j, nodes: ti.template(), laws: ti.template(), dt, gravity, damping):
    """Step 4: velocity from momentum, gravity and damping.  Step 5: collision of the node with the floor."""
    if nodes.mass[i, j] > 0.0:
        velocity = nodes.momentum[i, j] / nodes.mass[i, j]
        velocity[1] -= dt * gravity
        velocity *= 1.0 / (1.0 + dt * damping)
        nodes.velocity[i, j] = contact.node_velocity(velocity, nodes.distance[i, j], nodes.normal[i, j], laws)


@ti.func
def step_6_to_9_particle(p, particles: ti.template(), nodes: ti.template(), laws: ti.template(), dt):
    """Step 6: trial deformation.  Step 7: velocity.  Step 8: collision.  Step 9: position.

    Returns the particle's speed squared, and 1 if it ended inside the floor, else 0.
    """
    velocity, gradient, affine = transfer.grid_to_particle(p, particles, nodes, laws)
    particles.F_E[p] = particles.F_E[p] + dt * (gradient @ particles.F_E[p])  # step 6; clamped in update_stress
    position = particles.position[p]
    inside = 0
    if contact.near_floor(position, nodes, laws):
        distance, normal = contact.floor_at(position, nodes, laws)
        if distance <= contact.TOUCH * laws.dx:
            velocity = contact.slide(velocity, normal, laws.friction)  # step 8
        distance, normal = contact.floor_at(position + dt * velocity, nodes, laws)
        if distance < 0.0:
            inside = 1
            if ti.static(laws.moves_out):
                position -= distance * normal
    particles.velocity[p] = velocity  # step 7
    particles.affine[p] = affine
    particles.position[p] = position + dt * velocity  # step 9
    return velocity.norm_sqr(), inside
