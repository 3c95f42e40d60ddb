"""One frame on one thread, in one kernel: the nine steps in one order, so that a run gives the same bits each time.

A sweep uses the cores by running many cases at once.
"""

from ..compiler import ti
from . import indenter, penalty, steps, transfer
from .state import RUNNING


@ti.kernel
def advance_frame(
    particles: ti.template(),
    nodes: ti.template(),
    ledger: ti.template(),
    constants: ti.template(),
    gravity: float,
    damping: float,
    sinters: ti.i32,
):
    """Advance one frame in substeps whose length follows the stiffness as hardened and sintered.

    ``gravity`` [length/s^2] points down, ``damping`` [1/s] acts on node velocities, ``sinters`` is
    whether Eqs. 2 to 9 act.  The outcome is in ``ledger``; a failure leaves the frame where it happened.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        steps.begin_frame(0, ledger, constants)
        for p in range(particles.count):
            steps.clear_particle_accounts(p, particles, nodes, constants)
        for i, j in ti.ndrange(nodes.size[0], nodes.size[1]):
            steps.clear_node_accounts(i, j, nodes, constants)
        under_way = True
        while under_way:
            for group in range(particles.lane_groups):  # behind the last substep too: what is stored has yielded
                steps.update_stress(group, ledger.substeps[0] == 0, particles, constants)
            under_way = steps.goes_on(0, ledger)
            if under_way:
                survey(particles, ledger, constants)
                steps.choose_time_step(0, ledger, constants)
                under_way = ledger.status[0] == RUNNING
            if under_way:
                advance_substep(particles, nodes, ledger, constants, gravity, damping, sinters)
        if ledger.status[0] == RUNNING:
            for p in range(particles.count):
                particles.von_mises[p] = steps.von_mises(p, particles, constants)


@ti.func
def survey(particles: ti.template(), ledger: ti.template(), constants: ti.template()):
    """Find the first particle that is not sound, the fastest wave, and the nodes in use."""
    culprit = steps.NOBODY
    fastest = 0.0
    low = ti.Vector([steps.NOBODY, steps.NOBODY])
    high = ti.Vector([0, 0])
    for p in range(particles.count):
        cell = steps.cell_of(p, particles, constants)
        low = ti.min(low, cell)
        high = ti.max(high, cell)
        fastest = ti.max(fastest, particles.wave_speed2[p])
        if not steps.is_sound(p, ledger.cases.part(0), particles, constants):
            culprit = ti.min(culprit, p)
    ledger.particle[0] = culprit
    ledger.wave_speed2[0] = fastest
    ledger.low[0] = low - 2
    ledger.high[0] = high + 4


@ti.func
def advance_substep(
    particles: ti.template(),
    nodes: ti.template(),
    ledger: ti.template(),
    constants: ti.template(),
    gravity,
    damping,
    sinters,
):
    """The nine steps, on the nodes in use; stresses are up to date."""
    dt, low, high = ledger.dt[0], ledger.low[0], ledger.high[0]
    part = ledger.cases.part(0)
    for i, j in ti.ndrange((low[0], high[0]), (low[1], high[1])):
        steps.clear(i, j, nodes, constants)
    for group in range(particles.lane_groups):
        transfer.group_to_grid(group, particles.count, part, particles, nodes, constants, dt)  # steps 1 and 3
    if ti.static(constants.springs):
        for p in range(particles.count):
            penalty.press(p, part, particles, nodes, constants, dt)
    if sinters and (constants.every_substep or ledger.substeps[0] == 1):
        for p in range(particles.count):
            steps.sinter(p, particles, constants, dt)
    for i, j in ti.ndrange((low[0], high[0]), (low[1], high[1])):
        steps.step_4_and_5_node_velocity(i, j, nodes, constants, dt, gravity, damping)
    top_speed2 = 0.0
    ended_inside = 0
    for group in range(particles.lane_groups):
        speed2, inside = steps.step_6_to_9_group(group, particles.count, part, particles, nodes, constants, dt, gravity)
        top_speed2 = ti.max(top_speed2, speed2)
        ended_inside += inside
    if ti.static(constants.indents):
        indenter.move(nodes.indenter, dt)
    ledger.top_speed2[0] = top_speed2
    ledger.ended_inside[0] += ended_inside


@ti.kernel
def step_2_volume(particles: ti.template(), nodes: ti.template(), ledger: ti.template(), constants: ti.template()):
    """Step 2, at the first substep only: particle density on the grid and from it the volume (Stomakhin)."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        for i, j in ti.ndrange(nodes.size[0], nodes.size[1]):
            steps.clear(i, j, nodes, constants)
        for group in range(particles.lane_groups):
            part = ledger.cases.part(0)
            transfer.group_to_grid(group, particles.count, part, particles, nodes, constants, 0.0)
        for i, j in ti.ndrange(nodes.size[0], nodes.size[1]):
            transfer.collect(i, j, nodes, constants)
        for p in range(particles.count):
            density = transfer.grid_mass_at(p, ledger.cases.part(0), particles, nodes, constants) / constants.dx**2
            particles.volume[p] = particles.mass[p] / density
