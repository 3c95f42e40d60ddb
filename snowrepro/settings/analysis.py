"""What counts as a lump."""

from typing import Literal

from pydantic import Field

from .base import Settings


class Analysis(Settings):
    """What counts as a lump."""

    definition: Literal["bonds", "proximity", "grid", "damage"] = Field(
        "bonds", description="what holds particles together"
    )
    link_length: float = Field(gt=0, description="longest bond at release [grid spacings]")
    break_strain: float = Field(gt=0, description="|ln(length / length at release)| that breaks a bond [1]")
    break_by: Literal["both", "stretch", "crush"] = Field("both", description="which sign of strain breaks a bond")
    core_fraction: float = Field(gt=0, le=1, description="part of its bonds that a core particle may lose [1]")
    proximity: float = Field(1.0, gt=0, description="proximity: distance that connects [grid spacings]")
    damage: float = Field(0.5, gt=0, le=1, description="damage: part of its bonds that isolates a particle [1]")
    lump_mass: float = Field(gt=0, lt=1, description="least mass of a lump [part of the body]")
    lump_cells: float = Field(ge=0, description="least size of a lump [cells of unpressed snow]")
    settled_change: float = Field(gt=0, description="new broken bonds below which a run is settled [part of the bonds]")
    settled_frames: int = Field(gt=0, description="frames over which settled_change is taken [1]")
