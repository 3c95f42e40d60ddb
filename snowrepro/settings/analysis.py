"""What counts as a lump."""

from typing import Literal

from pydantic import Field, model_validator

from .base import Settings


class Analysis(Settings):
    """What counts as a lump."""

    definition: Literal["strain", "bonds", "proximity", "grid", "damage"] = Field(
        "strain", description="what holds particles together"
    )
    strain_radius: float = Field(
        2.5, gt=0, le=100, description="strain: neighbourhood over which it is measured [cells of the paper]"
    )
    join_reach: float = Field(
        1.5, gt=0, le=100, description="strain: distance at release over which clusters hold together [cells]"
    )
    part_stretch: float = Field(
        1.5, gt=1, description="strain: length that parts a pair of clusters, over that of their neighbourhood [1]"
    )
    volume_change: tuple[float, float] = Field(
        (0.2, 0.5),
        description="strain: |ln(volume / volume at release)| at which snow begins to be crushed or loose, and is [1]",
    )
    stray: float = Field(
        1.0,
        gt=0,
        description="strain: distance of a particle from where its clusters carry it that makes it loose [cells]",
    )
    link_length: float = Field(gt=0, description="longest bond at release [grid spacings]")
    break_strain: float = Field(gt=0, description="|ln(length / length at release)| that breaks a bond [1]")
    break_by: Literal["both", "stretch", "crush"] = Field("both", description="which sign of strain breaks a bond")
    core_fraction: float = Field(gt=0, le=1, description="part of its bonds that a core particle may lose [1]")
    proximity: float = Field(1.0, gt=0, description="proximity: distance that connects [grid spacings]")
    damage: float = Field(0.5, gt=0, le=1, description="damage: part of its bonds that isolates a particle [1]")
    lump_mass: float = Field(gt=0, lt=1, description="least mass of a lump [part of the body]")
    lump_cells: float = Field(ge=0, description="least size of a lump [cells of unpressed snow]")
    settled_change: float = Field(
        gt=0,
        description="mass that changes its state, or neighbours that part, below which a run is settled [part of all]",
    )
    settled_frames: int = Field(gt=0, description="frames over which settled_change is taken [1]")

    @model_validator(mode="after")
    def _strain_can_be_judged(self) -> "Analysis":
        least, most = self.volume_change
        if not 0 <= least < most:
            raise ValueError(f"volume_change must be two numbers that rise from 0 on, not {least:g} and {most:g}")
        if self.join_reach > self.strain_radius:
            raise ValueError(
                f"join_reach ({self.join_reach:g}) must not exceed strain_radius ({self.strain_radius:g}): farther "
                "neighbours are not followed"
            )
        return self
