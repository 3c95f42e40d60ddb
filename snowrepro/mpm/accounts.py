"""What a frame's energy and momentum come to, added up particle by particle and node by node in one order."""

import taichi as ti

from . import steps


@ti.kernel
def add_up(particles: ti.template(), nodes: ti.template(), ledger: ti.template(), laws: ti.template()):
    """Fill the ledger's TOTALS: the accounts that the substeps of a frame kept, and the energies at its end, in f64."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        kinetic, elastic, impulse = zero(), zero(), ti.Vector([zero(), zero()])
        pressing, sintering, plastic, hardening, sliding, lifting = zero(), zero(), zero(), zero(), zero(), zero()
        for p in range(particles.count):
            kinetic += steps.kinetic_energy(p, particles, laws)
            elastic += steps.elastic_energy(p, particles)
            pressing += particles.pressing_work[p]
            sintering += particles.sintering_work[p]
            plastic += particles.plastic_work[p]
            hardening += particles.hardening_work[p]
            sliding += particles.sliding_work[p]
            lifting += particles.lifting_work[p]
            impulse += particles.sliding_impulse[p]
        on_nodes, damping, contact = zero(), zero(), zero()
        for i, j in ti.ndrange(nodes.size[0], nodes.size[1]):
            on_nodes += nodes.kinetic_work[i, j]
            damping += nodes.damping_work[i, j]
            contact += nodes.contact_work[i, j]
            impulse += nodes.contact_impulse[i, j]
        ledger.totals[None] = ti.Vector(  # in the order of TOTALS
            [
                kinetic,
                elastic,
                pressing,
                sintering,
                plastic,
                hardening,
                sliding,
                lifting,
                on_nodes,
                damping,
                contact,
                impulse[0],
                impulse[1],
            ]
        )


@ti.func
def zero():
    """A sum that keeps the digits of f64 in runs of either precision."""
    return ti.cast(0.0, ti.f64)
