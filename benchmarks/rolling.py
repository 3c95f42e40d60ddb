"""How a disc rolls and slips down a slope by each choice of contact, beside theory.

    python benchmarks/rolling.py [--quick] [--write]

--quick: the smallest disc alone.  --write: also to benchmarks/rolling.md.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from tables import format_table

sys.path.append(str(Path(__file__).resolve().parents[1]))  # the discs are those of the tests

from tests.validation.disc import Incline, accelerate, start_disc

RESULTS = Path(__file__).with_name("rolling.md")
RADII = (5, 9, 18)  # cells
SLOPES = ((12, 0.5), (33, 0.1))  # degrees and friction: rolls, slips
CONTACTS = ("legacy", "coulomb", "penalty")
FRAME_TIME = 0.02
SLIPPING_FRAMES = 150
HEAD = ["disc", "slope", "acceleration [cells/s²]", "theory", *(f"`{contact}`" for contact in CONTACTS)]
HOW = (
    "An elastic disc (E = 10⁷, c = 330 cells/s) of particles on circles is let go at rest, its edge on the slope, and "
    "followed for half a turn if it rolls and for 3 s if it slips. Accelerations are fitted to the last two thirds; in "
    "brackets as a part of theory, which is that of a rigid disc. The spin is the angular momentum over the inertia of "
    "the mass on the grid."
)


def main() -> None:
    """Run all discs and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    radii = RADII[:1] if arguments.quick else RADII
    rows = [row for radius in radii for degrees, mu in SLOPES for row in compare(Incline(radius, degrees, mu))]
    page = ["# Discs on a slope", "", "`python benchmarks/rolling.py --write` makes this page.", "", HOW, ""]
    page += format_table(HEAD, rows)
    print("\n".join(page))
    if arguments.write:
        RESULTS.write_text("\n".join(page) + "\n", encoding="utf-8")


def compare(incline: Incline) -> list[list[str]]:
    """Two rows: the acceleration and that of the spin, by theory and by each contact."""
    half_turn = np.sqrt(2 * np.pi * incline.radius / incline.theory[0])
    frames = round(half_turn / FRAME_TIME) if incline.rolls else SLIPPING_FRAMES
    found = [accelerate(incline, start_disc(incline, contact), frames) for contact in CONTACTS]
    about = [f"R = {incline.radius:g}", f"{incline.degrees:g}°, μ = {incline.friction:g}"]
    names = ("down the slope", "of the spin, times R")
    return [
        [*about, name, f"{scale * exact:.3f}", *(f"{scale * row[i]:.3f} ({row[i] / exact:.2f})" for row in found)]
        for i, (name, exact, scale) in enumerate(zip(names, incline.theory, (1, incline.radius), strict=True))
    ]


if __name__ == "__main__":
    main()
