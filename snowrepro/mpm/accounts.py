"""What a frame's energy and momentum come to, added up particle by particle and node by node in one order."""

import taichi as ti

from . import steps
from .ledger import TOTALS

KINETIC, ELASTIC = TOTALS.index("kinetic_energy"), TOTALS.index("elastic_energy")


@ti.kernel
def fill_totals(particles: ti.template(), nodes: ti.template(), ledger: ti.template(), constants: ti.template()):
    """Fill the ledger's TOTALS: the accounts that the substeps of a frame kept, and the energies at its end, in f64."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        totals = ti.Vector.zero(ti.f64, ti.static(len(TOTALS)))  # keeps the digits of f64 in runs of either precision
        for p in range(particles.count):
            totals[KINETIC] += steps.kinetic_energy(p, particles, constants)
            totals[ELASTIC] += steps.elastic_energy(p, particles, constants)
            add_accounts(totals, p, particles.books)
        for i, j in ti.ndrange(nodes.size[0], nodes.size[1]):
            add_accounts(totals, ti.Vector([i, j]), nodes.books)
        ledger.totals[None] = totals


@ti.func
def add_accounts(totals: ti.template(), at, books: ti.template()):
    """Add what the books hold at one particle or node to the sums of their accounts in ``totals``."""
    for book in ti.static(books):
        amount = book.field[at]
        if ti.static(len(book.places) == 1):
            totals[book.places[0]] += amount
        else:
            for d in ti.static(range(len(book.places))):
                totals[book.places[d]] += amount[d]
