"""How much a case takes, counted before anything of it is built."""

from ..errors import ConfigError
from ..settings.case import Case

MOST_PARTICLES = 2_000_000
MOST_NODES = 4_000_000
MOST_STORED_BYTES = 8_000_000_000
BYTES_OF_A_PARTICLE = 64  # in one stored state


def require_affordable(case: Case, area: float, box: float, width: float, height: float) -> None:
    """Check that a case does not take too many particles, grid nodes or stored states.

    ``area`` of the snow and of the ``box`` around it, which its lattice fills [cells^2]; ``width`` and ``height`` of
    the domain [cells].  Raises ConfigError with the number and the bound.
    """
    dx, finer = case.fidelity.dx, "; a coarser grid (fidelity.dx) or smaller outlines take fewer"
    in_a_cell = case.fidelity.particles_per_cell / dx**2
    particles = area * in_a_cell
    _require_at_most(MOST_PARTICLES, particles, f"particles of shape '{case.shape.name}'", finer)
    _require_at_most(MOST_PARTICLES, box * in_a_cell, f"places for particles around shape '{case.shape.name}'", finer)
    nodes = (width / dx + 1) * (height / dx + 1)
    _require_at_most(MOST_NODES, nodes, f"grid nodes around floor '{case.floor.name}'", finer)
    states = case.frames / (case.indenter.every if case.indenter else case.output.every) + 3
    _require_at_most(
        MOST_STORED_BYTES, particles * states * BYTES_OF_A_PARTICLE, "bytes of stored states",
        "; a larger output.every stores fewer states",
    )  # fmt: skip


def _require_at_most(bound: int, count: float, what: str, remedy: str) -> None:
    """Raises ConfigError if there were more of something than allowed."""
    if not count <= bound:
        raise ConfigError(f"this would have {count:,.0f} {what}, at most {bound:,} are allowed{remedy}")
