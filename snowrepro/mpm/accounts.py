"""What a frame's energy and momentum come to, added up particle by particle and node by node in one order."""

from ..compiler import ti
from . import steps
from .cases import CHUNK
from .ledger import TOTALS

KINETIC, ELASTIC = TOTALS.index("kinetic_energy"), TOTALS.index("elastic_energy")


@ti.kernel
def fill_totals(particles: ti.template(), nodes: ti.template(), ledger: ti.template(), constants: ti.template()):
    """Fill the ledger's TOTALS: the accounts that the substeps of a frame kept, and the energies at its end, in f64."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        totals = make_empty()
        for p in range(particles.count):
            add_particle(totals, p, particles, constants)
        for i, j in ti.ndrange(nodes.size[0], nodes.size[1]):
            add_accounts(totals, ti.Vector([i, j]), nodes.books)
        ledger.totals[0] = totals


@ti.func
def add_up_chunk(chunk, end, particles: ti.template(), ledger: ti.template(), constants: ti.template()):
    """Add up what the particles of a chunk have, of those before slot ``end``, for ``add_up_case``."""
    totals = make_empty()
    for p in range(chunk * CHUNK, ti.min(chunk * CHUNK + CHUNK, end)):
        add_particle(totals, p, particles, constants)
    ledger.chunk_totals[chunk] = totals


@ti.func
def add_up_column(i, tall, nodes: ti.template(), ledger: ti.template()):
    """Add up what the ``tall`` nodes of a column have, for ``add_up_case``."""
    totals = make_empty()
    for j in range(tall):
        add_accounts(totals, ti.Vector([i, j]), nodes.books)
    ledger.column_totals[i] = totals


@ti.func
def add_up_case(case, ledger: ti.template()):
    """Fill the TOTALS of a case from its chunks and columns."""
    totals = make_empty()
    first, behind = ledger.cases.chunks_of(case)
    for chunk in range(first, behind):
        totals += ledger.chunk_totals[chunk]
    part = ledger.cases.part(case)
    for i in range(part[0], part[0] + part[1]):
        totals += ledger.column_totals[i]
    ledger.totals[case] = totals


@ti.func
def make_empty():
    """Make TOTALS of zero; f64 keeps its digits in runs of either precision."""
    return ti.Vector.zero(ti.f64, ti.static(len(TOTALS)))


@ti.func
def add_particle(totals: ti.template(), p, particles: ti.template(), constants: ti.template()):
    """Add the energies of a particle and what its books hold to ``totals``."""
    totals[KINETIC] += steps.kinetic_energy(p, particles, constants)
    totals[ELASTIC] += steps.elastic_energy(p, particles, constants)
    add_accounts(totals, p, particles.books)


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
