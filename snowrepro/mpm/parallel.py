"""The same stages with each loop spread over threads or over a GPU, for one case or for many side by side.

Only node sums depend on the order of particles, so in fixed point the result is the same at any number of threads and
in any company; all else that is shared are minima, maxima and counts.  Sums over a frame are taken by chunks of
particles and columns of nodes, each in order, and then over these in order.

Each case goes through its frames on its own: a substep does nothing to a case whose frame is over or has failed.
"""

import numpy as np

from ..compiler import ti
from . import accounts, indenter, penalty, steps, transfer
from .cases import CHUNK
from .constants import Constants
from .state import RUNNING, Ledger, Nodes, Particles

AHEAD = 8  # substeps launched before looking whether a frame has ended; those beyond its end do nothing


def advance_frame(
    particles: Particles,
    nodes: Nodes,
    ledger: Ledger,
    constants: Constants,
    gravity: float,
    damping: float,
    sinters: int,
) -> None:
    """Advance one frame of a single case; the parameters and the outcome are those of ``serial.advance_frame``."""
    chosen = np.ones(1, dtype=np.int32)
    begin(particles, nodes, ledger, constants, chosen, np.array([[gravity, damping, sinters]], dtype=float))
    while ledger.status[0] == RUNNING and ledger.under_way[0]:
        advance_substeps(particles, nodes, ledger, constants)
    end(particles, nodes, ledger, constants, chosen)


def advance_substeps(particles: Particles, nodes: Nodes, ledger: Ledger, constants: Constants) -> None:
    """Advance all cases by a few substeps, as far as their frames go."""
    for _ in range(AHEAD):
        advance_substep(particles, nodes, ledger, constants)


@ti.kernel
def find_volumes(particles: ti.template(), nodes: ti.template(), ledger: ti.template(), constants: ti.template()):
    """Step 2, at the first substep only: particle density on the grid and from it the volume (Stomakhin)."""
    for i, j in ti.ndrange(nodes.size[0], nodes.size[1]):
        steps.clear(i, j, nodes, constants)
    for group in range(particles.lane_groups):
        case = ledger.cases.of_particle(group * particles.lanes)
        part, end = ledger.cases.part(case), ledger.cases.end(case)
        transfer.group_to_grid(group, end, part, particles, nodes, constants, 0.0)
    for i, j in ti.ndrange(nodes.size[0], nodes.size[1]):
        transfer.collect(i, j, nodes, constants)
    for p in range(particles.slots):
        case = ledger.cases.of_particle(p)
        if p < ledger.cases.end(case):
            part = ledger.cases.part(case)
            density = transfer.grid_mass_at(p, part, particles, nodes, constants) / constants.dx**2
            particles.volume[p] = particles.mass[p] / density


@ti.kernel
def begin(
    particles: ti.template(),
    nodes: ti.template(),
    ledger: ti.template(),
    constants: ti.template(),
    chosen: ti.types.ndarray(dtype=ti.i32, ndim=1),
    orders: ti.types.ndarray(dtype=ti.f64, ndim=2),
):
    """Start a frame of the ``chosen`` cases; ``orders``: of each case gravity, damping, and whether it sinters."""
    for case in range(ledger.cases.number):
        if chosen[case]:
            steps.begin_frame(case, ledger, constants)
            ledger.gravity[case] = ti.cast(orders[case, 0], float)
            ledger.damping[case] = ti.cast(orders[case, 1], float)
            ledger.sinters[case] = ti.cast(orders[case, 2], ti.i32)
    for p in range(particles.slots):
        if chosen[ledger.cases.of_particle(p)]:
            steps.clear_particle_accounts(p, particles, nodes, constants)
    for i, j in ti.ndrange(nodes.size[0], nodes.size[1]):
        if chosen[ledger.cases.of_column(i)]:
            steps.clear_node_accounts(i, j, nodes, constants)


@ti.kernel
def advance_substep(particles: ti.template(), nodes: ti.template(), ledger: ti.template(), constants: ti.template()):
    """One substep of each case whose frame is not over."""
    for case in range(ledger.cases.number):
        begin_survey(case, ledger)
    for group in range(particles.lane_groups):
        case = ledger.cases.of_particle(group * particles.lanes)
        if ledger.active[case]:
            steps.update_stress(group, ledger.substeps[case] == 0, particles, constants)
    for chunk in range(ledger.cases.chunks):
        case = ledger.cases.of_particle(chunk * CHUNK)
        if ledger.active[case]:
            survey(chunk, case, particles, ledger, constants)
    for case in range(ledger.cases.number):
        if ledger.active[case]:
            end_survey(case, ledger, constants)
    for i, j in ti.ndrange(nodes.size[0], nodes.size[1]):
        if is_in_use(i, j, ledger):
            steps.clear(i, j, nodes, constants)
    for group in range(particles.lane_groups):
        case = ledger.cases.of_particle(group * particles.lanes)
        if ledger.active[case]:
            part, end, dt = ledger.cases.part(case), ledger.cases.end(case), ledger.dt[case]
            transfer.group_to_grid(group, end, part, particles, nodes, constants, dt)  # steps 1 and 3
    if ti.static(constants.springs):
        for p in range(particles.slots):
            case = ledger.cases.of_particle(p)
            if ledger.active[case] and p < ledger.cases.end(case):
                penalty.press(p, ledger.cases.part(case), particles, nodes, constants, ledger.dt[case])
    for p in range(particles.slots):
        case = ledger.cases.of_particle(p)
        is_due = constants.every_substep or ledger.substeps[case] == 1
        if ledger.active[case] and ledger.sinters[case] and is_due and p < ledger.cases.end(case):
            steps.sinter(p, particles, constants, ledger.dt[case])
    for i, j in ti.ndrange(nodes.size[0], nodes.size[1]):
        if is_in_use(i, j, ledger):
            case = ledger.cases.of_column(i)
            dt, gravity, damping = ledger.dt[case], ledger.gravity[case], ledger.damping[case]
            steps.step_4_and_5_node_velocity(i, j, nodes, constants, dt, gravity, damping)
    for group in range(particles.lane_groups):
        case = ledger.cases.of_particle(group * particles.lanes)
        if ledger.active[case]:
            part, end = ledger.cases.part(case), ledger.cases.end(case)
            dt, gravity = ledger.dt[case], ledger.gravity[case]
            _, inside = steps.step_6_to_9_group(group, end, part, particles, nodes, constants, dt, gravity)
            if inside:
                ti.atomic_add(ledger.ended_inside[case], inside)
    for chunk in range(ledger.cases.chunks):
        case = ledger.cases.of_particle(chunk * CHUNK)
        if ledger.active[case]:
            find_top_speed(chunk, case, particles, ledger)
    for case in range(ledger.cases.number):
        if ledger.active[case]:
            ledger.top_speed2[case] = from_integer(ledger.fastest_particle[case])
            if ti.static(constants.indents):
                indenter.move(nodes.indenter, ledger.dt[case])


@ti.func
def begin_survey(case, ledger: ti.template()):
    """Nothing is found yet of a case in the substep that begins, if there is one; what a failure left stays."""
    ledger.active[case] = int(steps.goes_on(case, ledger))
    if ledger.active[case]:
        ledger.particle[case] = steps.NOBODY
        ledger.low[case] = ti.Vector([steps.NOBODY, steps.NOBODY])
        ledger.high[case] = ti.Vector([0, 0])
        ledger.fastest_wave[case] = 0
        ledger.fastest_particle[case] = 0


@ti.func
def survey(chunk, case, particles: ti.template(), ledger: ti.template(), constants: ti.template()):
    """Find the first particle of a chunk that is not sound, the fastest wave, and the nodes in use."""
    part = ledger.cases.part(case)
    culprit = steps.NOBODY
    fastest = 0.0
    low = ti.Vector([steps.NOBODY, steps.NOBODY])
    high = ti.Vector([0, 0])
    for p in range(chunk * CHUNK, ti.min(chunk * CHUNK + CHUNK, ledger.cases.end(case))):
        cell = steps.cell_of(p, particles, constants)
        low = ti.min(low, cell)
        high = ti.max(high, cell)
        fastest = ti.max(fastest, particles.wave_speed2[p])
        if not steps.is_sound(p, part, particles, constants):
            culprit = ti.min(culprit, p)
    ti.atomic_min(ledger.particle[case], culprit)
    ti.atomic_max(ledger.fastest_wave[case], as_integer(fastest))
    for d in ti.static(range(2)):
        ti.atomic_min(ledger.low[case][d], low[d] - 2)
        ti.atomic_max(ledger.high[case][d], high[d] + 4)


@ti.func
def end_survey(case, ledger: ti.template(), constants: ti.template()):
    """Choose the time step of a case by what was found; a case that fails is active no more."""
    ledger.wave_speed2[case] = from_integer(ledger.fastest_wave[case])
    steps.choose_time_step(case, ledger, constants)
    ledger.active[case] = int(ledger.status[case] == RUNNING)


@ti.func
def find_top_speed(chunk, case, particles: ti.template(), ledger: ti.template()):
    """Find the square of the highest speed in a chunk of particles."""
    fastest = 0.0
    for p in range(chunk * CHUNK, ti.min(chunk * CHUNK + CHUNK, ledger.cases.end(case))):
        fastest = ti.max(fastest, particles.velocity[p].norm_sqr())
    ti.atomic_max(ledger.fastest_particle[case], as_integer(fastest))


@ti.func
def is_in_use(i, j, ledger: ti.template()):
    """Whether a node is near the particles of a case that is active."""
    case = ledger.cases.of_column(i)
    column = i - ledger.cases.part(case)[0]
    low, high = ledger.low[case], ledger.high[case]
    return ledger.active[case] and low[0] <= column and column < high[0] and low[1] <= j and j < high[1]


@ti.func
def as_integer(square):
    """A number that is not negative, as a whole number of the same order: GPUs compare these in one instruction."""
    return ti.bit_cast(ti.cast(square, ti.f64), ti.i64)


@ti.func
def from_integer(bits):
    """The number that ``as_integer`` made a whole number of."""
    return ti.cast(ti.bit_cast(bits, ti.f64), float)


@ti.kernel
def end(
    particles: ti.template(),
    nodes: ti.template(),
    ledger: ti.template(),
    constants: ti.template(),
    chosen: ti.types.ndarray(dtype=ti.i32, ndim=1),
):
    """End a frame of the ``chosen`` cases, where it did not fail: put what is stored on the yield surface, add up."""
    for group in range(particles.lane_groups):
        case = ledger.cases.of_particle(group * particles.lanes)
        if chosen[case] and ledger.status[case] == RUNNING:
            steps.update_stress(group, False, particles, constants)
    for p in range(particles.slots):
        case = ledger.cases.of_particle(p)
        if chosen[case] and ledger.status[case] == RUNNING:
            particles.von_mises[p] = steps.von_mises(p, particles, constants)
    for chunk in range(ledger.cases.chunks):
        case = ledger.cases.of_particle(chunk * CHUNK)
        if chosen[case]:
            accounts.add_up_chunk(chunk, ledger.cases.end(case), particles, ledger, constants)
    for i in range(nodes.size[0]):
        case = ledger.cases.of_column(i)
        if chosen[case]:
            accounts.add_up_column(i, ledger.cases.part(case)[2], nodes, ledger)
    for case in range(ledger.cases.number):
        if chosen[case]:
            accounts.add_up_case(case, ledger)
