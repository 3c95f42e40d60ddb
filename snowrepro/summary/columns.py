"""The columns of the rows of numbers: what each means, and its unit; see ``summary.measure``."""

from collections.abc import Iterable
from dataclasses import dataclass

from .. import quantities, units
from ..settings.case import Case

TEXT = ""
CELLS = "cells"


@dataclass(frozen=True)
class Column:
    """A column of the rows of numbers.

    ``long_name``: what it means; ``powers``: its unit as ``units.text`` reads it, CELLS for the paper's cells in any
    reading, TEXT for words; ``note``: what the page of all columns adds.
    """

    long_name: str
    powers: str = "1"
    note: str = ""

    @property
    def is_text(self) -> bool:
        """Whether it holds words, and no numbers."""
        return self.powers == TEXT

    def attrs(self, length_unit: str) -> dict[str, str]:
        """Return the attributes of a variable that holds the column; words have no unit."""
        if self.is_text:
            return {"long_name": self.long_name}
        unit = "cell" if self.powers == CELLS else units.text(self.powers, length_unit)
        return {"long_name": self.long_name, "units": unit}

    def format_unit(self, length_units: Iterable[str]) -> str:
        """Format the unit for people; empty for words and for numbers without one."""
        if self.is_text:
            return ""
        return "cells" if self.powers == CELLS else quantities.format_powers(self.powers, length_units)


# What was simulated.
CASE_COLUMNS = {
    "run_id": Column("id of the run in the store", TEXT),
    "shape": Column("snow shape", TEXT),
    "floor": Column("floor", TEXT),
    "sintering": Column("sintering while pressed", TEXT),
    "pressure": Column("nominal pressure at the centre of the pressed snow", "M/L/T2"),
    "reading": Column("reading of the paper", TEXT),
    "fidelity": Column("fidelity", TEXT),
    "seed": Column("seed of the particles' random places"),
}

# What the configuration alone says: see ``summary.scales``.
SCALE_COLUMNS = {
    "impact_number": Column(
        "impact number, rho g H / E0",
        "1",
        "H is the height of fall. It is the energy of the snow as it arrives, rho v² / 2 with "
        "v² = 2 g H, over Young's modulus, all before the snow is pressed. 0 in a hardness test, where nothing falls",
    ),
    "self_weight": Column(
        "self-weight, rho g D / E0",
        "1",
        "D is the height of the snow's outline before it is pressed, of a ball its diameter. It is the pressure at the "
        "foot of snow that stands D high, over Young's modulus. 0 in a hardness test, which has no gravity",
    ),
    "drop_in_sizes": Column("height of fall in body sizes, H / D", "1", "0 in a hardness test"),
    "press_number": Column(
        "press number, P / E0", "1", "P is the nominal pressure, E0 Young's modulus before the snow is pressed"
    ),
    "spacing_in_sizes": Column("grid spacing in body sizes, dx / D"),
}

# What every run has.
COMMON_COLUMNS = {
    "particles": Column("number of particles"),
    "fragments_at_release": Column("number of fragments at release"),
    "whole_at_release": Column("whether the snow was one body at release (1 yes, 0 no)"),
    "density_at_release": Column("mean density of Eq. 2 at release", "M/L3"),
    "young_at_release": Column("mean Young's modulus before hardening at release", "M/L/T2"),
    "hardening_at_release": Column("mean hardening coefficient xi at release"),
    "factor_at_release": Column("geometric mean of the hardening factor of Eq. 1 at release"),
    "poisson_capped": Column("most particles in a frame at the cap of Poisson's ratio"),
    "density_capped": Column("most particles in a frame at the maximum density"),
    "hardening_capped": Column("most particles in a frame at the highest exponent of Eq. 1"),
    "hardening_floored": Column("most particles in a frame at the lowest exponent of Eq. 1"),
    "volume_bounded": Column("most particles in a frame at a bound of J_P"),
    "ended_inside": Column("times that a particle ended inside the floor"),
    "energy_unclosed": Column("energy from the release on that no cause explains, part of what causes gave and took"),
    "substeps": Column("number of substeps"),
}

# What only runs that fall have; masses are parts of the whole body, at the last frame.
FALL_COLUMNS = {
    "definition": Column("what holds particles together in a lump", TEXT),
    "lump_fraction": Column("part of the mass in lumps"),
    "crushed_fraction": Column("part of the mass that was compacted where it lies, and is in no lump"),
    "loose_fraction": Column("part of the mass that came apart"),
    "powder_fraction": Column("part of the mass that is there and in no lump: crushed or loose"),
    "vanished": Column("part of the mass that is no longer there"),
    "lumps": Column("number of lumps"),
    "fragments": Column("number of fragments"),
    "largest_fragment": Column("part of the mass in the heaviest fragment"),
    "median_mass": Column("mass that half of the mass is in fragments at least as heavy as, part of the body"),
    "joined_chance": Column("chance that two random bits of snow are still joined"),
    "effective_number": Column("number of equal fragments with the same chance"),
    "second_moment": Column("chance that two random bits are joined outside the heaviest fragment"),
    "broken_bonds": Column("part of the bonds that broke by a stored frame"),
    "settled": Column("whether hardly any snow comes apart or is crushed any more (1 yes, 0 no)"),
    "changed": Column(
        "part of the mass that changed its state in the last frames (settled_frames), or of neighbours that parted, "
        "the larger"
    ),
    "strain_at_gauge": Column(
        "mean strain since the release",
        "1",
        "|ln| of the stretch in the direction of most strain, over neighbourhoods of a fixed size "
        "(analysis.strain_radius, in the paper's cells, on any grid), by mass; cracks inside of one count. It needs no "
        "threshold",
    ),
    "lumps_by_strain": Column("part of the mass in lumps by the strain of neighbourhoods"),
    "lumps_by_bonds": Column("part of the mass in lumps if bonds held particles together"),
    "lumps_by_proximity": Column("part of the mass in lumps if all near particles held together"),
    "lumps_by_grid": Column("part of the mass in lumps if all particles in touching grid cells held together"),
    "lumps_by_damage": Column("part of the mass in lumps if near particles with enough unbroken bonds held together"),
    "bodies_seen": Column("number of bodies that an eye sees at the end, as large as the least lump of unpressed snow"),
    "largest_seen": Column("part of the area that snow covers at the end in the largest body that an eye sees"),
    "raggedness": Column("perimeter squared of that body over 4 pi times its area, without holes: 1 for a disc"),
    "end_frame": Column(
        "frame in which the run ended",
        "1",
        "the last of loading.frames, or the one in which the snow had been at rest for long enough (loading.rest)",
    ),
    "impact_speed": Column("largest speed of a particle while falling", "L/T"),
    "flattening_most": Column("height lost from the release on at most, part of the height at release"),
    "flattening_end": Column("height lost from the release to the end, part of the height at release"),
    "rebound": Column("largest upward speed of the body after the impact over the speed of the impact"),
}

# What only hardness tests have.
TEST_COLUMNS = {
    "indenter": Column("indenter", TEXT),
    "hardness": Column("mean force over mean contact chord in the last tenth of the depth", "M/L/T2"),
    "hardness_depth": Column("depth of the indenter below first touch at the end", CELLS),
    "indentation_work": Column("work of the indenter at unit depth out of the plane", "M L2/T2"),
}

COST_COLUMNS = {
    "seconds": Column(
        "wall time of the run",
        "T",
        "from building the scene to the last frame, with compiling and checkpoints; of a run that was interrupted, "
        "all parts that its result is made of",
    ),
    "seconds_per_frame": Column(
        "wall time of a frame",
        "T",
        "the mean in the process that finished the run, without the first two frames there, which compile; so all "
        "frames together take less than seconds",
    ),
}


def find_columns(cases: Iterable[Case]) -> dict[str, Column]:
    """Find the columns that the rows of some cases have, by name, whether they have been simulated or not."""
    kinds = {case.indenter is not None for case in cases}
    return {
        **CASE_COLUMNS,
        **SCALE_COLUMNS,
        **COMMON_COLUMNS,
        **(FALL_COLUMNS if False in kinds else {}),
        **(TEST_COLUMNS if True in kinds else {}),
        **COST_COLUMNS,
    }
