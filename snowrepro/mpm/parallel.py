"""The same stages with each loop spread over threads or over a GPU: a kernel call a substep.

Only node sums depend on the order of particles, so in fixed point the result is the same at any number of
threads; all else that is shared are minima, maxima and counts.
"""

import taichi as ti

from . import indenter, penalty, steps, transfer
from .constants import Constants
from .state import RUNNING, Ledger, Nodes, Particles

AHEAD = 8  # substeps launched before looking whether the frame has ended; those beyond its end do nothing


def advance_frame(
    particles: Particles,
    nodes: Nodes,
    ledger: Ledger,
    constants: Constants,
    gravity: float,
    damping: float,
    sinters: int,
) -> None:
    """Advance one frame; the parameters and the outcome are those of ``serial.advance_frame``."""
    begin(particles, nodes, ledger, constants)
    while ledger.status[None] == RUNNING and ledger.under_way[None]:
        for _ in range(AHEAD):
            advance_substep(particles, nodes, ledger, constants, gravity, damping, sinters)
    if ledger.status[None] == RUNNING:
        end(particles, constants)


@ti.kernel
def begin(particles: ti.template(), nodes: ti.template(), ledger: ti.template(), constants: ti.template()):
    """Start the frame's accounts."""
    steps.begin_frame(ledger, constants)
    for p in range(particles.count):
        steps.clear_particle_accounts(p, particles, nodes, constants)
    for i, j in ti.ndrange(nodes.size[0], nodes.size[1]):
        steps.clear_node_accounts(i, j, nodes, constants)


@ti.kernel
def advance_substep(
    particles: ti.template(),
    nodes: ti.template(),
    ledger: ti.template(),
    constants: ti.template(),
    gravity: float,
    damping: float,
    sinters: ti.i32,
):
    """One substep, or nothing if the frame is over."""
    active = int(steps.goes_on(ledger))
    if active:
        ledger.particle[None] = steps.NOBODY
        ledger.wave_speed2[None] = 0.0
        ledger.low[None] = ti.Vector([steps.NOBODY, steps.NOBODY])
        ledger.high[None] = ti.Vector([0, 0])
    for group in range(active * particles.lane_groups):
        steps.update_stress(group, particles, constants)
    for p in range(active * particles.count):
        cell = steps.cell_of(p, particles, constants)
        for d in ti.static(range(2)):
            ti.atomic_min(ledger.low[None][d], cell[d] - 2)
            ti.atomic_max(ledger.high[None][d], cell[d] + 4)
        ti.atomic_max(ledger.wave_speed2[None], particles.wave_speed2[p])
        if not steps.is_sound(p, particles, nodes, constants):
            ti.atomic_min(ledger.particle[None], p)
    if active:
        steps.choose_time_step(ledger, constants)
        ledger.top_speed2[None] = 0.0
    active *= int(ledger.status[None] == RUNNING)
    low, high, dt = ledger.low[None], ledger.high[None], ledger.dt[None]
    wide, tall = active * (high[0] - low[0]), high[1] - low[1]
    for i, j in ti.ndrange(wide, tall):
        steps.clear(low[0] + i, low[1] + j, nodes, constants)
    for p in range(active * particles.count):
        transfer.find_shares(p, p, particles, constants, dt)  # steps 1 and 3
        transfer.add_shares(p, particles.shares, nodes, constants)
    if ti.static(constants.springs):
        for p in range(active * particles.count):
            penalty.press(p, particles, nodes, constants, dt)
    sintering = active * int(sinters and (constants.every_substep or ledger.substeps[None] == 1))
    for p in range(sintering * particles.count):
        steps.sinter(p, particles, constants, dt)
    for i, j in ti.ndrange(wide, tall):
        steps.step_4_and_5_node_velocity(low[0] + i, low[1] + j, nodes, constants, dt, gravity, damping)
    for p in range(active * particles.count):
        speed2, inside = steps.step_6_to_9_particle(p, particles, nodes, constants, dt, gravity)
        ti.atomic_max(ledger.top_speed2[None], speed2)
        if inside:
            ti.atomic_add(ledger.ended_inside[None], 1)
    if ti.static(constants.indents):
        indenter.move(nodes.indenter, active * dt)


@ti.kernel
def end(particles: ti.template(), constants: ti.template()):
    """Put what is stored on the yield surface."""
    for group in range(particles.lane_groups):
        steps.update_stress(group, particles, constants)
    for p in range(particles.count):
        particles.von_mises[p] = steps.von_mises(p, particles, constants)
