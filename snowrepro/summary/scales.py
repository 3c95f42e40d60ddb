"""Numbers without units that say how a run is scaled, from its configuration alone: gravity, weight, press, drop, grid.

Two readings of the paper with the same five numbers ask for the same motion, whatever their units are.
"""

from ..scene import outline
from ..settings.case import Case


def measure_scales(case: Case) -> dict[str, float]:
    """Return the columns SCALE_COLUMNS of a case by name; the first three are 0 in a hardness test: nothing falls."""
    size = measure_size(case)
    drop = 0.0 if case.indenter else case.reading.drop_height
    return {
        "impact_number": weigh_column(case, drop),
        "self_weight": 0.0 if case.indenter else weigh_column(case, size),
        "drop_in_sizes": drop / size,
        "press_number": case.pressure / case.material.E,
        "spacing_in_sizes": case.fidelity.dx / size,
    }


def measure_size(case: Case) -> float:
    """Return the height D of the body before it is pressed, of a ball its diameter [cells]."""
    low, high = outline.extent(case.shape.outline)
    return float(high[1] - low[1])


def weigh_column(case: Case, height: float) -> float:
    """Return the weight on an area of a column of unpressed snow, over Young's modulus: rho g h / E0 [1].

    ``height``: h in cells.  Of the height of fall it is also the energy of the impact, rho v^2 / 2, over E0.
    """
    return case.material.rho * case.reading.gravity * height * case.reading.cell / case.material.E
